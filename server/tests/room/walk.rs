//! Walks that end by themselves, and sensors that leave during one.

use std::time::{Duration, Instant};

use posefuse_proto::v1::room_client::RoomClient;
use posefuse_proto::v1::{self, CalibrateRequest, Verdict, calibrate_event};
use tonic::transport::Channel;

use crate::fixture::{Agent, calibrated, person, start};

/// Somebody who walks about in curves, seen alike by every sensor: sensor axes, metres.
fn walker(seconds: f64) -> v1::Body {
    let mut body = person(0.0);
    let right = 1.3 * (0.9 * seconds).sin();
    let ahead = 0.9 * (0.65 * seconds).cos() + 0.5;
    let turn = 1.5 * (0.5 * seconds).sin();
    let (sin, cos) = (turn.sin(), turn.cos());
    for joint in body.positions.chunks_mut(3) {
        let (x, z) = (f64::from(joint[0]), f64::from(joint[2]) - 2.5);
        joint[0] = (cos * x + sin * z + right) as f32;
        joint[2] = (cos * z - sin * x + 2.5 + ahead) as f32;
    }
    body
}

/// Sends the walk at 30 Hz until it is aborted.
fn walking(agent: Agent, begun: Instant) -> tokio::task::JoinHandle<()> {
    tokio::spawn(async move {
        for sequence in 0.. {
            let seconds = begun.elapsed().as_secs_f64();
            agent.frame(sequence, vec![walker(seconds)]).await;
            tokio::time::sleep(Duration::from_millis(33)).await;
        }
    })
}

async fn calibrate(
    room: &mut RoomClient<Channel>,
    seconds: f64,
) -> (Vec<v1::CalibrateProgress>, v1::CalibrateResult) {
    let request = CalibrateRequest {
        seconds,
        dry_run: false,
    };
    let mut events = room.calibrate(request).await.unwrap().into_inner();
    let (mut progress, mut result) = (Vec::new(), None);
    while let Some(event) = events.message().await.unwrap() {
        match event.event.unwrap() {
            calibrate_event::Event::Progress(found) => progress.push(found),
            calibrate_event::Event::Result(found) => result = Some(found),
        }
    }
    (progress, result.expect("no result"))
}

#[tokio::test]
async fn a_walk_ends_when_enough_was_seen_and_a_sensor_that_left_is_told() {
    let server = start().await;
    let mut room = server.room().await;
    let begun = Instant::now();
    let mut walks = Vec::new();
    for name in ["left", "right", "door"] {
        let mut agent = server.agent(name).await;
        agent.mapped().await;
        walks.push(walking(agent, begun));
    }
    let leaving = walks.pop().unwrap();
    let leaves = tokio::spawn(async move {
        tokio::time::sleep(Duration::from_secs(2)).await;
        leaving.abort();
    });
    let (progress, result) = calibrate(&mut room, 0.0).await;
    leaves.await.unwrap();
    walks.iter().for_each(|walk| walk.abort());

    let last = progress.last().unwrap();
    assert!(last.solving && last.share >= 1.0, "{last:?}");
    assert!((12.0..60.0).contains(&last.elapsed_seconds), "{last:?}");
    assert!(progress[..progress.len() - 1].iter().all(|p| !p.solving));
    assert!(progress.iter().any(|p| !p.hint.is_empty() && p.share < 1.0));
    assert_eq!((progress[0].sensors.len(), last.sensors.len()), (3, 2));

    assert_eq!(result.verdict(), Verdict::Weak, "{:?}", result.reasons);
    assert!(
        result
            .reasons
            .iter()
            .any(|reason| reason.contains("`door` left") && reason.contains("agent runs")),
        "{:?}",
        result.reasons
    );
    let calibration = result.calibration.unwrap();
    let names: Vec<_> = calibration.sensors.iter().map(|s| &s.sensor).collect();
    assert_eq!(names, ["left", "right"]);
    assert!(result.in_force);
    assert_eq!(calibration.verdict, "weak");
    assert_eq!(result.sensors.len(), 2);
    assert!(result.pairs[0].before_median_m >= 0.0 && result.pairs[0].weakest);
    server.stop().await;
}

#[tokio::test]
async fn a_walk_that_only_one_sensor_stays_for_fails_and_changes_nothing() {
    let server = start().await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left", "right"]).await;
    let begun = Instant::now();
    let mut walks = Vec::new();
    for name in ["left", "right"] {
        let mut agent = server.agent(name).await;
        agent.mapped().await;
        walks.push(walking(agent, begun));
    }
    let leaving = walks.pop().unwrap();
    tokio::spawn(async move {
        tokio::time::sleep(Duration::from_millis(500)).await;
        leaving.abort();
    });
    let (_, result) = calibrate(&mut room, 6.0).await;
    assert_eq!(result.verdict(), Verdict::Failed);
    assert!(
        result.reasons[0].contains("`right` left"),
        "{:?}",
        result.reasons
    );
    let kept = room.get_calibration(v1::GetCalibrationRequest {}).await;
    assert_eq!(kept.unwrap().into_inner().method, "test");
    walks.iter().for_each(|walk| walk.abort());
    server.stop().await;
}
