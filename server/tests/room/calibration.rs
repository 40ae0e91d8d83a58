//! Calibrating, and the calibration's file.

use std::sync::Arc;

use posefuse_proto::v1::{self, Verdict, calibrate_event};
use posefuse_session::{MemoryStorage, Storage};
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
    assert!(
        files.len() == 2 && files.iter().any(|file| file.contains(".until-")),
        "{files:?}"
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
    let alone = room.calibrate(v1::CalibrateRequest::default()).await;
    assert_refused(
        alone.map(|_| ()),
        Code::FailedPrecondition,
        &["two or more", "start another agent"],
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
