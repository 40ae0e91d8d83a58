//! What is recorded is what is read.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use posefuse_fusion::Input;
use posefuse_session::{
    Catalogue, DiskStorage, Event, MemoryStorage, Storage, TakeChange, TakeError, TakeReader,
    TakeState, TakeWriter, Topic, TruePerson, Truth,
};
use posefuse_skeleton::{Calibration, Position, Timestamp, calibration_text};
use support::{as_file, calibration, header, record};

fn memory() -> Arc<dyn Storage> {
    Arc::new(MemoryStorage::new())
}

#[test]
fn a_take_gives_back_everything_that_went_in() {
    let storage = memory();
    let live = record(&storage, "walk", 1.5, 5.0, 2);
    let take = TakeReader::open(&*storage, "walk").unwrap();
    let inputs: Vec<_> = take.inputs().map(Result::unwrap).collect();
    assert_eq!(inputs, live.inputs);
    let frames: Vec<_> = take.frames().map(Result::unwrap).collect();
    assert_eq!(frames.len(), live.frames.len());
    assert!(frames.len() > 60, "{} frames", frames.len());
    for (read, given) in frames.iter().zip(&live.frames) {
        assert_eq!(
            (read.number, read.time, read.tracks.len()),
            (given.number, given.time, given.tracks.len())
        );
    }
    let given = header("walk", Timestamp::from_seconds(1.5));
    let expected = posefuse_session::TakeHeader {
        calibration: Some(as_file(&calibration())),
        ..given
    };
    assert_eq!(take.header(), &expected);
    let info = take.info();
    assert_eq!(Some(info), live.info.as_ref());
    assert_eq!(
        (info.state, info.people, info.dropped),
        (TakeState::Complete, 2, 0)
    );
    assert_eq!(info.sensors, ["cam0", "cam1", "cam2", "cam3"]);
    assert!(
        (3.0e9..3.7e9).contains(&(info.duration_ns as f64)),
        "{}",
        info.duration_ns
    );
    assert_eq!(take.count(Topic::Frames), info.frames);
    let seen = take.observations().map(Result::unwrap).count();
    assert!(seen > 350, "{seen} observations");
}

#[test]
fn reading_can_begin_in_the_middle() {
    let storage = memory();
    let live = record(&storage, "walk", 0.0, 6.0, 1);
    let take = TakeReader::open(&*storage, "walk").unwrap();
    let from = Timestamp::from_seconds(4.0);
    let late: Vec<_> = take
        .entries(&[Topic::Frames], Some(from))
        .map(Result::unwrap)
        .collect();
    let expected = live
        .frames
        .iter()
        .filter(|frame| frame.time >= from)
        .count();
    assert_eq!(late.len(), expected);
    assert!(late.iter().all(|entry| entry.time >= from) && expected > 40);
}

#[test]
fn events_and_truth_come_back() {
    let storage = memory();
    let start = Timestamp::from_seconds(2.0);
    let mut writer = TakeWriter::create(&storage, header("t", start), &[], None).unwrap();
    let event = Event {
        time_ns: 2_100_000_000,
        kind: "sensor-stalled".into(),
        sensor: "cam1".into(),
        text: "no frame for a second".into(),
        count: 0,
    };
    let joints = std::array::from_fn(|joint| Position::new(joint as f64, -0.5, 1.25));
    let truth = Truth {
        time: Timestamp::from_seconds(2.2),
        people: vec![TruePerson { id: 7, joints }],
    };
    writer.event(&event).unwrap();
    writer.truth(&truth).unwrap();
    writer.finish().unwrap();
    let take = TakeReader::open(&*storage, "t").unwrap();
    assert_eq!(
        take.events().map(Result::unwrap).collect::<Vec<_>>(),
        [event]
    );
    assert_eq!(
        take.truth().map(Result::unwrap).collect::<Vec<_>>(),
        [truth]
    );
}

#[test]
fn slate_and_notes_change_and_nothing_else() {
    let storage = memory();
    let live = record(&storage, "walk", 0.0, 2.0, 1);
    let change = TakeChange {
        slate: None,
        notes: Some("good one".into()),
    };
    let before = live.info.unwrap();
    let after = Catalogue::update(&storage, "walk", &change).unwrap();
    assert_eq!(
        (after.slate.as_str(), after.notes.as_str()),
        ("12A", "good one")
    );
    assert_eq!(
        (after.frames, after.duration_ns, after.state),
        (before.frames, before.duration_ns, before.state)
    );
    let take = TakeReader::open(&*storage, "walk").unwrap();
    assert_eq!(
        take.inputs().map(Result::unwrap).collect::<Vec<_>>(),
        live.inputs
    );
    assert_eq!(take.header().calibration, Some(as_file(&calibration())));
    assert_eq!(
        storage.list().unwrap().len(),
        1,
        "nothing is left beside the take"
    );
}

#[test]
fn names_are_kept_apart_and_inside_the_folder() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("takes");
    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(&folder).unwrap());
    record(&storage, "walk", 0.0, 0.5, 1);
    assert_eq!(Catalogue::unused_name(&*storage, "walk").unwrap(), "walk-2");
    let again = TakeWriter::create(&storage, header("walk", Timestamp::ZERO), &[], None);
    assert!(matches!(again.err(), Some(TakeError::Exists(name)) if name == "walk"));
    for bad in ["../walk", "a/b", "", "..", "/etc/x"] {
        let refused = TakeWriter::create(&storage, header(bad, Timestamp::ZERO), &[], None);
        assert!(matches!(refused.err(), Some(TakeError::Name(_))), "{bad}");
        assert!(TakeReader::open(&*storage, bad).is_err());
        assert!(
            storage.create(bad).is_err()
                && storage.open(bad).is_err()
                && storage.remove(bad).is_err()
        );
    }
    assert_eq!(std::fs::read_dir(outer.path()).unwrap().count(), 1);
}

#[test]
fn a_take_being_recorded_is_listed_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(folder.path()).unwrap());
    let writer = TakeWriter::create(&storage, header("now", Timestamp::ZERO), &[], None).unwrap();
    let list = Catalogue::list(&*storage).unwrap();
    assert_eq!(
        (list[0].state, list[0].slate.as_str()),
        (TakeState::Recording, "12A")
    );
    assert!(
        posefuse_session::recover(&storage).unwrap().is_empty(),
        "a live take is left alone"
    );
    assert!(matches!(
        TakeReader::open(&*storage, "now").err(),
        Some(TakeError::Unfinished(_))
    ));
    drop(writer);
    assert_eq!(
        Catalogue::list(&*storage).unwrap()[0].state,
        TakeState::Damaged
    );
}

#[test]
fn a_folder_that_cannot_be_used_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let error = DiskStorage::new(file.join("takes"))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("file/takes") && error.contains("writable"),
        "{error}"
    );
}

#[test]
fn the_calibration_in_a_take_is_a_calibration_file() {
    let memory = MemoryStorage::new();
    let storage: Arc<dyn Storage> = Arc::new(memory.clone());
    record(&storage, "walk", 0.0, 0.5, 1);
    let bytes = memory.read("walk.mcap").unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let index = summary
        .attachment_indexes
        .iter()
        .find(|index| index.name == "calibration.toml")
        .unwrap();
    let attachment = mcap::read::attachment(&bytes, index).unwrap();
    let text = String::from_utf8(attachment.data.to_vec()).unwrap();
    assert_eq!(text, calibration_text::to_toml(&calibration()));
    let read = calibration_text::from_toml(&text).unwrap();
    let take = TakeReader::open(&*storage, "walk").unwrap();
    assert_eq!(take.header().calibration, Some(read));
}

#[test]
fn a_calibration_that_is_no_file_keeps_no_take_from_being_recorded() {
    let mut far = calibration();
    far.sensors
        .values_mut()
        .for_each(|pose| pose.time_offset_ns = 60_000_000_000);
    for calibration in [Calibration::default(), far] {
        let storage = memory();
        let inputs = [Input::Calibration(Arc::new(calibration.clone()))];
        let header = posefuse_session::TakeHeader {
            calibration: Some(calibration),
            ..header("t", Timestamp::ZERO)
        };
        let writer = TakeWriter::create(&storage, header, &inputs, None).unwrap();
        writer.finish().unwrap();
        let take = TakeReader::open(&*storage, "t").unwrap();
        assert_eq!(take.header().calibration, None);
        assert_eq!(take.beginning().unwrap().1, inputs);
    }
}

#[test]
fn a_file_gets_a_name_only_if_that_is_free() {
    let folder = tempfile::tempdir().unwrap();
    let disk = DiskStorage::new(folder.path()).unwrap();
    for storage in [Arc::new(disk) as Arc<dyn Storage>, memory()] {
        for (file, bytes) in [("a", b"first"), ("b", b"other"), ("c", b"third")] {
            storage.create(file).unwrap().append(bytes).unwrap();
        }
        let error = storage.rename_new("a", "b").unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::AlreadyExists);
        storage.rename_new("c", "d").unwrap();
        let read = |file: &str| {
            let mut bytes = [0; 5];
            storage.open(file).unwrap().read_at(0, &mut bytes).unwrap();
            bytes
        };
        assert_eq!(
            (&read("a"), &read("b"), &read("d")),
            (b"first", b"other", b"third")
        );
        assert_eq!(storage.list().unwrap().len(), 3);
    }
}
