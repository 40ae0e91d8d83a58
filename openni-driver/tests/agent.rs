//! The agent's OpenNI2 source on simulated sensors of the real OpenNI2. Says so and passes where that is not installed.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

mod support;

use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_agent::source::{OpenNiConfig, openni};
use posefuse_agent::{Clock, DepthFrame, DepthSource, SourceError, SystemClock};
use posefuse_devices::openni::Recorder;
use support::Room;

/// Clocks that run fast, and frames that come late by more or less.
const REST: &str =
    "drift_ppm = 90.0\ndelay_ms = 5.0\njitter_ms = 4.0\nrepeat_s = 1.0\n[scenario]\nsensors = 3\n";

fn room() -> Option<&'static Room> {
    support::room(3, REST)
}

fn source(room: &Room, device: &str, fast: bool) -> (Box<dyn DepthSource>, Arc<dyn Clock>) {
    let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
    let config = OpenNiConfig {
        device: Some(device.to_owned()),
        fast,
        library: Some(room.library().to_owned()),
        ..OpenNiConfig::default()
    };
    (openni::open(&config, &clock).unwrap(), clock)
}

fn frames(source: &mut dyn DepthSource, count: usize) -> Vec<DepthFrame> {
    (0..count)
        .map(|_| source.next_frame().unwrap().unwrap())
        .collect()
}

#[test]
fn capture_times_are_right_to_a_millisecond_however_late_frames_come() {
    let Some(room) = room() else { return };
    let (mut source, clock) = source(room, "posefuse://0", false);
    assert_eq!(source.model(), "Posefuse simulated depth sensor (OpenNI2)");
    // A computer that is busy with other tests may hold every frame up for a while: then once more.
    let mut tries = (0..4).map(|_| worst_ns(&frames(source.as_mut(), 75)[30..]));
    let best = tries.find(|&worst| worst < 1_000_000);
    assert!(best.is_some(), "capture times were never right to 1 ms");
    let last_ns = frames(source.as_mut(), 1)[0].captured.ns();
    let now_ns = clock.monotonic_ns();
    assert!(last_ns < now_ns && now_ns - last_ns < 1_000_000_000);
}

/// How far from a thirtieth of a second after the first frame the frames' times are at most: the sensor captures so, by the
/// clock that the agent reads, too.
fn worst_ns(frames: &[DepthFrame]) -> i64 {
    let first_ns = frames[0].captured.ns();
    let off_ns = |frame: &DepthFrame| {
        let since = (frame.captured.ns() - first_ns) as f64 * 30e-9;
        ((since - since.round()) / 30e-9) as i64
    };
    frames
        .iter()
        .map(|frame| off_ns(frame).abs())
        .max()
        .unwrap_or(0)
}

#[test]
fn a_sensor_that_is_pulled_out_is_taken_up_again_when_it_is_back() {
    let Some(room) = room() else { return };
    let (mut source, _) = source(room, "posefuse-1", false);
    let mut last = frames(source.as_mut(), 3)[2].captured;
    for _ in 0..3 {
        room.plug(1, false);
        let why = loop {
            match source.next_frame() {
                Ok(frame) => last = frame.unwrap().captured,
                Err(SourceError::Trouble(why)) => break why,
                Err(other) => panic!("{other:?}"),
            }
        };
        assert!(why.contains("plug it in again"), "{why}");
        let asked = Instant::now();
        let why = source.next_frame().unwrap_err().to_string();
        assert!(
            why.contains("posefuse-1") && why.contains("plug it in again"),
            "{why}"
        );
        assert!(asked.elapsed() < Duration::from_secs(5));
        room.plug(1, true);
        let next = frames(source.as_mut(), 1)[0].captured;
        assert!(next > last);
        last = next;
    }
}

#[test]
fn a_recording_is_played_in_its_own_time_or_as_fast_as_it_can_be() {
    let Some(room) = room() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("take.oni");
    let openni = room.openni();
    let stream = openni
        .open(Some("posefuse://2"))
        .unwrap()
        .depth(None)
        .unwrap();
    let recorder = Recorder::start(&stream, &file).unwrap();
    stream.start().unwrap();
    for _ in 0..20 {
        stream.next(Duration::from_secs(5)).unwrap().unwrap();
    }
    stream.stop();
    drop(recorder);

    let mut spans = Vec::new();
    let mut images = Vec::new();
    for fast in [false, true] {
        let (mut source, _) = source(room, file.to_str().unwrap(), fast);
        assert_eq!(source.every_frame(), fast);
        let mut frames = Vec::new();
        while let Some(frame) = source.next_frame().unwrap() {
            frames.push(frame);
        }
        assert!(
            frames.len() >= 20
                && frames
                    .windows(2)
                    .all(|pair| pair[0].captured < pair[1].captured)
        );
        let span_ns = frames.last().unwrap().captured.ns() - frames[0].captured.ns();
        spans.push(span_ns as f64 * 1e-9);
        images.push(
            frames
                .into_iter()
                .map(|frame| frame.image)
                .collect::<Vec<_>>(),
        );
    }
    assert_eq!(images[0], images[1]);
    let recorded = (images[0].len() - 1) as f64 / 30.0;
    assert!((spans[0] - recorded).abs() < 2e-3, "{spans:?}, {recorded}");
    assert!(spans[1] < spans[0], "{spans:?}");
}
