//! Joining, frames good and bad, acknowledgements, reconnection.

use std::time::Duration;

use posefuse_proto::v1::{self, SensorState, SetCalibrationRequest};
use posefuse_skeleton::Observation;
use tonic::Code;

use crate::fixture::{
    Agent, assert_refused, calibrated, calibration, hello, person, start, status_when,
};

#[tokio::test]
async fn an_agent_joins_is_acknowledged_and_shown() {
    let server = start().await;
    let mut room = server.room().await;
    let mut agent = server.agent("left").await;
    assert_eq!(
        (agent.welcome.sensor_id, agent.welcome.last_sequence),
        (0, None)
    );
    agent.mapped().await;
    agent.walk(100..130).await;
    agent.acked(129).await;
    let status = status_when(&mut room, |status| {
        status
            .sensors
            .first()
            .is_some_and(|s| s.latency_ms.is_some() && s.frames_per_second > 20.0)
    })
    .await;
    let sensor = &status.sensors[0];
    assert_eq!(sensor.state(), SensorState::Live);
    assert_eq!(
        (sensor.frames_received, sensor.frames_lost, sensor.bodies),
        (30, 0, 1)
    );
    assert!(sensor.latency_ms.unwrap() < 50.0, "{sensor:?}");
    assert!(!sensor.calibrated && sensor.clock_offset_ms.is_some());
    assert_eq!(sensor.info.as_ref().unwrap().name, "left");

    let status = status_when(&mut room, |s| s.sensors[0].state() == SensorState::Stalled).await;
    assert!(status.sensors[0].trouble.contains("no frame for a second"));
    drop(agent);
    let gone =
        |s: &posefuse_proto::v1::RoomStatus| s.sensors[0].state() == SensorState::Disconnected;
    let status = status_when(&mut room, gone).await;
    assert!(status.sensors[0].trouble.contains("agent is gone"));
    server.stop().await;
}

#[tokio::test]
async fn greetings_that_cannot_be_taken_are_refused_with_the_remedy() {
    let server = start().await;
    let _left = server.agent("left").await;
    let join = |hello| Agent::join(server.address, hello);
    let refused = |result: Result<Agent, _>, code, says: &[&str]| {
        assert_refused(result.map(|agent| agent.welcome), code, says);
    };
    refused(
        join(hello("left", 2)).await,
        Code::AlreadyExists,
        &["`left`", "another name"],
    );

    let mut odd = hello("right", 1);
    odd.joint_set = "kinect-v3".to_owned();
    refused(
        join(odd).await,
        Code::InvalidArgument,
        &["`kinect-v3`", "kinect-v2", "blaze-pose"],
    );

    refused(
        join(hello("a/b", 1)).await,
        Code::InvalidArgument,
        &["a/b", "letters"],
    );

    let mut newer = hello("right", 1);
    newer.protocol = 2;
    refused(
        join(newer).await,
        Code::FailedPrecondition,
        &["version 1", "same release"],
    );

    let mut chatty = hello("right", 1);
    chatty.model = "x".repeat(1000);
    refused(
        join(chatty).await,
        Code::InvalidArgument,
        &["`model`", "128"],
    );

    // None of them took a place, and the name is free for the next good one.
    let right = server.agent("right").await;
    assert_eq!(right.welcome.sensor_id, 1);
    server.stop().await;
}

#[tokio::test]
async fn a_room_takes_64_sensors_and_says_so_to_the_next() {
    let server = start().await;
    let mut agents = Vec::new();
    for index in 0..64 {
        let agent = server.agent(&format!("cam{index}")).await;
        assert_eq!(agent.welcome.sensor_id, index);
        agents.push(agent);
    }
    let next = Agent::join(server.address, hello("cam64", 1)).await;
    assert_refused(
        next.map(|agent| agent.welcome),
        Code::ResourceExhausted,
        &["64 sensors"],
    );
    // A number belongs to a name, not to a stream.
    drop(agents.remove(5));
    let again = loop {
        match Agent::join(server.address, hello("cam5", 9)).await {
            Ok(agent) => break agent,
            Err(status) => assert_eq!(status.code(), Code::AlreadyExists),
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    };
    assert_eq!(again.welcome.sensor_id, 5);
    server.stop().await;
}

#[tokio::test]
async fn the_same_agent_takes_over_and_sends_again_what_was_not_acknowledged() {
    let server = start().await;
    let mut room = server.room().await;
    let mut first = server.agent("left").await;
    first.walk(10..20).await;
    first.acked(19).await;
    let mut second = server.agent("left").await;
    assert_eq!(second.welcome.last_sequence, Some(19));
    let ended = first.ended.await.unwrap().unwrap_err();
    assert_eq!(ended.code(), Code::Aborted);

    // 15..19 again, then a gap of 5.
    second.walk(15..22).await;
    second.walk(27..30).await;
    second.acked(29).await;
    let status = status_when(&mut room, |s| s.sensors[0].frames_received == 20).await;
    let sensor = &status.sensors[0];
    assert_eq!(sensor.frames_lost, 5);
    assert_eq!(sensor.rejected.get("duplicate"), Some(&5));

    // Another run of the agent counts anew.
    drop(second);
    let third = loop {
        if let Ok(agent) = Agent::join(server.address, hello("left", 2)).await {
            break agent;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    };
    assert_eq!(third.welcome.last_sequence, None);
    server.stop().await;
}

#[tokio::test]
async fn bad_frames_and_joints_are_counted_and_the_rest_is_used() {
    let server = start().await;
    let mut room = server.room().await;
    let request = SetCalibrationRequest {
        calibration: Some(calibration(&["left"])),
    };
    room.set_calibration(request).await.unwrap();
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    let mut watch = room
        .watch(posefuse_proto::v1::WatchRequest::default())
        .await
        .unwrap()
        .into_inner();
    agent.walk(0..10).await;

    let mut short = person(0.1);
    short.positions.pop();
    agent.frame(10, vec![short]).await;
    let mut doubtful = person(0.11);
    doubtful.confidences[3] = 1.5;
    agent.frame(11, vec![doubtful]).await;
    agent
        .frame(12, vec![person(0.12); Observation::MAX_BODIES + 1])
        .await;
    let mut broken = person(0.13);
    broken.positions[3 * 3] = f32::NAN;
    agent.frame(13, vec![broken]).await;
    agent.acked(13).await;
    let status = status_when(&mut room, |s| {
        s.sensors[0].rejected.get("non-finite") == Some(&2)
    })
    .await;
    let rejected = &status.sensors[0].rejected;
    // One joint for its confidence, one for its position.
    for (reason, count) in [
        ("wrong-length", 1),
        ("too-many-bodies", 1),
        ("non-finite", 2),
    ] {
        assert_eq!(rejected.get(reason), Some(&count), "{reason}: {rejected:?}");
    }
    assert!(
        status.sensors[0]
            .trouble
            .contains(&format!("at most {} bodies", Observation::MAX_BODIES)),
        "{:?}",
        status.sensors[0]
    );

    agent.walk(14..40).await;
    let mut people = 0;
    for _ in 0..12 {
        let frame = watch.message().await.unwrap().unwrap();
        people += frame.tracks.len();
        let finite =
            |track: &posefuse_proto::v1::Track| track.positions.iter().all(|v| v.is_finite());
        assert!(frame.tracks.iter().all(finite));
    }
    assert!(people >= 8, "{people} people in 12 frames");
    server.stop().await;
}

#[tokio::test]
async fn a_number_out_of_reach_is_refused_and_does_not_block_the_stream() {
    let server = start().await;
    let mut room = server.room().await;
    let mut agent = server.agent("left").await;
    agent.walk(0..3).await;
    agent.frame(u64::MAX, vec![person(0.0)]).await;
    agent.walk(3..6).await;
    agent.acked(5).await;
    let status = status_when(&mut room, |s| s.sensors[0].frames_received == 7).await;
    let sensor = &status.sensors[0];
    assert_eq!(sensor.frames_lost, 0);
    assert_eq!(sensor.rejected.get("malformed"), Some(&1));
    assert_eq!(*agent.acked.borrow(), Some(5));
    assert!(sensor.trouble.contains("one by one"), "{sensor:?}");
    server.stop().await;
}

#[tokio::test]
async fn frames_that_come_too_late_are_a_trouble_with_its_share() {
    let server = start().await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left"]).await;
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    for sequence in 0..200 {
        // Caught a second before; one in five as it should be, which holds the room's present.
        let age_ns = if sequence % 5 == 0 { 0 } else { 1_000_000_000 };
        agent
            .frame_aged(sequence, age_ns, vec![person(sequence as f32 * 0.01)])
            .await;
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    let status = status_when(&mut room, |s| !s.sensors[0].trouble.is_empty()).await;
    let sensor = &status.sensors[0];
    assert_eq!(sensor.state(), SensorState::Live);
    assert!(sensor.trouble.contains(" % of its frames "), "{sensor:?}");
    server.stop().await;
}

#[tokio::test]
async fn before_a_calibration_the_room_has_a_trouble_and_the_sensor_no_refusals() {
    let server = start().await;
    let mut room = server.room().await;
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    agent.walk(0..40).await;
    let status = status_when(&mut room, |s| s.sensors[0].frames_received == 40).await;
    assert!(
        status.troubles[0].contains("posefuse calibrate"),
        "{status:?}"
    );
    let shown = |s: &v1::RoomStatus| s.sensors[0].rejected.get("uncalibrated").copied();
    assert_eq!(shown(&status), None, "{:?}", status.sensors[0].rejected);

    // One that a calibration leaves out is told of, and counted from then on.
    calibrated(&mut room, &["right"]).await;
    agent.walk(40..180).await;
    let status = status_when(&mut room, |s| !s.sensors[0].trouble.is_empty()).await;
    assert!(
        status.sensors[0].trouble.contains("does not know it"),
        "{status:?}"
    );
    let refused = status_when(&mut room, |s| shown(s).is_some_and(|count| count > 100)).await;
    assert!(shown(&refused).unwrap() <= 140);
    server.stop().await;
}
