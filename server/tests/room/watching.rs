//! Subscribers: what they get, who is cut, who loses nothing.

use std::time::Duration;

use posefuse_proto::v1::{self, SensorState};
use posefuse_skeleton::Observation;
use tonic::Code;

use crate::fixture::{
    assert_refused, calibrated, config, memory, person, start, start_with, status_when,
};

#[tokio::test]
async fn fused_frames_and_raw_ones_flow() {
    let server = start().await;
    let mut room = server.room().await;
    calibrated(&mut room, &["left", "right"]).await;
    let mut left = server.agent("left").await;
    let mut right = server.agent("right").await;
    left.mapped().await;
    right.mapped().await;
    let mut frames = room
        .watch(v1::WatchRequest::default())
        .await
        .unwrap()
        .into_inner();
    let only_right = v1::WatchSensorsRequest {
        sensors: vec!["right".to_owned()],
        max_rate_hz: 0.0,
    };
    let mut raw = room.watch_sensors(only_right).await.unwrap().into_inner();
    tokio::join!(left.walk(0..60), right.walk(500..560));

    for sequence in 500..560 {
        let seen = raw.message().await.unwrap().unwrap();
        assert_eq!((seen.sensor, seen.sequence), (1, sequence));
        assert_eq!(seen.bodies[0].positions.len(), 75);
    }
    let mut last = None;
    loop {
        let frame = frames.message().await.unwrap().unwrap();
        assert!(
            last.is_none_or(|last| frame.number == last + 1),
            "a frame is missing"
        );
        last = Some(frame.number);
        if let Some(track) = frame.tracks.first().filter(|track| track.sensors == 0b11) {
            // 2.5 m in front of a sensor 1 m up, pelvis 0.1 m below it.
            let [x, _, z] = [track.positions[0], track.positions[1], track.positions[2]];
            assert!((x - 2.5).abs() < 0.05 && (z - 0.9).abs() < 0.05, "{x} {z}");
            break;
        }
    }
    let status = status_when(&mut room, |status| status.people == 1).await;
    assert!(
        status.latency_p99_ms > 0.0 && status.latency_p99_ms < 100.0,
        "{status:?}"
    );
    assert!(status.engine_us > 0.0 && status.frames_per_second > 10.0);
    assert!(
        status
            .sensors
            .iter()
            .all(|sensor| sensor.calibrated && sensor.residual_mm.is_some())
    );
    assert_eq!(status.troubles, Vec::<String>::new());
    server.stop().await;
    let end = loop {
        match frames.message().await {
            Ok(Some(_)) => {}
            Ok(None) => panic!("the stream ended without a word"),
            Err(status) => break status,
        }
    };
    assert_eq!(end.code(), Code::Unavailable);
}

/// Frames enough to fill a connection's own buffers.
const MANY: u64 = 800;

#[tokio::test]
async fn a_subscriber_that_takes_nothing_is_cut_and_another_loses_nothing() {
    let mut config = config();
    config.watch.queue = 8;
    config.watch.cut_after_ms = 300;
    let server = start_with(config, memory(), memory()).await;
    let (mut slow_room, mut room) = (server.room().await, server.room().await);
    let agent = server.agent("left").await;
    let all = v1::WatchSensorsRequest::default;
    let mut slow = slow_room.watch_sensors(all()).await.unwrap().into_inner();
    let mut quick = room.watch_sensors(all()).await.unwrap().into_inner();
    // Large frames, so that the connection's own buffers fill up soon.
    let reader = tokio::spawn(async move {
        let mut next = 0;
        while next < MANY {
            let seen = quick.message().await.unwrap().unwrap();
            assert_eq!(seen.sequence, next);
            next += 1;
        }
        next
    });
    for sequence in 0..MANY {
        let crowd = (0..Observation::MAX_BODIES)
            .map(|i| v1::Body {
                tracking_id: i as u64,
                ..person(sequence as f32 * 0.01 + i as f32)
            })
            .collect();
        agent.frame(sequence, crowd).await;
        tokio::time::sleep(Duration::from_millis(4)).await;
    }
    let read = tokio::time::timeout(Duration::from_secs(10), reader).await;
    assert_eq!(read.unwrap().unwrap(), MANY);

    let mut seen = 0;
    let end = loop {
        match slow.message().await {
            Ok(Some(_)) => seen += 1,
            Ok(None) => panic!("the stream ended without a word"),
            Err(status) => break status,
        }
    };
    assert_eq!(end.code(), Code::ResourceExhausted, "{end:?}");
    assert!(end.message().contains("subscribe again") && seen < MANY);
    let status = status_when(&mut room, |status| status.sinks[1].dropped > 0).await;
    assert_eq!(status.sinks[1].name, "watch-sensors");
    server.stop().await;
}

#[tokio::test]
async fn the_status_comes_at_once_at_each_change_and_every_second() {
    let server = start().await;
    let mut room = server.room().await;
    let request = v1::WatchStatusRequest { max_rate_hz: 20.0 };
    let mut changes = room.watch_status(request).await.unwrap().into_inner();
    let first = changes.message().await.unwrap().unwrap();
    assert!(first.sensors.is_empty());
    let began = std::time::Instant::now();
    let second = changes.message().await.unwrap().unwrap();
    assert!(began.elapsed() < Duration::from_millis(1500) && second.time_ns > first.time_ns);
    let _agent = server.agent("left").await;
    let joined = loop {
        let next = changes.message().await.unwrap().unwrap();
        if let Some(sensor) = next.sensors.first() {
            break sensor.clone();
        }
    };
    assert_ne!(joined.state(), SensorState::Disconnected);
    server.stop().await;
}

#[tokio::test]
async fn a_thinned_out_watch_keeps_its_rate() {
    let server = start().await;
    let mut room = server.room().await;
    let agent = server.agent("left").await;
    let thin = v1::WatchSensorsRequest {
        sensors: Vec::new(),
        max_rate_hz: 10.0,
    };
    let mut raw = room.watch_sensors(thin).await.unwrap().into_inner();
    let began = std::time::Instant::now();
    agent.walk(0..100).await;
    let seconds = began.elapsed().as_secs_f64();
    let mut count = 0;
    while let Ok(Ok(Some(_))) =
        tokio::time::timeout(Duration::from_millis(300), raw.message()).await
    {
        count += 1;
    }
    let expected = 10.0 * seconds;
    assert!(
        (f64::from(count) - expected).abs() <= 3.0,
        "{count} in {seconds} s"
    );
    server.stop().await;
}

#[tokio::test]
async fn subscribers_are_limited_and_one_that_went_frees_its_place_though_nothing_comes() {
    let mut config = config();
    config.watch.max_subscribers = 2;
    let server = start_with(config, memory(), memory()).await;
    let mut room = server.room().await;
    let absent = v1::WatchSensorsRequest {
        sensors: vec!["nobody".to_owned()],
        max_rate_hz: 0.0,
    };
    let raw = room.watch_sensors(absent.clone()).await.unwrap();
    let fused = room.watch(v1::WatchRequest::default()).await.unwrap();
    let third = room.watch_sensors(absent.clone()).await;
    assert_refused(
        third.map(|_| ()),
        Code::ResourceExhausted,
        &["2 subscribers", "max_subscribers"],
    );
    drop((raw, fused));
    let deadline = std::time::Instant::now() + Duration::from_secs(5);
    let mut held = Vec::new();
    while held.len() < 2 {
        match room.watch_sensors(absent.clone()).await {
            Ok(stream) => held.push(stream),
            Err(status) => assert_eq!(status.code(), Code::ResourceExhausted),
        }
        assert!(std::time::Instant::now() < deadline, "no place came free");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    server.stop().await;
}
