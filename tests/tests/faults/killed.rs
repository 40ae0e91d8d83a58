//! Servers and agents that are killed.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use posefuse_proto::v1::{SensorState, TakeState};
use posefuse_tests::account::sensor;
use posefuse_tests::process::{Follower, Room};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use tokio::time::{Instant, sleep};

/// What a killed server may lose of what it had sent to subscribers, nanoseconds.
const MAY_BE_LOST_NS: i64 = 500_000_000;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_server_loses_at_most_half_a_second_of_its_take() {
    let mut room = Room::new(2).await;
    let _agents = room.agents().await;
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    let mut random = StdRng::seed_from_u64(now.as_nanos() as u64);
    for round in 0..4 {
        let name = format!("killed{round}");
        let follower = Follower::new(&room).await;
        room.start_take(&name).await;
        let pause = Duration::from_millis(random.random_range(700..2500));
        sleep(pause).await;
        room.server.kill();
        let seen = follower.ended().await;
        let last = &seen.last().expect("frames before the kill").frame;

        room.restart_server();
        assert_eq!(
            room.listed(&name).await.state(),
            TakeState::Recovered,
            "killed after {pause:?}"
        );
        let take = room.take(&name);
        let recorded: Vec<_> = take.frames().map(Result::unwrap).collect();
        assert!(
            recorded
                .windows(2)
                .all(|pair| pair[0].number + 1 == pair[1].number),
            "a hole in the take"
        );
        let recorded_until = recorded.last().expect("frames in the take").time.ns();
        let lost_ns = last.time_ns - recorded_until;
        println!(
            "killed after {pause:?}: {} frames recorded, the last {} ms lost",
            recorded.len(),
            lost_ns / 1_000_000
        );
        assert!(
            lost_ns <= MAY_BE_LOST_NS,
            "killed after {pause:?}: {lost_ns} ns of what subscribers saw are missing"
        );
        assert!(
            recorded[0].number <= last.number - recorded.len() as u64 + 20,
            "the take's beginning is missing"
        );

        let back = |status: &posefuse_proto::v1::RoomStatus| {
            let live = status
                .sensors
                .iter()
                .filter(|s| s.state() == SensorState::Live)
                .count();
            live == 2 && status.frames_per_second > 20.0
        };
        room.status_when("agents are back by themselves", back)
            .await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_agent_stops_nobody_and_comes_back_as_itself() {
    let room = Room::new(4).await;
    let mut agents = room.agents().await;
    let id =
        |status: &posefuse_proto::v1::RoomStatus| sensor(status, "cam2").info.as_ref().unwrap().id;
    let before = id(&room.status().await);
    let follower = Follower::new(&room).await;
    room.start_take("killed-agent").await;
    sleep(Duration::from_secs(1)).await;

    agents[1].kill();
    let killed = Instant::now();
    let state = |status: &posefuse_proto::v1::RoomStatus| sensor(status, "cam2").state();
    room.status_when("the sensor is shown as away", |status| {
        state(status) != SensorState::Live
    })
    .await;
    println!("shown as away {:?} after the kill", killed.elapsed());
    assert!(
        killed.elapsed() < Duration::from_millis(1500),
        "shown only after {:?}",
        killed.elapsed()
    );
    sleep(Duration::from_secs(2)).await;
    let frames = follower.since(killed);
    assert!(
        frames.len() >= 45,
        "only {} fused frames in 2 s without one of four sensors",
        frames.len()
    );
    let later = &frames[frames.len() - 20..];
    assert!(later.iter().all(|seen| {
        seen.frame
            .tracks
            .iter()
            .all(|track| track.sensors & (1 << before) == 0)
    }));
    assert!(
        later
            .iter()
            .any(|seen| seen.frame.tracks.iter().any(|track| track.sensors != 0)),
        "nobody is seen any more"
    );

    agents[1] = room.agent(1);
    let status = room
        .status_when("the agent is back", |status| {
            state(status) == SensorState::Live
        })
        .await;
    assert_eq!(id(&status), before, "the sensor has another number");
    assert_eq!(status.sensors.len(), 4);
    let again = Instant::now();
    while !follower.since(again).iter().any(|s| {
        s.frame
            .tracks
            .iter()
            .any(|t| t.sensors & (1 << before) != 0)
    }) {
        assert!(
            again.elapsed() < Duration::from_secs(10),
            "its frames are not used"
        );
        sleep(Duration::from_millis(50)).await;
    }
    follower.complete();
    room.stop_take().await;
    let events: Vec<_> = room
        .take("killed-agent")
        .events()
        .map(Result::unwrap)
        .collect();
    let kinds: Vec<_> = events
        .iter()
        .filter(|event| event.sensor == "cam2")
        .map(|event| event.kind.as_str())
        .collect();
    assert!(
        kinds.contains(&"sensor-disconnected") && kinds.contains(&"sensor-connected"),
        "the take notes only {kinds:?}"
    );
}
