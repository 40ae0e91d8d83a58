//! The model beside the engine: asked in a running room, answers in time, and its answers are in the take.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use posefuse_fusion::Input;
use posefuse_proto::v1;
use posefuse_server::Config;
use posefuse_session::{Recorded, RefuseOptions, Storage, TakeReader, Topic, refuse};

use crate::fixture::{Agent, calibrated, config, memory, person, start_with, status_when};

/// Left elbow, wrist, hand.
const HIDDEN: [usize; 3] = [5, 6, 7];

fn with_model(name: &str) -> Config {
    let mut config = config();
    config.models.folder =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../models/tests/fixtures");
    config.fusion.repair.model = name.to_owned();
    // The machine that tests may be busy.
    config.fusion.repair.deadline_ms = 500.0;
    config
}

/// A person whose left arm nobody sees after the first second.
async fn walk(agent: &Agent, frames: u64) {
    for sequence in 0..frames {
        let mut body = person(sequence as f32 * 0.03);
        if sequence > 30 {
            for joint in HIDDEN {
                body.confidences[joint] = 0.0;
            }
        }
        agent.frame(sequence, vec![body]).await;
        tokio::time::sleep(Duration::from_millis(30)).await;
    }
}

#[tokio::test]
async fn a_network_fills_in_a_hidden_arm_and_the_take_replays_without_it() {
    let storage = memory();
    let server = start_with(with_model("tiny-gru"), storage.clone(), memory()).await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left"]).await;
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    let take = v1::StartTakeRequest {
        name: "t".to_owned(),
        ..Default::default()
    };
    room.start_take(take).await.unwrap();
    walk(&agent, 80).await;
    let status = status_when(&mut room, |status| {
        status
            .repair
            .as_ref()
            .is_some_and(|repair| repair.answers > 10)
    })
    .await;
    let repair = status.repair.unwrap();
    assert_eq!(repair.model, "tiny-gru");
    assert!(repair.runtime.starts_with("rten "), "{repair:?}");
    assert!(
        repair.p50_ms.unwrap() > 0.0 && repair.p99_ms >= repair.p50_ms,
        "{repair:?}"
    );
    assert_eq!((repair.failed, repair.trouble.as_str()), (0, ""));
    let page = metrics(server.address).await;
    assert!(
        page.contains("posefuse_repair_model{model=\"tiny-gru\",runtime=\"rten"),
        "{page}"
    );
    assert!(page.contains("posefuse_repair_answers_total"), "{page}");
    room.stop_take(v1::StopTakeRequest {}).await.unwrap();
    server.stop().await;

    let answers = answers(&*storage, "t");
    assert!(answers > 10, "{answers} answers in the take");
    let options = RefuseOptions {
        build: posefuse_server::BUILD.to_owned(),
        ..RefuseOptions::default()
    };
    let report = refuse(&storage, "t", &options, &mut |_| {}).unwrap();
    assert!(report.identical && report.frames > 40, "{report:?}");
}

fn answers(storage: &dyn Storage, name: &str) -> usize {
    let take = TakeReader::open(storage, name).unwrap();
    let inputs = take.entries(&[Topic::Inputs], None);
    let is_answer = |input: Recorded| match input {
        Recorded::Input(Input::Repaired(answer)) => !answer.fills.is_empty(),
        _ => false,
    };
    inputs
        .filter(|input| is_answer(input.as_ref().unwrap().decode().unwrap()))
        .count()
}

async fn metrics(address: std::net::SocketAddr) -> String {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let mut stream = tokio::net::TcpStream::connect(address).await.unwrap();
    let request = format!("GET /metrics HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut page = String::new();
    stream.read_to_string(&mut page).await.unwrap();
    page
}

#[tokio::test]
async fn a_model_that_cannot_be_used_is_told_and_the_room_goes_on_with_a_simple_one() {
    for (name, says) in [
        ("tiny-gro", "did you mean `tiny-gru`"),
        ("lost", "tried on a standing person"),
        ("tiny-lstm", "for recordings only"),
    ] {
        let server = start_with(with_model(name), memory(), memory()).await;
        let mut room = server.room().await;
        let status = status_when(&mut room, |_| true).await;
        let repair = status.repair.unwrap();
        assert!(repair.trouble.contains(says), "{name}: {}", repair.trouble);
        assert!(
            status.troubles.contains(&repair.trouble),
            "{:?}",
            status.troubles
        );
        assert_eq!(repair.runtime, "");
        server.stop().await;
    }
}

#[tokio::test]
async fn a_network_that_fails_is_counted_and_frames_go_on() {
    let storage: Arc<dyn Storage> = memory();
    let server = start_with(with_model("fragile"), storage, memory()).await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left"]).await;
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    // Some joints of a tracker are never there: older than five seconds from the first frame on.
    for sequence in 0..60 {
        let mut body = person(sequence as f32 * 0.03);
        for joint in HIDDEN {
            body.confidences[joint] = 0.0;
        }
        agent.frame(sequence, vec![body]).await;
        tokio::time::sleep(Duration::from_millis(30)).await;
    }
    let status = status_when(&mut room, |status| {
        status
            .repair
            .as_ref()
            .is_some_and(|repair| repair.failed > 5)
    })
    .await;
    assert!(
        status.people == 1 && status.frames_per_second > 5.0,
        "{status:?}"
    );
    server.stop().await;
}
