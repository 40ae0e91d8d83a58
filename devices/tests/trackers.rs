//! NiTE's and Azure Kinect's bindings against libraries of our own that have the same functions and a known person: what
//! is called in which order, how structures lie in memory, what comes out in which axes. Needs a C compiler.
#![allow(unsafe_code, reason = "asks the C libraries what they were left with")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use posefuse_devices::azure::{AzureError, AzureTracker, Options as AzureOptions, Processing};
use posefuse_devices::nite::{NiteError, NiteTracker, Options as NiteOptions};
use posefuse_skeleton::RawJoint;

/// Compiles `source` of `tests/c`; `false`, with words, where there is no compiler.
fn compiled(source: &str, library: &Path, options: &[&str]) -> bool {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/c")
        .join(source);
    let mut command = Command::new("cc");
    command.args(["-shared", "-fPIC", "-Wall", "-Werror", "-o"]);
    match command.arg(library).arg(file).args(options).status() {
        Ok(status) => {
            assert!(status.success(), "{source} does not compile");
            true
        }
        Err(error) => {
            eprintln!("SKIPPED: no C compiler ({error}); install one, e.g. apt install gcc");
            false
        }
    }
}

/// What a library of ours says of itself.
fn asked<T>(library: &Path, question: &str) -> T {
    // SAFETY: the library is ours, and each question has the type it is asked with.
    unsafe {
        let library = libloading::Library::new(library).unwrap();
        let function: libloading::Symbol<unsafe extern "C" fn() -> T> =
            library.get(question.as_bytes()).unwrap();
        function()
    }
}

fn place(joint: &Option<RawJoint>) -> Option<([f64; 3], f32)> {
    joint.map(|joint| {
        let v = joint.position.vector();
        let rounded = [v.x, v.y, v.z].map(|metres| (metres * 1e4).round() / 1e4);
        (rounded, joint.confidence.get())
    })
}

#[test]
#[cfg(target_os = "linux")]
fn nite_gives_optical_metres_and_is_put_away_properly() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("libNiTE2.so");
    if !compiled("nite.c", &library, &["-DFAKE_MINOR=2"]) {
        return;
    }
    let options = |mirrored| NiteOptions {
        library: Some(folder.path().to_owned()),
        mirrored,
        ..NiteOptions::default()
    };
    // NiTE's data must lie beside it, wherever this program runs.
    let error = NiteTracker::open(&options(true)).err().unwrap();
    assert!(
        matches!(&error, NiteError::Call { doing, .. } if doing.contains("track")),
        "{error}"
    );
    assert_eq!(
        asked::<i32>(&library, "fake_open"),
        0,
        "a failed start leaves nothing"
    );
    std::fs::create_dir(folder.path().join("NiTE2")).unwrap();
    std::fs::write(folder.path().join("NiTE2/s.dat"), "x").unwrap();
    let before = std::env::current_dir().unwrap();

    for (mirrored, x) in [(true, 0.3), (false, -0.3)] {
        let mut tracker = NiteTracker::open(&options(mirrored)).unwrap();
        assert_eq!(std::env::current_dir().unwrap(), before);
        assert_eq!(tracker.version(), "2.2.0.11");
        assert_eq!(asked::<f32>(&library, "fake_smoothing"), 0.0);
        let first = tracker.read().unwrap();
        assert!(first.users.is_empty(), "new, and not yet tracked");
        assert_eq!((first.timestamp_us, first.index), (1_033_333, 1));
        let second = tracker.read().unwrap();
        assert!(second.users.is_empty(), "refused, and asked for again");
        let third = tracker.read().unwrap();
        let user = &third.users[0];
        assert_eq!(user.id, 7);
        assert_eq!(place(&user.joints[0]), Some(([x, -0.5, 2.5], 1.0)));
        let foot = user.joints[13];
        let offset = if mirrored { -0.013 } else { 0.013 };
        assert_eq!(place(&foot), Some(([x + offset, -0.37, 2.513], 0.5)));
        assert_eq!(user.joints[14], None, "confidence 0 is no place");
        assert_eq!(asked::<i32>(&library, "fake_asked"), 2);
        assert!(tracker.read().unwrap().users.is_empty(), "lost");
        let error = tracker.read().unwrap_err().to_string();
        assert!(error.contains("pulled out"), "{error}");
        assert_eq!(
            asked::<i32>(&library, "fake_open"),
            1110,
            "every frame was given back"
        );
        drop(tracker);
        assert_eq!(asked::<i32>(&library, "fake_open"), 0);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_nite_that_gives_no_frame_is_not_waited_for_for_ever() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("libNiTE2.so");
    if !compiled("nite.c", &library, &["-DFAKE_MINOR=2"]) {
        return;
    }
    std::fs::create_dir(folder.path().join("NiTE2")).unwrap();
    std::fs::write(folder.path().join("NiTE2/s.dat"), "x").unwrap();
    let options = NiteOptions {
        library: Some(library.clone()),
        ..NiteOptions::default()
    };
    let mut tracker = NiteTracker::open(&options).unwrap();
    let (moment, long) = (Duration::from_millis(20), Duration::from_secs(20));
    assert_eq!(tracker.read_within(moment).unwrap(), None);
    let told = std::thread::scope(|scope| {
        let told = scope.spawn(|| {
            std::thread::sleep(moment);
            asked::<i32>(&library, "fake_ready")
        });
        assert_eq!(tracker.read_within(long).unwrap().unwrap().index, 1);
        told.join().unwrap()
    });
    assert_eq!(told, 1, "registered");
    assert_eq!(tracker.read_within(moment).unwrap(), None, "told of once");
    drop(tracker);
    assert_eq!(asked::<i32>(&library, "fake_ready"), 0, "unregistered");
    assert_eq!(asked::<i32>(&library, "fake_open"), 0);
}

#[test]
#[cfg(target_os = "linux")]
fn another_nite_is_refused_before_its_structures_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("libNiTE2.so");
    if !compiled("nite.c", &library, &["-DFAKE_MINOR=0"]) {
        return;
    }
    let options = NiteOptions {
        library: Some(library.clone()),
        ..NiteOptions::default()
    };
    let error = NiteTracker::open(&options).err().unwrap().to_string();
    assert!(
        error.contains("version 2.0.0.11") && error.contains("NITE2_REDIST64"),
        "{error}"
    );
}

#[test]
#[cfg(target_os = "linux")]
fn azure_gives_optical_metres_and_levels_as_confidence_and_is_put_away_properly() {
    let folder = tempfile::tempdir().unwrap();
    let sensor = folder.path().join("libk4a.so.1.4");
    let tracking = folder.path().join("libk4abt.so.1.1");
    if !compiled("azure.c", &sensor, &["-DSENSOR"]) || !compiled("azure.c", &tracking, &[]) {
        return;
    }
    let options = |device: Option<&str>| AzureOptions {
        folder: Some(folder.path().to_owned()),
        device: device.map(str::to_owned),
        processing: Processing::Cpu,
        ..AzureOptions::default()
    };
    let error = AzureTracker::open(&options(Some("99"))).err().unwrap();
    assert!(matches!(error, AzureError::NoDevice { .. }));
    let words = error.to_string();
    assert!(words.contains("0: in use, 1: 000123456712"), "{words}");
    assert_eq!(asked::<i32>(&sensor, "fake_open"), 0);

    let mut tracker = AzureTracker::open(&options(Some("000123456712"))).unwrap();
    assert_eq!(tracker.serial(), "000123456712");
    assert_eq!(asked::<f32>(&tracking, "fake_smoothing"), 0.0);
    let moment = Duration::from_millis(10);
    assert_eq!(asked::<i32>(&sensor, "fake_arrive"), 1);
    let frame = tracker.read(moment).unwrap().unwrap();
    assert_eq!(frame.timestamp_us, 5_000_033_333);
    let [body] = frame.bodies.as_slice() else {
        panic!("{} bodies", frame.bodies.len());
    };
    assert_eq!(body.id, 11, "the processing mode came over");
    let found = [0, 1, 2, 3].map(|joint| place(&body.joints[joint]));
    assert_eq!(found[0], None, "out of range");
    assert_eq!(found[1], Some(([0.101, -0.201, 3.001], 0.5)));
    assert_eq!(found[2].unwrap().1, 0.9);
    assert_eq!(found[3].unwrap().1, 1.0);
    assert_eq!(place(&body.joints[31]).unwrap().0, [0.131, -0.231, 3.031]);
    assert_eq!(body.orientations[0], [0.0; 4]);
    assert_eq!(body.orientations[1], [0.0, 0.6, 0.0, 0.8], "x y z w");
    assert_eq!(tracker.read(moment).unwrap(), None, "nothing in time");
    asked::<i32>(&sensor, "fake_arrive");
    assert!(tracker.read(moment).unwrap().is_some());
    assert_eq!(asked::<i32>(&sensor, "fake_open"), 110, "all given back");
    asked::<i32>(&sensor, "fake_pull");
    let error = tracker.read(moment).unwrap_err().to_string();
    assert!(error.contains("pulled out"), "{error}");
    drop(tracker);
    assert_eq!(asked::<i32>(&sensor, "fake_open"), 0);
    assert_eq!(asked::<i32>(&tracking, "fake_open"), 0);
}

#[test]
#[cfg(target_os = "linux")]
fn an_azure_tracker_slower_than_its_sensor_does_not_fall_behind() {
    let folder = tempfile::tempdir().unwrap();
    let sensor = folder.path().join("libk4a.so.1.4");
    let tracking = folder.path().join("libk4abt.so.1.1");
    if !compiled("azure.c", &sensor, &["-DSENSOR"]) || !compiled("azure.c", &tracking, &[]) {
        return;
    }
    let mut tracker = AzureTracker::open(&AzureOptions {
        folder: Some(folder.path().to_owned()),
        ..AzureOptions::default()
    })
    .unwrap();
    // A result takes as long as three depth images.
    asked::<i32>(&tracking, "fake_slow");
    let mut numbers = Vec::new();
    for _ in 0..30 {
        let newest = asked::<i32>(&sensor, "fake_arrive");
        if let Some(frame) = tracker.read(Duration::from_secs(1)).unwrap() {
            let number = (frame.timestamp_us - 5_000_000_000) / 33_333;
            numbers.push((newest, number));
        }
    }
    let expected = (1..=10).map(|turn| (3 * turn, 3 * turn as u64 - 2));
    assert_eq!(numbers, expected.collect::<Vec<_>>(), "newest, given");
    assert_eq!(asked::<i32>(&sensor, "fake_open"), 110, "all given back");
    drop(tracker);
    assert_eq!(asked::<i32>(&sensor, "fake_open"), 0);
}

#[test]
fn without_the_libraries_it_is_said_what_to_install() {
    let nowhere = tempfile::tempdir().unwrap();
    let nite = NiteTracker::open(&NiteOptions {
        library: Some(nowhere.path().to_owned()),
        ..NiteOptions::default()
    });
    let words = nite.err().unwrap().to_string();
    assert!(
        words.contains("NITE2_REDIST64") && words.contains("agent openni"),
        "{words}"
    );
    let azure = AzureTracker::open(&AzureOptions {
        folder: Some(nowhere.path().to_owned()),
        ..AzureOptions::default()
    });
    let words = azure.err().unwrap().to_string();
    assert!(
        words.contains("K4ABT_LIBRARY_PATH") && words.contains("libk4a1.4"),
        "{words}"
    );
}
