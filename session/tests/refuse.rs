//! Fusing again: the same settings give the same bytes, other settings give other frames.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::{Config, FuseMethod};
use posefuse_session::{
    Catalogue, Event, MemoryStorage, RefuseOptions, Storage, TakeError, TakeReader, Topic, recover,
    refuse,
};
use posefuse_skeleton::Timestamp;
use support::{BUILD, as_file, calibration, record};

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
    assert_eq!(take.header().calibration, Some(as_file(&moved)));
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

fn files_of(storage: &dyn Storage) -> Vec<String> {
    let files = storage.list().unwrap();
    files.into_iter().map(|stored| stored.file).collect()
}

/// A take, and the same one with a byte changed in the last chunk that holds inputs.
fn whole_and_damaged() -> (Vec<u8>, Vec<u8>) {
    let memory = MemoryStorage::new();
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    record(&storage, "t", 1.0, 40.0, 1);
    let whole = memory.read("t.mcap").unwrap();
    let summary = mcap::Summary::read(&whole).unwrap().unwrap();
    let late = &summary.chunk_indexes[summary.chunk_indexes.len() - 2];
    let mut damaged = whole.clone();
    damaged[(late.chunk_start_offset + late.chunk_length) as usize - 20] ^= 0x40;
    (whole, damaged)
}

#[test]
fn half_a_new_take_is_no_take() {
    let (whole, damaged) = whole_and_damaged();
    // An input that cannot be read ends it late.
    let holding = |bytes: Vec<u8>| MemoryStorage::holding([("t.mcap".to_owned(), bytes)]);
    let storage: Arc<dyn Storage> = Arc::new(holding(damaged));
    let failed = refuse(&storage, "t", &same(), &mut |_| {});
    assert!(
        matches!(failed, Err(TakeError::Damaged { .. })),
        "{failed:?}"
    );
    assert_eq!(files_of(&*storage), ["t.mcap"]);

    // After a kill at any moment the next start throws away what there is.
    let memory = holding(whole);
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    let mut killed = Vec::new();
    refuse(&storage, "t", &same(), &mut |at| {
        if at.done > at.total / 2 && killed.len() < 2 {
            killed.push(Arc::new(memory.after_kill()));
        }
    })
    .unwrap();
    for (at, after) in killed.into_iter().enumerate() {
        let after: Arc<dyn Storage> = after;
        assert_eq!(files_of(&*after).len(), 2, "the kill came in between");
        assert_eq!(Catalogue::list(&*after).unwrap().len(), 1);
        // Without a start in between it is in nobody's way, either.
        if at == 0 {
            assert!(recover(&after).unwrap().is_empty());
            assert_eq!(files_of(&*after), ["t.mcap"]);
        }
        assert!(refuse(&after, "t", &same(), &mut |_| {}).unwrap().identical);
        assert_eq!(files_of(&*after), ["t-refused.mcap", "t.mcap"]);
    }
}

#[test]
fn a_disk_that_fills_up_leaves_no_half_take() {
    let (whole, _) = whole_and_damaged();
    let memory = MemoryStorage::with_capacity(400_000_000, true);
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    storage.create("t.mcap").unwrap().append(&whole).unwrap();
    let failed = refuse(&storage, "t", &same(), &mut |at| {
        if at.done > at.total / 2 {
            memory.occupied_by_others(u64::MAX);
        }
    });
    let error = failed.unwrap_err().to_string();
    assert!(
        error.contains("free") && error.contains("t-refused"),
        "{error}"
    );
    assert_eq!(files_of(&*storage), ["t.mcap"]);
}

#[test]
fn an_existing_take_is_not_replaced() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    record(&storage, "t", 0.2, 0.9, 1);
    record(&storage, "other", 0.2, 0.7, 1);
    let before = frames_of(&*storage, "other");
    let named = RefuseOptions {
        name: Some("other".into()),
        ..same()
    };
    let failed = refuse(&storage, "t", &named, &mut |_| {});
    assert!(matches!(failed, Err(TakeError::Exists(name)) if name == "other"));
    // One that comes while the new take is being made stays, too.
    let late = RefuseOptions {
        name: Some("late".into()),
        ..same()
    };
    let mut came = false;
    let failed = refuse(&storage, "t", &late, &mut |_| {
        if !came {
            came = true;
            record(&storage, "late", 0.2, 0.7, 1);
        }
    });
    assert!(matches!(failed, Err(TakeError::Exists(name)) if name == "late"));
    assert_eq!(frames_of(&*storage, "other"), before);
    assert_eq!(frames_of(&*storage, "late"), before);
    assert_eq!(files_of(&*storage), ["late.mcap", "other.mcap", "t.mcap"]);
}

#[test]
fn either_form_of_the_recorded_calibration_is_the_recorded_one() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    record(&storage, "t", 1.0, 4.0, 1);
    let attached = TakeReader::open(&*storage, "t")
        .unwrap()
        .header()
        .calibration
        .clone();
    for calibration in [Some(calibration()), attached] {
        let options = RefuseOptions {
            calibration,
            ..same()
        };
        let report = refuse(&storage, "t", &options, &mut |_| {}).unwrap();
        assert!(report.identical && report.from_snapshot, "{report:?}");
    }
}

/// Records a room whose recorder loses some frames and events, and tells of lost inputs.
fn record_with_losses(storage: &Arc<dyn Storage>) -> u64 {
    let mut recorder = support::Recorder::new();
    recorder.begin(storage, "t", Timestamp::ZERO, Default::default());
    let mut writer = recorder.writer.take().unwrap();
    let mut frames = 0_u64;
    for input in support::arrivals(4.0, 1) {
        for (input, outputs) in recorder.steps(input) {
            writer.input(&input).unwrap();
            for frame in outputs {
                frames += 1;
                match frames % 40 {
                    7..10 => writer.dropped_outputs(1),
                    _ => writer.frame(&frame).unwrap(),
                }
            }
            writer.flush(support::time_of(&input)).unwrap();
        }
    }
    writer.dropped(2);
    writer.dropped_outputs(1);
    let info = writer.finish().unwrap();
    assert_eq!(info.dropped, 2);
    info.dropped_outputs - 1
}

#[test]
fn frames_that_the_recording_lacks_are_told_apart_from_others() {
    let memory = MemoryStorage::new();
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    let lacking = record_with_losses(&storage);
    assert!(lacking >= 6, "{lacking}");
    let report = refuse(&storage, "t", &same(), &mut |_| {}).unwrap();
    assert!(report.identical, "{report:?}");
    assert_eq!(report.lacking, lacking);
    assert_eq!(report.frames, report.recorded_frames + lacking);
    // The new take has those frames; the lost inputs it cannot have.
    assert_eq!((report.take.dropped, report.take.dropped_outputs), (2, 0));
    let take = TakeReader::open(&*storage, "t-refused").unwrap();
    assert_eq!(take.info().dropped, 2);
    let kinds: Vec<_> = take.events().map(|event| event.unwrap().kind).collect();
    assert_eq!(kinds, [Event::INPUTS_DROPPED]);

    // A recovered take knows what it lacks, too.
    let whole = memory.read("t.mcap").unwrap();
    let summary = mcap::Summary::read(&whole).unwrap().unwrap();
    let ends = summary.chunk_indexes.iter();
    let end = ends
        .map(|chunk| chunk.chunk_start_offset + chunk.chunk_length)
        .max();
    let cut_off = whole[..end.unwrap() as usize].to_vec();
    let storage: Arc<dyn Storage> =
        Arc::new(MemoryStorage::holding([("t.mcap".to_owned(), cut_off)]));
    recover(&storage).unwrap();
    let info = Catalogue::info(&*storage, "t");
    assert_eq!((info.dropped, info.dropped_outputs), (2, lacking + 1));
    let report = refuse(&storage, "t", &same(), &mut |_| {}).unwrap();
    assert!(report.identical && report.lacking == lacking, "{report:?}");
}
