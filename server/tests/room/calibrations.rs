//! Calibrations that are kept, and calibrations to and from other programs.

use std::sync::Arc;

use posefuse_proto::v1::room_client::RoomClient;
use posefuse_proto::v1::{self, CalibrationFormat};
use posefuse_session::{MemoryStorage, Storage};
use tonic::Code;
use tonic::transport::Channel;

use crate::fixture::{
    assert_refused, calibrated, calibration, config, memory, start, start_with, status_when,
};

async fn list(room: &mut RoomClient<Channel>) -> Vec<v1::StoredCalibration> {
    let list = room.list_calibrations(v1::ListCalibrationsRequest {}).await;
    list.unwrap().into_inner().calibrations
}

async fn in_force(room: &mut RoomClient<Channel>) -> v1::Calibration {
    let current = room.get_calibration(v1::GetCalibrationRequest {}).await;
    current.unwrap().into_inner()
}

async fn restore(
    room: &mut RoomClient<Channel>,
    name: &str,
) -> Result<v1::Calibration, tonic::Status> {
    let name = name.to_owned();
    let restored = room
        .restore_calibration(v1::RestoreCalibrationRequest { name })
        .await;
    restored.map(tonic::Response::into_inner)
}

async fn import(
    room: &mut RoomClient<Channel>,
    text: impl Into<String>,
    dry_run: bool,
) -> Result<v1::Calibration, tonic::Status> {
    let request = v1::ImportCalibrationRequest {
        text: text.into(),
        dry_run,
        ..Default::default()
    };
    let imported = room.import_calibration(request).await;
    imported.map(tonic::Response::into_inner)
}

async fn export(room: &mut RoomClient<Channel>, format: CalibrationFormat) -> v1::CalibrationFile {
    let request = v1::ExportCalibrationRequest {
        format: format.into(),
        ..Default::default()
    };
    let exported = room.export_calibration(request).await;
    exported.unwrap().into_inner()
}

#[tokio::test]
async fn each_that_was_in_force_is_kept_and_can_be_restored_and_compared() {
    let folder = memory();
    let server = start_with(config(), memory(), folder.clone()).await;
    let mut room = server.room().await;
    assert!(list(&mut room).await.is_empty());
    calibrated(&mut room, &["left", "right"]).await;
    let mut moved = calibration(&["left", "right", "door"]);
    let at = moved.sensors[1].room_from_sensor.as_mut().unwrap();
    at.translation.as_mut().unwrap().y = 0.1;
    moved.sensors[1].time_offset_ns = -4_000_000;
    let set = v1::SetCalibrationRequest {
        calibration: Some(moved),
    };
    room.set_calibration(set).await.unwrap();

    let kept = list(&mut room).await;
    assert_eq!(kept.len(), 2);
    assert!(kept[0].in_force && !kept[1].in_force, "{kept:?}");
    assert_eq!(kept[1].calibration.as_ref().unwrap().sensors.len(), 2);

    let request = v1::CompareCalibrationsRequest {
        before: kept[1].name.clone(),
        after: String::new(),
    };
    let moves = room.compare_calibrations(request).await.unwrap();
    let moves = moves.into_inner().moves;
    assert_eq!(moves.len(), 3);
    assert_eq!(
        (moves[0].sensor.as_str(), moves[0].missing_in.as_str()),
        ("door", "before")
    );
    let between: f64 = moves[1..].iter().map(|row| row.moved_mm.unwrap()).sum();
    assert!((between - 100.0).abs() < 1.0, "{moves:?}");

    let oldest = kept[1].name.clone();
    let restored = restore(&mut room, &oldest).await.unwrap();
    assert_eq!(restored.sensors.len(), 2);
    let after = list(&mut room).await;
    assert_eq!(after.len(), 2, "a restored one is not kept twice");
    assert!(after[1].in_force && after[1].name == oldest);
    assert_refused(
        restore(&mut room, "2020-01-01T00-00-00Z").await,
        Code::NotFound,
        &["2020-01-01T00-00-00Z", "posefuse calibrations"],
    );
    server.stop().await;

    let server = start_with(config(), memory(), folder).await;
    let mut room = server.room().await;
    assert_eq!(in_force(&mut room).await.sensors.len(), 2);
    assert!(list(&mut room).await[1].in_force);
    server.stop().await;
}

#[tokio::test]
async fn one_that_cannot_be_read_is_listed_with_its_trouble_and_never_restored() {
    let name = "2026-01-01T00-00-00Z";
    let bad = (
        format!("calibration.{name}.toml"),
        b"version = 7\n".to_vec(),
    );
    let folder: Arc<dyn Storage> = Arc::new(MemoryStorage::holding([bad]));
    let server = start_with(config(), memory(), folder).await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left"]).await;
    let kept = list(&mut room).await;
    let found = kept.iter().find(|kept| kept.name == name).unwrap();
    assert!(found.calibration.is_none() && !found.in_force);
    assert!(found.trouble.contains("version 7"), "{}", found.trouble);
    assert_refused(
        restore(&mut room, name).await,
        Code::FailedPrecondition,
        &[name, "version 7"],
    );
    assert_eq!(in_force(&mut room).await.sensors[0].sensor, "left");
    server.stop().await;
}

#[tokio::test]
async fn nothing_changes_while_a_take_runs() {
    let server = start().await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left"]).await;
    calibrated(&mut room, &["left", "right"]).await;
    let oldest = list(&mut room).await[1].name.clone();
    let text = export(&mut room, CalibrationFormat::Toml).await.text;
    room.start_take(v1::StartTakeRequest::default())
        .await
        .unwrap();
    for refused in [
        restore(&mut room, &oldest).await,
        import(&mut room, text.clone(), false).await,
    ] {
        assert_refused(
            refused,
            Code::FailedPrecondition,
            &["a take is being recorded"],
        );
    }
    import(&mut room, text, true).await.unwrap();
    assert_eq!(in_force(&mut room).await.sensors.len(), 2);
    server.stop().await;
}

#[tokio::test]
async fn every_form_goes_out_and_comes_back_in() {
    let server = start().await;
    let mut room = server.room().await;
    let none = room
        .export_calibration(v1::ExportCalibrationRequest::default())
        .await;
    assert_refused(none, Code::NotFound, &["posefuse calibrate"]);
    calibrated(&mut room, &["left", "right"]).await;
    let pose = in_force(&mut room).await.sensors[0].room_from_sensor;
    for (format, ending) in [
        (CalibrationFormat::Unspecified, ".toml"),
        (CalibrationFormat::Toml, ".toml"),
        (CalibrationFormat::Json, ".json"),
        (CalibrationFormat::Tf2Yaml, ".tf2.yaml"),
        (CalibrationFormat::OpencvYaml, ".opencv.yaml"),
    ] {
        let file = export(&mut room, format).await;
        assert!(file.file_name.ends_with(ending), "{}", file.file_name);
        let read = import(&mut room, file.text, false).await.unwrap();
        assert_eq!(read.sensors.len(), 2, "{format:?}");
        assert!(!read.created.is_empty());
        let (a, b) = (read.sensors[0].room_from_sensor.unwrap(), pose.unwrap());
        let (a, b) = (a.translation.unwrap(), b.translation.unwrap());
        assert!((a.z - b.z).abs() < 1e-9 && (a.x - b.x).abs() < 1e-9);
        assert_eq!(in_force(&mut room).await, read);
    }
    server.stop().await;
}

#[tokio::test]
async fn files_that_no_room_can_use_are_refused_and_the_one_in_force_stays() {
    let server = start().await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left", "right"]).await;
    let before = in_force(&mut room).await;
    let toml = export(&mut room, CalibrationFormat::Toml).await.text;
    let json = export(&mut room, CalibrationFormat::Json).await.text;
    let opencv = export(&mut room, CalibrationFormat::OpencvYaml).await.text;
    let mirrored = opencv.replacen("data: [ 0.0", "data: [ -1.0", 1);
    let change = |text: &str, find: &str, put: &str| {
        assert!(text.contains(find), "no `{find}` in {text}");
        text.replacen(find, put, 1)
    };
    for (text, says) in [
        (change(&toml, "version = 1", "version = 0"), "version 0"),
        (change(&toml, "= [0.0", "= [nan"), "position_m"),
        (change(&toml, "= [0.0", "= [2500.0"), "millimetres: divide"),
        (change(&json, "0.5", "1.5"), "length 1"),
        (mirrored, "R must be a rotation"),
        (change(&toml, "\"left\"", "\"le ft\""), "le ft"),
        ("some notes".to_owned(), "none of the calibration files"),
        (String::new(), "none of the calibration files"),
    ] {
        assert_refused(
            import(&mut room, text, false).await,
            Code::InvalidArgument,
            &[says],
        );
        assert_eq!(in_force(&mut room).await, before);
    }
    assert_eq!(list(&mut room).await.len(), 1);
    server.stop().await;
}

#[tokio::test]
async fn a_file_of_other_sensors_is_refused_by_name_and_one_of_some_is_marked() {
    let server = start().await;
    let mut room = server.room().await;
    calibrated(&mut room, &["door", "window"]).await;
    let others = export(&mut room, CalibrationFormat::Tf2Yaml).await.text;
    let _left = server.agent("left").await;
    let _right = server.agent("right").await;
    let status = status_when(&mut room, |status| !status.troubles.is_empty()).await;
    let trouble = &status.troubles[0];
    for part in ["of other sensors", "`door`, `window`", "`left`, `right`"] {
        assert!(trouble.contains(part), "{trouble}");
    }

    calibrated(&mut room, &["left", "right"]).await;
    assert_refused(
        import(&mut room, others.clone(), false).await,
        Code::FailedPrecondition,
        &["`door`, `window`", "`left`, `right`", "as it was"],
    );
    assert_eq!(in_force(&mut room).await.sensors[0].sensor, "left");

    let some = others.replace("door_optical", "left_optical");
    import(&mut room, some, false).await.unwrap();
    let status = status_when(&mut room, |status| !status.troubles.is_empty()).await;
    let trouble = &status.troubles[0];
    for part in ["does not know `right`", "`window`, which never connected"] {
        assert!(trouble.contains(part), "{trouble}");
    }
    server.stop().await;
}
