//! Clients that do not behave: stopped subscribers, second agents of one name, silent connections.

use std::io::Read;
use std::net::TcpStream;
use std::time::Duration;

use posefuse_proto::v1::SensorState;
use posefuse_tests::account::sensor;
use posefuse_tests::process::{Follower, Room};
use tokio::time::{Instant, sleep, timeout};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stopped_subscriber_costs_nobody_anything_and_is_cut() {
    let room = Room::new(2).await;
    let _agents = room.agents().await;
    let follower = Follower::new(&room).await;
    let mut stopped = room.program(
        "watch",
        &["watch", "--json", "--rate", "0", "--server", &room.url()],
    );
    stopped.line();
    sleep(Duration::from_secs(2)).await;
    let open = room.metric("connections");
    let (from, before) = (
        Instant::now(),
        follower
            .since(Instant::now() - Duration::from_secs(2))
            .len(),
    );

    stopped.freeze();
    let mut cut = None;
    while from.elapsed() < Duration::from_secs(8) {
        if cut.is_none() && room.metric("connections") < open {
            cut = Some(from.elapsed());
        }
        sleep(Duration::from_millis(100)).await;
    }
    println!("cut after {cut:?}");
    assert!(
        cut.is_some(),
        "the stopped subscriber still has its connection after 8 s"
    );
    let during = follower.since(from).len();
    println!(
        "{before} frames in 2 s before, {during} in {:?} after",
        from.elapsed()
    );
    let rate = during as f64 / from.elapsed().as_secs_f64();
    assert!(
        rate > 0.85 * before as f64 / 2.0,
        "fusion slowed down from {} to {rate} frames/s",
        before as f64 / 2.0
    );
    assert!(
        follower.complete().len() > 200,
        "the healthy subscriber got too few frames"
    );
    stopped.thaw();
    let thawed = Instant::now();
    while stopped.runs() {
        assert!(
            thawed.elapsed() < Duration::from_secs(5),
            "it does not notice that it was cut"
        );
        sleep(Duration::from_millis(50)).await;
    }
    println!("it says: {}", stopped.said().trim());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_agent_of_one_name_is_refused_in_words_and_waits_its_turn() {
    let room = Room::new(2).await;
    let mut first = room.agent_named(0, "twin", "first");
    room.status_when("the first is live", |status| {
        status
            .sensors
            .iter()
            .any(|sensor| sensor.state() == SensorState::Live)
    })
    .await;
    let mut second = room.agent_named(1, "twin", "second");
    let refused = Instant::now();
    while !second.said().contains("another agent is called `twin`") {
        assert!(
            refused.elapsed() < Duration::from_secs(10),
            "the second was not told: {}",
            second.said()
        );
        sleep(Duration::from_millis(50)).await;
    }
    assert!(
        second.said().contains("give this one another name"),
        "no remedy: {}",
        second.said()
    );
    sleep(Duration::from_secs(2)).await;
    assert!(second.runs(), "it gave up");
    let status = room.status().await;
    let twin = sensor(&status, "twin");
    assert_eq!((status.sensors.len(), twin.state()), (1, SensorState::Live));
    assert_eq!(
        (twin.frames_lost, twin.rejected.get("duplicate")),
        (0, None),
        "{twin:#?}"
    );

    assert!(first.end().success(), "{}", first.said());
    let left = Instant::now();
    while !second.said().contains("connected ") {
        assert!(
            left.elapsed() < Duration::from_secs(12),
            "the name is free, but the second is not in: {}",
            second.said()
        );
        sleep(Duration::from_millis(50)).await;
    }
    room.status_when("the second delivers", |status| {
        sensor(status, "twin").state() == SensorState::Live
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_hundred_silent_connections_block_nobody_and_are_closed() {
    let room = Room::new(1).await;
    let opened = Instant::now();
    let silent: Vec<TcpStream> = (0..200)
        .map(|_| TcpStream::connect(room.address()).expect("a connection"))
        .collect();
    // A connection that finds the queue full is tried again by the system after a second.
    let took = opened.elapsed();
    assert!(
        took < Duration::from_millis(900),
        "opening them took {took:?}"
    );
    let asked = Instant::now();
    let status = timeout(Duration::from_secs(3), room.status()).await;
    assert!(status.is_ok(), "a real client was not answered within 3 s");
    println!(
        "answered after {:?} beside {} silent connections",
        asked.elapsed(),
        silent.len()
    );
    let _agents = room.agents().await;

    for mut stream in silent {
        let left = Duration::from_secs(8)
            .saturating_sub(opened.elapsed())
            .max(Duration::from_millis(10));
        stream.set_read_timeout(Some(left)).expect("a socket");
        let read = stream.read(&mut [0; 64]);
        let closed = match &read {
            Ok(0) => true,
            Ok(_) => false,
            Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
        };
        assert!(
            closed,
            "a silent connection is still open after {:?}: {read:?}",
            opened.elapsed()
        );
    }
    println!("all closed after {:?}", opened.elapsed());
}
