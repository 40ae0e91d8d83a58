//! Calibrating, and the calibration's file.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use posefuse_fusion::Input;
use posefuse_proto::v1::{self, Verdict, calibrate_event};
use posefuse_session::{Append, MemoryStorage, ReadAt, Storage, Stored, TakeReader};
use tonic::Code;

use crate::fixture::{assert_refused, calibrated, config, memory, start, start_with, status_when};

#[tokio::test]
async fn a_calibration_is_kept_and_in_force_after_a_restart() {
    let folder = memory();
    let server = start_with(config(), memory(), folder.clone()).await;
    let mut room = server.room().await;
    let none = room.get_calibration(v1::GetCalibrationRequest {}).await;
    assert_refused(none, Code::NotFound, &["posefuse calibrate"]);
    calibrated(&mut room, &["left", "right"]).await;
    calibrated(&mut room, &["left", "right", "door"]).await;
    server.stop().await;

    let server = start_with(config(), memory(), folder.clone()).await;
    let mut room = server.room().await;
    let kept = room
        .get_calibration(v1::GetCalibrationRequest {})
        .await
        .unwrap()
        .into_inner();
    assert_eq!(kept.sensors.len(), 3);
    let files: Vec<_> = folder
        .list()
        .unwrap()
        .into_iter()
        .map(|stored| stored.file)
        .collect();
    assert_eq!(
        files.len(),
        3,
        "the one in force, and each that ever was: {files:?}"
    );
    server.stop().await;
}

#[tokio::test]
async fn a_calibration_file_that_cannot_be_used_is_a_trouble_not_an_end() {
    let bad = (
        "calibration.toml".to_owned(),
        b"version = 1\nflor = 3".to_vec(),
    );
    let folder: Arc<dyn Storage> = Arc::new(MemoryStorage::holding([bad]));
    let server = start_with(config(), memory(), folder).await;
    let mut room = server.room().await;
    let status = status_when(&mut room, |status| !status.troubles.is_empty()).await;
    assert!(status.calibration.is_none());
    let trouble = &status.troubles[0];
    assert!(
        trouble.contains("calibration.toml") && trouble.contains("flor"),
        "{trouble}"
    );
    calibrated(&mut room, &["left"]).await;
    status_when(&mut room, |status| status.troubles.is_empty()).await;
    server.stop().await;
}

#[tokio::test]
async fn a_pose_that_is_none_is_refused() {
    let server = start().await;
    let mut room = server.room().await;
    let mut calibration = crate::fixture::calibration(&["left"]);
    calibration.sensors[0]
        .room_from_sensor
        .as_mut()
        .unwrap()
        .rotation
        .as_mut()
        .unwrap()
        .w = 7.0;
    let request = v1::SetCalibrationRequest {
        calibration: Some(calibration),
    };
    assert_refused(
        room.set_calibration(request).await,
        Code::InvalidArgument,
        &["left", "length"],
    );
    server.stop().await;
}

#[tokio::test]
async fn without_a_calibration_the_room_says_what_to_do() {
    let server = start().await;
    let mut room = server.room().await;
    let nobody = room.calibrate(v1::CalibrateRequest::default()).await;
    assert_refused(
        nobody.map(|_| ()),
        Code::FailedPrecondition,
        &["needs a sensor", "start an agent"],
    );
    let _left = server.agent("left").await;
    let _right = server.agent("right").await;
    let status = status_when(&mut room, |status| !status.troubles.is_empty()).await;
    assert!(
        status.troubles[0].contains("no calibration") && status.troubles[0].contains("walk about")
    );
    server.stop().await;
}

#[tokio::test]
async fn a_walk_nobody_saw_fails_with_a_reason_and_changes_nothing() {
    let server = start().await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left", "right"]).await;
    let left = server.agent("left").await;
    let _right = server.agent("right").await;
    let request = v1::CalibrateRequest {
        seconds: 2.0,
        dry_run: false,
    };
    let mut events = room.calibrate(request).await.unwrap().into_inner();
    let second = room
        .clone()
        .calibrate(v1::CalibrateRequest::default())
        .await;
    assert_refused(
        second.map(|_| ()),
        Code::FailedPrecondition,
        &["runs already"],
    );
    let refused = room.start_take(v1::StartTakeRequest::default()).await;
    assert_refused(refused, Code::FailedPrecondition, &["a calibration runs"]);
    let walking = tokio::spawn(async move {
        left.walk(0..150).await;
        left
    });
    let (mut progress, mut result) = (0, None);
    while let Some(event) = events.message().await.unwrap() {
        match event.event.unwrap() {
            calibrate_event::Event::Progress(found) => {
                assert_eq!((found.sensors.len(), found.total_seconds), (2, 2.0));
                progress += 1;
            }
            calibrate_event::Event::Result(found) => result = Some(found),
        }
    }
    let result = result.expect("no result");
    assert!(progress >= 6, "{progress} messages of progress in 2 s");
    assert_eq!(result.verdict(), Verdict::Failed);
    assert!(!result.in_force && result.calibration.is_none());
    assert!(
        result.reasons.iter().any(|reason| reason.contains("right")),
        "{:?}",
        result.reasons
    );
    let kept = room
        .get_calibration(v1::GetCalibrationRequest {})
        .await
        .unwrap()
        .into_inner();
    assert_eq!(kept.method, "test");
    walking.await.unwrap();
    server.stop().await;
}

#[tokio::test]
async fn a_lone_sensor_calibrates_and_is_told_what_that_means() {
    let server = start().await;
    let mut room = server.room().await;
    let left = server.agent("left").await;
    let request = v1::CalibrateRequest {
        seconds: 2.0,
        dry_run: true,
    };
    let mut events = room.calibrate(request).await.unwrap().into_inner();
    let walking = tokio::spawn(async move {
        left.walk(0..150).await;
        left
    });
    let mut result = None;
    while let Some(event) = events.message().await.unwrap() {
        if let calibrate_event::Event::Result(found) = event.event.unwrap() {
            result = Some(found);
        }
    }
    let reasons = result.expect("no result").reasons;
    assert!(
        reasons
            .iter()
            .any(|r| r.contains("`left` is the only sensor")),
        "{reasons:?}"
    );
    walking.await.unwrap();
    server.stop().await;
}

#[tokio::test]
async fn dropping_the_stream_cancels_a_calibration() {
    let server = start().await;
    let mut room = server.room().await;
    let _agents = (server.agent("left").await, server.agent("right").await);
    let events = room
        .calibrate(v1::CalibrateRequest::default())
        .await
        .unwrap();
    status_when(&mut room, |status| status.calibrating).await;
    drop(events);
    status_when(&mut room, |status| !status.calibrating).await;
    server.stop().await;
}

/// A folder on a slow disk.
struct Slow(MemoryStorage);

impl Storage for Slow {
    fn create(&self, file: &str) -> io::Result<Box<dyn Append>> {
        std::thread::sleep(Duration::from_millis(200));
        self.0.create(file)
    }
    fn open(&self, file: &str) -> io::Result<Arc<dyn ReadAt>> {
        self.0.open(file)
    }
    fn is_being_written(&self, file: &str) -> io::Result<bool> {
        self.0.is_being_written(file)
    }
    fn list(&self) -> io::Result<Vec<Stored>> {
        self.0.list()
    }
    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        self.0.rename(from, to)
    }
    fn rename_new(&self, from: &str, to: &str) -> io::Result<()> {
        self.0.rename_new(from, to)
    }
    fn remove(&self, file: &str) -> io::Result<()> {
        self.0.remove(file)
    }
    fn free_bytes(&self) -> io::Result<u64> {
        self.0.free_bytes()
    }
    fn sync(&self) -> io::Result<()> {
        self.0.sync()
    }
    fn place(&self) -> String {
        self.0.place()
    }
}

#[tokio::test]
async fn a_client_that_goes_away_midway_leaves_file_and_server_agreeing() {
    let folder = Arc::new(Slow(MemoryStorage::new()));
    let server = start_with(config(), memory(), folder.clone()).await;
    let mut leaving = server.room().await;
    let request = v1::SetCalibrationRequest {
        calibration: Some(crate::fixture::calibration(&["left"])),
    };
    let soon = Duration::from_millis(80);
    let left = tokio::time::timeout(soon, leaving.set_calibration(request)).await;
    assert!(left.is_err(), "the disk was too fast for this test");
    drop(leaving);
    let mut room = server.room().await;
    status_when(&mut room, |status| status.calibration.is_some()).await;
    assert!(folder.open("calibration.toml").is_ok());
    server.stop().await;
}

#[tokio::test]
async fn a_calibration_and_a_take_never_overlap() {
    let takes = memory();
    let server = start_with(config(), takes.clone(), memory()).await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left"]).await;
    let mut began = 0;
    for round in 0..60_u64 {
        let mut calibration = crate::fixture::calibration(&["left"]);
        calibration.method = format!("round {round}");
        let change = v1::SetCalibrationRequest {
            calibration: Some(calibration),
        };
        let (mut one, mut other) = (room.clone(), room.clone());
        let setting = async {
            tokio::time::sleep(Duration::from_micros(100 * (round % 6))).await;
            one.set_calibration(change).await
        };
        let starting = async {
            tokio::time::sleep(Duration::from_micros(300 * (round / 6))).await;
            other.start_take(v1::StartTakeRequest::default()).await
        };
        let (set, started) = tokio::join!(setting, starting);
        let take = started.unwrap().into_inner().name;
        room.stop_take(v1::StopTakeRequest {}).await.unwrap();

        let take = TakeReader::open(&*takes, &take).unwrap();
        let (_, preamble) = take.beginning().unwrap();
        let known = |input: &Input| match input {
            Input::Calibration(calibration) => Some(calibration.method.clone()),
            _ => None,
        };
        let header = take.header().calibration.as_ref().unwrap().method.clone();
        assert_eq!(preamble.iter().find_map(known).as_ref(), Some(&header));
        let later = take.inputs().filter_map(|input| known(&input.unwrap()));
        assert_eq!(later.count(), 0, "a calibration came into a running take");
        if set.is_ok() {
            began += 1;
            assert_eq!(header, format!("round {round}"));
        } else {
            assert_ne!(header, format!("round {round}"));
        }
    }
    assert!(
        began > 0,
        "no calibration was ever put in force before a take"
    );
    server.stop().await;
}
