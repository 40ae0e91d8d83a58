//! Fusing again: the same settings give the same bytes, other settings give other frames.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_fusion::{Config, FuseMethod, Input};
use posefuse_session::{
    Catalogue, Event, MemoryStorage, RefuseOptions, Storage, TakeError, TakeReader, Topic, recover,
    refuse,
};
use posefuse_skeleton::{Joint, Position, RoomFrame, Timestamp};
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

/// Records `seconds` of one person from second 1 on, seen by sensors that shake by about a centimetre.
fn record_noisy(storage: &Arc<dyn Storage>, seconds: f64) {
    let mut recorder = support::Recorder::new();
    let mut seed = 1_u64;
    let mut noise = || {
        let mut roll = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        Vector3::new(roll(), roll(), roll()) * 0.03
    };
    let from = Timestamp::from_seconds(1.0);
    for mut input in support::arrivals(seconds, 1) {
        if let Input::Observation(seen) = &mut input {
            for body in &mut seen.bodies {
                for joint in Joint::ALL {
                    if let Some(state) = &mut body.skeleton[joint] {
                        // Agents send single precision.
                        let shaken = state.position.vector() + noise();
                        let sent = shaken.map(|metres| f64::from(metres as f32));
                        state.position = Position::from_vector(sent);
                    }
                }
            }
        }
        if recorder.writer.is_none() && support::time_of(&input) >= from {
            recorder.begin(storage, "t", from, Default::default());
        }
        recorder.arrive(input);
    }
    recorder.writer.take().unwrap().finish().unwrap();
}

/// RMS error (metres) and RMS second difference (m/s^2) of all joints, from second 2 on.
fn error_and_jitter(frames: &[RoomFrame]) -> [f64; 2] {
    let place = |frame: &RoomFrame, joint: Joint| {
        let track = frame.tracks.first()?;
        Some(track.skeleton.position(joint)?.vector())
    };
    let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
    let frames = frames.iter().filter(|frame| frame.time.seconds() > 2.0);
    let frames: Vec<_> = frames.collect();
    for w in frames.windows(3) {
        let spans = [1, 2].map(|i| w[i].time.since_seconds(w[i - 1].time));
        for joint in Joint::ALL {
            let truth = support::person_at(0, w[1].time, joint).vector();
            if let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|i| place(w[i], joint)) {
                let change = (c - b) / spans[1] - (b - a) / spans[0];
                sums[0] += (b - truth).norm_squared();
                sums[1] += (change * 2.0 / (spans[0] + spans[1])).norm_squared();
                counts = counts.map(|count| count + 1.0);
            }
        }
    }
    assert!(counts[0] > 1000.0, "{counts:?}");
    [0, 1].map(|i| f64::sqrt(sums[i] / counts[i]))
}

#[test]
fn smoothing_a_take_changes_where_joints_are_and_nothing_else() {
    let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::new());
    record_noisy(&storage, 9.0);
    let smooth = |name: &str| {
        let options = RefuseOptions {
            smooth: true,
            name: Some(name.into()),
            ..same()
        };
        refuse(&storage, "t", &options, &mut |_| {}).unwrap()
    };
    let report = smooth("smooth");
    assert!(!report.identical && report.from_snapshot, "{report:?}");
    smooth("again");
    assert_eq!(
        frames_of(&*storage, "smooth"),
        frames_of(&*storage, "again")
    );

    let decoded = |name: &str| -> Vec<RoomFrame> {
        let take = TakeReader::open(&*storage, name).unwrap();
        take.frames().map(Result::unwrap).collect()
    };
    let (live, smoothed) = (decoded("t"), decoded("smooth"));
    // The room was still looking ahead when recording ended.
    let waited = Config::default().look_ahead_frames();
    assert_eq!(smoothed.len(), live.len() + waited);
    assert!(live.len() > 200);
    for (live, smoothed) in live.iter().zip(&smoothed) {
        assert_eq!((live.number, live.time), (smoothed.number, smoothed.time));
        assert_eq!(live.tracks.len(), smoothed.tracks.len());
        for (live, smoothed) in live.tracks.iter().zip(&smoothed.tracks) {
            let who = |track: &posefuse_skeleton::Track| (track.id, track.since, track.sensors);
            assert_eq!(who(live), who(smoothed));
            for joint in Joint::ALL {
                let [live, smoothed] = [live, smoothed].map(|track| track.skeleton[joint].as_ref());
                let from = |state: Option<&posefuse_skeleton::JointState<_>>| {
                    state.map(|state| (state.provenance, state.confidence))
                };
                assert_eq!(from(live), from(smoothed), "{joint}");
            }
        }
    }
    let ([was_m, shook], [is_m, shakes]) = (error_and_jitter(&live), error_and_jitter(&smoothed));
    println!("live {was_m} m, {shook} m/s^2; smoothed {is_m} m, {shakes} m/s^2");
    assert!(is_m < was_m, "{is_m} m, live {was_m} m");
    assert!(shakes < 0.8 * shook, "{shakes} m/s^2, live {shook}");

    // Its inputs are all there: without smoothing it gives the recorded frames again.
    let options = RefuseOptions {
        name: Some("back".into()),
        ..same()
    };
    let back = refuse(&storage, "smooth", &options, &mut |_| {}).unwrap();
    assert!(back.from_snapshot, "{back:?}");
    assert_eq!(frames_of(&*storage, "back"), frames_of(&*storage, "t"));
}
