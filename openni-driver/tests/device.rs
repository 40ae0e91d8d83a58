//! Simulated sensors as devices of the real OpenNI2. Says so and passes where OpenNI2 is not installed.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod support;

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use posefuse_devices::openni::{
    DepthStream, DeviceEvent, Frame, OpenNiError, Playback, Recorder, WantedMode,
};
use posefuse_simulator::depth::DepthCamera;
use posefuse_simulator::{Scenario, World};
use support::Room;

/// The driver's own property: when the sensor's clock showed 0, ns since 1970.
const CLOCK_ZERO: i32 = 0x504f_0001;
/// One sensor for each test, so that they may run at once.
const REST: &str = "[scenario]\nsensors = 4\nseed = 3\n";

fn room() -> Option<&'static Room> {
    support::room(4, REST)
}

fn world() -> World {
    let scenario = Scenario {
        sensors: 4,
        seed: 3,
        ..Scenario::default()
    };
    World::new(&scenario).unwrap()
}

fn frames(stream: &DepthStream, count: usize) -> Vec<Frame> {
    let next = || {
        stream
            .next(Duration::from_secs(5))
            .unwrap()
            .expect("a frame")
    };
    (0..count).map(|_| next()).collect()
}

#[test]
fn a_simulated_sensor_is_listed_and_opened_as_any_other() {
    let Some(room) = room() else { return };
    let openni = room.openni();
    let listed = openni.devices().unwrap();
    let mine = listed
        .iter()
        .find(|device| device.uri == "posefuse://0")
        .unwrap();
    assert_eq!(mine.vendor, "Posefuse");

    let device = openni.open(Some("posefuse-0")).unwrap();
    assert_eq!(device.info().uri, "posefuse://0");
    assert!(!device.is_recording() && device.register_to_colour(true).is_err());
    device.register_to_colour(false).unwrap();

    let wanted: WantedMode = "640x480@30".parse().unwrap();
    let stream = device.depth(Some(wanted)).unwrap();
    let [horizontal, vertical] = stream.camera().view().map(f64::to_degrees);
    assert!((horizontal - 57.0).abs() < 1e-3 && (vertical - 43.0).abs() < 1e-3);
    stream.start().unwrap();
    let image = &frames(&stream, 1)[0].image;
    assert_eq!(
        (image.width, image.height, image.millimetres.len()),
        (640, 480, 640 * 480)
    );

    let error = device.depth(Some("800x600".parse().unwrap())).unwrap_err();
    assert!(
        error.to_string().contains("320x240@30, 640x480@30"),
        "{error}"
    );
    let error = openni.open(Some("posefuse-17")).unwrap_err();
    assert!(matches!(&error, OpenNiError::NoDevice { wanted, .. } if wanted == "posefuse-17"));
    assert!(error.to_string().contains("posefuse://0"), "{error}");
}

#[test]
fn frames_are_what_the_simulated_sensor_sees_when_their_times_say() {
    let Some(room) = room() else { return };
    let openni = room.openni();
    let device = openni.open(Some("posefuse://1")).unwrap();
    let zero_us = device.own_property(CLOCK_ZERO).unwrap() as u64 / 1000;
    let stream = device.depth(None).unwrap();
    let (world, camera) = (world(), DepthCamera::structured_light(320, 240));
    let round_us = (world.performance().round_s().unwrap() * 1e6).round() as u64;
    stream.start().unwrap();
    let frames = frames(&stream, 10);
    for frame in [&frames[0], &frames[9]] {
        let seconds = ((zero_us + frame.timestamp_us) % round_us) as f64 * 1e3 * 1e-9;
        assert_eq!(
            frame.image,
            world.depth(1, seconds, &camera),
            "at {seconds} s"
        );
    }
    for pair in frames.windows(2) {
        let steps = i64::from(pair[1].index - pair[0].index);
        let us = (pair[1].timestamp_us - pair[0].timestamp_us) as i64;
        assert!(
            steps >= 1 && (us - steps * 1_000_000 / 30).abs() <= 2,
            "{us} us, {steps} frames"
        );
    }
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap()
        .as_micros() as u64;
    let late_us = now - zero_us - frames[9].timestamp_us;
    assert!(late_us < 2_000_000, "{late_us} us late");
}

#[test]
fn what_is_recorded_comes_back_as_it_was() {
    let Some(room) = room() else { return };
    let openni = room.openni();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("take.oni");
    let stream = openni
        .open(Some("posefuse://2"))
        .unwrap()
        .depth(None)
        .unwrap();
    let recorder = Recorder::start(&stream, &file).unwrap();
    stream.start().unwrap();
    let live = frames(&stream, 15);
    stream.stop();
    drop(recorder);

    let recording = openni.open(file.to_str()).unwrap();
    assert!(recording.is_recording());
    recording.play(Playback::OnDemand).unwrap();
    let replayed = recording.depth(None).unwrap();
    let (was, is) = (stream.camera(), replayed.camera());
    assert!(
        (was.fx - is.fx).abs() < 1e-3 && (was.fy - is.fy).abs() < 1e-3,
        "{was:?} {is:?}"
    );
    replayed.start().unwrap();
    // Frames that nobody waited for are in the file, too.
    let count = replayed.frames().unwrap() as usize;
    assert!(count >= live.len());
    let again = frames(&replayed, count);
    let origin = |frames: &[Frame]| frames[0].timestamp_us;
    let first = again
        .iter()
        .position(|frame| alike(frame, &live[0]))
        .unwrap();
    let again = &again[first..];
    for frame in &live {
        let since = frame.timestamp_us - origin(&live);
        let twin = again
            .iter()
            .find(|twin| twin.timestamp_us - origin(again) == since);
        assert!(alike(twin.expect("each frame is in the file"), frame));
    }
    assert_eq!(replayed.next(Duration::from_millis(100)).unwrap(), None);
}

/// The same image, but for the last pixels of the last row: OpenNI2's compression repeats a wrong one there when a frame ends
/// with several alike.
fn alike(one: &Frame, other: &Frame) -> bool {
    let (one, other) = (&one.image.millimetres, &other.image.millimetres);
    let end = one.len() - 64;
    one.len() == other.len() && one[..end] == other[..end]
}

#[test]
fn a_sensor_that_is_pulled_out_is_missed_and_may_come_back() {
    let Some(room) = room() else { return };
    let openni = room.openni();
    let until = |wanted: &dyn Fn(&DeviceEvent) -> bool| {
        let deadline = Instant::now() + Duration::from_secs(5);
        while Instant::now() < deadline {
            if openni
                .next_event(Duration::from_millis(100))
                .as_ref()
                .is_some_and(wanted)
            {
                return;
            }
        }
        panic!("no such news within 5 s");
    };
    let mine = |info: &posefuse_devices::openni::DeviceInfo| info.uri == "posefuse://3";
    for _ in 0..3 {
        let stream = openni
            .open(Some("posefuse://3"))
            .unwrap()
            .depth(None)
            .unwrap();
        stream.start().unwrap();
        frames(&stream, 2);
        room.plug(3, false);
        until(&|event| matches!(event, DeviceEvent::Disconnected(info) if mine(info)));
        assert!(openni.devices().unwrap().iter().all(|info| !mine(info)));
        let error = openni.open(Some("posefuse-3")).unwrap_err();
        assert!(error.no_device(), "{error}");
        // What was under way may still come, then nothing does.
        let left = std::iter::from_fn(|| stream.next(Duration::from_millis(100)).ok().flatten());
        assert!(left.take(30).count() < 30);
        drop(stream);
        room.plug(3, true);
        until(&|event| matches!(event, DeviceEvent::Connected(info) if mine(info)));
    }
}
