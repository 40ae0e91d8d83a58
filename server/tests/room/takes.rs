//! Recording, listing, replaying, recovering.

use std::sync::Arc;
use std::time::Duration;

use posefuse_proto::v1::room_client::RoomClient;
use posefuse_proto::v1::{self, TakeState, replay_event};
use posefuse_server::{Parts, ServerError};
use posefuse_session::{DiskStorage, MemoryStorage, Storage, TakeReader, Topic};
use tonic::Code;
use tonic::transport::Channel;

use crate::fixture::{
    Server, assert_refused, calibrated, config, memory, start, start_with, status_when,
};

async fn start_take(server: &Server, name: &str) -> v1::Take {
    let request = v1::StartTakeRequest {
        name: name.to_owned(),
        slate: "scene 1".to_owned(),
        notes: "a test".to_owned(),
    };
    server
        .room()
        .await
        .start_take(request)
        .await
        .unwrap()
        .into_inner()
}

#[tokio::test]
async fn a_take_is_recorded_listed_renoted_and_replayed() {
    let storage = memory();
    let server = start_with(config(), storage.clone(), memory()).await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left"]).await;
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    let begun = start_take(&server, "walk").await;
    assert_eq!(
        (begun.name.as_str(), begun.state()),
        ("walk", TakeState::Recording)
    );
    refused_while_recording(&mut room).await;
    agent.walk(0..100).await;
    agent.acked(99).await;
    let running = status_when(&mut room, |s| {
        s.recording.as_ref().is_some_and(|t| t.frames > 5)
    })
    .await;
    assert!(running.recording.unwrap().duration_ns > 500_000_000);
    let take = room
        .stop_take(v1::StopTakeRequest {})
        .await
        .unwrap()
        .into_inner();
    assert_eq!(
        (take.state(), take.people, take.dropped),
        (TakeState::Complete, 1, 0)
    );
    assert_eq!(take.sensors, ["left"]);
    assert_refused(
        room.stop_take(v1::StopTakeRequest {}).await,
        Code::FailedPrecondition,
        &["no take"],
    );

    let list = room
        .list_takes(v1::ListTakesRequest {})
        .await
        .unwrap()
        .into_inner();
    assert_eq!(list.takes, std::slice::from_ref(&take));
    let notes = v1::UpdateTakeRequest {
        name: "walk".to_owned(),
        slate: None,
        notes: Some("best one".to_owned()),
    };
    let renoted = room.update_take(notes).await.unwrap().into_inner();
    assert_eq!(
        (renoted.notes.as_str(), renoted.slate.as_str()),
        ("best one", "scene 1")
    );

    // Everything that came during the take is in it, and comes back.
    let reader = TakeReader::open(&*storage, "walk").unwrap();
    assert_eq!(
        reader.observations().filter(|seen| seen.is_ok()).count(),
        100
    );
    assert!(
        reader.beginning().unwrap().0.is_some(),
        "the engine's state is missing"
    );
    let comes_back = replayed(&mut room, "walk").await;
    assert_eq!(comes_back, (take.frames, 100));
    server.stop().await;
}

async fn refused_while_recording(room: &mut RoomClient<Channel>) {
    let again = room.start_take(v1::StartTakeRequest::default()).await;
    assert_refused(
        again,
        Code::FailedPrecondition,
        &["`walk`", "stop it first"],
    );
    let change = v1::SetCalibrationRequest {
        calibration: Some(crate::fixture::calibration(&["left"])),
    };
    assert_refused(
        room.set_calibration(change).await,
        Code::FailedPrecondition,
        &["take", "stop it"],
    );
}

/// Replays a take as fast as it goes; gives the numbers of fused frames and of observations.
async fn replayed(room: &mut RoomClient<Channel>, name: &str) -> (u64, u64) {
    let request = v1::ReplayTakeRequest {
        name: name.to_owned(),
        ..Default::default()
    };
    let mut replay = room.replay_take(request).await.unwrap().into_inner();
    let (mut frames, mut observations) = (0, 0);
    let first = replay.message().await.unwrap().unwrap().event;
    let Some(replay_event::Event::Start(start)) = first else {
        panic!("the first event is no start: {first:?}");
    };
    assert_eq!(start.sensors[0].name, "left");
    assert_eq!(start.calibration.unwrap().sensors.len(), 1);
    while let Some(event) = replay.message().await.unwrap() {
        match event.event.unwrap() {
            replay_event::Event::Frame(_) => frames += 1,
            replay_event::Event::Observation(_) => observations += 1,
            replay_event::Event::Start(_) => panic!("a second start"),
        }
    }
    (frames, observations)
}

#[tokio::test]
async fn a_replay_keeps_the_take_s_own_time() {
    let server = start().await;
    let mut room = server.room().await;
    let agent = server.agent("left").await;
    start_take(&server, "walk").await;
    agent.walk(0..100).await;
    let take = room
        .stop_take(v1::StopTakeRequest {})
        .await
        .unwrap()
        .into_inner();
    let half = take.duration_ns / 2;
    let request = v1::ReplayTakeRequest {
        name: "walk".to_owned(),
        start_ns: half,
        speed: 2.0,
    };
    let mut replay = room.replay_take(request).await.unwrap().into_inner();
    let began = std::time::Instant::now();
    let mut offsets = Vec::new();
    while let Some(event) = replay.message().await.unwrap() {
        offsets.push(event.offset_ns);
    }
    let (took, due) = (began.elapsed().as_secs_f64(), half as f64 * 1e-9 / 2.0);
    assert!(offsets.iter().all(|offset| *offset >= half));
    assert!((30..=70).contains(&offsets.len()), "{}", offsets.len());
    assert!(took > 0.7 * due && took < due + 0.5, "{took} s for {due} s");

    for (request, code) in [
        (
            v1::ReplayTakeRequest {
                name: "none".to_owned(),
                ..Default::default()
            },
            Code::NotFound,
        ),
        (
            v1::ReplayTakeRequest {
                name: "../x".to_owned(),
                ..Default::default()
            },
            Code::InvalidArgument,
        ),
        (
            v1::ReplayTakeRequest {
                name: "walk".to_owned(),
                start_ns: 0,
                speed: f64::NAN,
            },
            Code::InvalidArgument,
        ),
    ] {
        assert_refused(room.replay_take(request).await.map(|_| ()), code, &[]);
    }
    server.stop().await;
}

#[tokio::test]
async fn a_graceful_stop_gives_the_running_take_its_end() {
    let storage = memory();
    let server = start_with(config(), storage.clone(), memory()).await;
    let mut agent = server.agent("left").await;
    start_take(&server, "walk").await;
    agent.walk(0..50).await;
    agent.acked(49).await;
    server.stop().await;
    let take = TakeReader::open(&*storage, "walk").unwrap();
    assert_eq!(take.info().state, posefuse_session::TakeState::Complete);
    assert_eq!(take.observations().count(), 50);
    let last = take.events().last().unwrap().unwrap();
    assert_eq!(last.kind, "server-stopped");
}

#[tokio::test]
async fn a_take_notes_when_a_sensor_stalls_and_goes() {
    let storage = memory();
    let server = start_with(config(), storage.clone(), memory()).await;
    let mut room = server.room().await;
    start_take(&server, "walk").await;
    let agent = server.agent("left").await;
    agent.walk(0..20).await;
    let state = |wanted: v1::SensorState| {
        move |s: &v1::RoomStatus| s.sensors.first().is_some_and(|s| s.state() == wanted)
    };
    status_when(&mut room, state(v1::SensorState::Stalled)).await;
    tokio::time::sleep(Duration::from_millis(250)).await;
    drop(agent);
    status_when(&mut room, state(v1::SensorState::Disconnected)).await;
    tokio::time::sleep(Duration::from_millis(250)).await;
    room.stop_take(v1::StopTakeRequest {}).await.unwrap();
    let take = TakeReader::open(&*storage, "walk").unwrap();
    let events: Vec<_> = take.events().map(|event| event.unwrap()).collect();
    let kinds: Vec<_> = events.iter().map(|event| event.kind.as_str()).collect();
    assert!(kinds.starts_with(&["sensor-connected"]), "{kinds:?}");
    assert!(
        kinds.ends_with(&["sensor-stalled", "sensor-disconnected"]),
        "{kinds:?}"
    );
    assert!(events.iter().all(|event| event.sensor == "left"));
    server.stop().await;
}

#[tokio::test]
async fn a_take_that_was_cut_off_is_recovered_at_the_next_start() {
    let folder = Arc::new(MemoryStorage::new());
    let server = start_with(config(), folder.clone(), memory()).await;
    let mut agent = server.agent("left").await;
    start_take(&server, "walk").await;
    agent.walk(0..60).await;
    agent.acked(59).await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    let crashed: Arc<dyn Storage> = Arc::new(folder.after_kill());
    server.kill().await;
    assert!(TakeReader::open(&*crashed, "walk").is_err());

    let server = start_with(config(), crashed.clone(), memory()).await;
    let list = server
        .room()
        .await
        .list_takes(v1::ListTakesRequest {})
        .await
        .unwrap()
        .into_inner();
    assert_eq!(
        (list.takes.len(), list.takes[0].state()),
        (1, TakeState::Recovered)
    );
    let take = TakeReader::open(&*crashed, "walk").unwrap();
    assert_eq!(take.observations().count(), 60);
    server.stop().await;
}

#[tokio::test]
async fn names_are_made_unique_and_bad_ones_refused() {
    let server = start().await;
    let mut room = server.room().await;
    for expected in ["walk", "walk-2", "walk-3"] {
        assert_eq!(start_take(&server, "walk").await.name, expected);
        room.stop_take(v1::StopTakeRequest {}).await.unwrap();
    }
    let request = v1::StartTakeRequest {
        name: "../../etc/passwd".to_owned(),
        ..Default::default()
    };
    assert_refused(
        room.start_take(request).await,
        Code::InvalidArgument,
        &["etc/passwd", "letters"],
    );
    let dated = room
        .start_take(v1::StartTakeRequest::default())
        .await
        .unwrap()
        .into_inner();
    assert!(
        dated.name.starts_with("20") && dated.name.contains('_'),
        "{}",
        dated.name
    );
    server.stop().await;
}

#[tokio::test]
async fn a_full_disk_is_said_before_and_during_a_take() {
    let small = Arc::new(MemoryStorage::with_capacity(40_000_000, true));
    let server = start_with(config(), small.clone(), memory()).await;
    let mut room = server.room().await;
    let agent = server.agent("left").await;
    start_take(&server, "walk").await;
    agent.walk(0..20).await;
    small.occupied_by_others(39_500_000);
    let says = |part: &'static str| {
        move |s: &v1::RoomStatus| s.troubles.iter().any(|trouble| trouble.contains(part))
    };
    let ended = status_when(&mut room, says("`walk` ended by itself")).await;
    assert!(ended.recording.is_none());
    // The take has given back what it had set aside; others take that too.
    small.occupied_by_others(39_900_000);
    status_when(&mut room, says("delete takes")).await;
    let take = TakeReader::open(&*small, "walk").unwrap();
    assert!(take.count(Topic::Inputs) >= 20);
    let refused = room.start_take(v1::StartTakeRequest::default()).await;
    assert_refused(
        refused,
        Code::ResourceExhausted,
        &["MB are free", "delete takes"],
    );
    // The room goes on.
    agent.walk(20..40).await;
    status_when(&mut room, |s| s.sensors[0].frames_received == 40).await;
    server.stop().await;
}

#[tokio::test]
async fn a_folder_that_cannot_be_written_is_named_at_the_start() {
    let scratch = tempfile::tempdir().unwrap();
    let file = scratch.path().join("file");
    std::fs::write(&file, "not a folder").unwrap();
    let mut config = config();
    config.takes.folder = file.join("takes");
    config.calibration.file = scratch.path().join("calibration.toml");
    let error = Parts::system(&config).await.err().expect("it was taken");
    assert!(matches!(error, ServerError::Folder(_)));
    let text = error.to_string();
    assert!(
        text.contains("file/takes") && text.contains("writable"),
        "{text}"
    );
}

#[tokio::test]
async fn a_real_folder_holds_real_takes() {
    let scratch = tempfile::tempdir().unwrap();
    let mut config = config();
    config.takes.folder = scratch.path().join("takes");
    config.calibration.file = scratch.path().join("calibration.toml");
    let parts = Parts::system(&config).await.unwrap();
    let server = crate::fixture::serve(config, parts);
    calibrated(&mut server.room().await, &["left"]).await;
    assert!(scratch.path().join("calibration.toml").exists());
    let mut agent = server.agent("left").await;
    start_take(&server, "walk").await;
    agent.walk(0..30).await;
    agent.acked(29).await;
    server.stop().await;
    let storage = DiskStorage::new(scratch.path().join("takes")).unwrap();
    assert_eq!(
        TakeReader::open(&storage, "walk")
            .unwrap()
            .observations()
            .count(),
        30
    );
}
