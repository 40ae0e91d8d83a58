//! Fusing again: the same settings give the same bytes, other settings give other frames.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::{Config, FuseMethod};
use posefuse_session::{MemoryStorage, RefuseOptions, Storage, TakeReader, Topic, refuse};
use support::{BUILD, calibration, record};

fn same() -> RefuseOptions {
    RefuseOptions {
        build: BUILD.into(),
        ..RefuseOptions::default()
    }
}

fn frames_of(storage: &dyn Storage, name: &str) -> Vec<Vec<u8>> {
    let take = TakeReader::open(storage, name).unwrap();
    take.entries(&[Topic::Frames], None)
        .map(|entry| entry.unwrap().bytes)
        .collect()
}

#[test]
fn the_same_settings_give_the_same_bytes() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    for (name, from) in [("whole", 0.0), ("mid-stream", 2.345)] {
        record(&storage, name, from, 6.0, 2);
        let mut reports = Vec::new();
        let report = refuse(&storage, name, &same(), &mut |at| reports.push(at)).unwrap();
        assert!(
            report.identical && report.from_snapshot,
            "{name}: {report:?}"
        );
        assert_eq!(report.frames, report.recorded_frames);
        assert!(report.frames > 80, "{name}: {} frames", report.frames);
        let last = reports.last().unwrap();
        assert_eq!(last.done, last.total);
        let new_name = format!("{name}-refused");
        assert_eq!(report.take.name, new_name);
        assert_eq!(frames_of(&*storage, name), frames_of(&*storage, &new_name));
        // What was fused again can be fused again.
        let third = refuse(&storage, &new_name, &same(), &mut |_| {}).unwrap();
        assert!(third.identical, "{third:?}");
    }
}

#[test]
fn another_build_begins_cold() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    record(&storage, "t", 2.0, 5.0, 1);
    let options = RefuseOptions {
        build: "another".into(),
        ..RefuseOptions::default()
    };
    let report = refuse(&storage, "t", &options, &mut |_| {}).unwrap();
    assert!(!report.from_snapshot && report.frames > 60, "{report:?}");
    // The new take has no snapshot of the old build: fused again it is the same.
    let again = refuse(&storage, "t-refused", &options, &mut |_| {}).unwrap();
    assert!(again.identical, "{again:?}");
}

#[test]
fn other_settings_make_their_own_ticks() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    record(&storage, "t", 1.0, 5.0, 2);
    let mut config = Config::default();
    config.fuse.method = match config.fuse.method {
        FuseMethod::Average => FuseMethod::Weighted,
        _ => FuseMethod::Average,
    };
    let options = RefuseOptions {
        config: Some(config.clone()),
        name: Some("other".into()),
        ..same()
    };
    let report = refuse(&storage, "t", &options, &mut |_| {}).unwrap();
    assert!(
        !report.identical && report.first_difference.is_some(),
        "{report:?}"
    );
    assert!(report.frames > 60);
    let take = TakeReader::open(&*storage, "other").unwrap();
    let kept: Config = posefuse_fusion::parse_toml(&take.header().config_toml).unwrap();
    assert_eq!(kept, config);
    // With its own configuration, recorded in it, it is the same again.
    let again = refuse(&storage, "other", &same(), &mut |_| {}).unwrap();
    assert!(again.identical, "{again:?}");
    // And back to the first one.
    let back = RefuseOptions {
        config: Some(Config::default()),
        name: Some("back".into()),
        ..same()
    };
    assert!(
        refuse(&storage, "other", &back, &mut |_| {})
            .unwrap()
            .frames
            > 60
    );
}

#[test]
fn another_calibration_replaces_the_recorded_ones() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    record(&storage, "t", 0.0, 4.0, 1);
    let mut moved = calibration();
    moved.sensors.remove("cam3");
    let options = RefuseOptions {
        calibration: Some(moved.clone()),
        name: Some("moved".into()),
        ..same()
    };
    let report = refuse(&storage, "t", &options, &mut |_| {}).unwrap();
    assert!(
        !report.identical && !report.from_snapshot && report.frames > 50,
        "{report:?}"
    );
    let take = TakeReader::open(&*storage, "moved").unwrap();
    assert_eq!(take.header().calibration, Some(moved));
    let frames: Vec<_> = take.frames().map(Result::unwrap).collect();
    let uses_cam3 = |frame: &posefuse_skeleton::RoomFrame| {
        frame
            .tracks
            .iter()
            .any(|track| track.sensors.contains(support::sensor(3)))
    };
    assert!(!frames.iter().any(uses_cam3));
    let again = refuse(&storage, "moved", &same(), &mut |_| {}).unwrap();
    assert!(again.identical, "{again:?}");
}
