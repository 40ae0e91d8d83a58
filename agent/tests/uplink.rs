//! The uplink against a real gRPC server on loopback sockets.
// Helpers of tests are tests too, but clippy takes only what bears #[test] for one.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod support;

use std::future::pending;
use std::time::{Duration, Instant};

use posefuse_agent::{AgentError, BufferLimits, End, Parts, run_with};
use support::{Act, Script, Server, any_port, clock, config, free_address, log, until};
use tonic::Status;

const MS: Duration = Duration::from_millis(1);

fn parts() -> Parts {
    Parts {
        clock: clock(),
        ..Parts::system()
    }
}

#[tokio::test]
async fn an_agent_may_start_before_its_server_and_loses_nothing() {
    let (address, log) = (free_address(), log());
    let source = Script::new([Act::Frames(150, 5 * MS)]);
    let agent = tokio::spawn(run_with(source, config(address), parts(), pending()));
    tokio::time::sleep(400 * MS).await;
    assert!(!agent.is_finished());
    let _server = Server::start(address, &log, &clock());
    let report = agent.await.unwrap().unwrap();
    assert_eq!(report.end, End::SourceEnded);
    assert_eq!(
        (report.captured, report.dropped, report.connections),
        (150, 0, 1)
    );
    let log = log.lock().unwrap();
    assert_eq!(log.sequences(), (0..150).collect::<Vec<_>>());
    let hello = &log.hellos[0];
    assert_eq!(
        (
            hello.sensor.as_str(),
            hello.joint_set.as_str(),
            hello.protocol
        ),
        ("cam", "nite", 1)
    );
    for frame in &log.frames {
        assert_eq!(
            frame.captured_ns as u64, frame.sequence,
            "content and number belong together"
        );
        let body = &frame.bodies[0];
        assert_eq!(
            (
                body.positions.len(),
                body.confidences[3],
                body.confidences[4]
            ),
            (45, 0.0, 1.0)
        );
    }
}

#[tokio::test]
async fn a_killed_and_restarted_server_gets_everything_once_and_soon() {
    let (clock, log) = (clock(), log());
    let server = Server::start(any_port(), &log, &clock);
    let address = server.address;
    let source = Script::new([Act::Frames(800, 5 * MS)]);
    let agent = tokio::spawn(run_with(source, config(address), parts(), pending()));
    until("200 frames came", || {
        log.lock().unwrap().frames.len() >= 200
    })
    .await;
    server.kill();
    tokio::time::sleep(700 * MS).await;
    let had = log.lock().unwrap().frames.len();
    let _server = Server::start(address, &log, &clock);
    let listening = Instant::now();
    until("it resumed", || log.lock().unwrap().frames.len() > had).await;
    let resumed = listening.elapsed();
    println!("resumed {resumed:?} after the server listened again");
    assert!(resumed < 2000 * MS, "{resumed:?}");
    let report = agent.await.unwrap().unwrap();
    assert_eq!(
        (report.captured, report.dropped, report.connections),
        (800, 0, 2)
    );
    let log = log.lock().unwrap();
    assert_eq!(
        log.sequences(),
        (0..800).collect::<Vec<_>>(),
        "nothing lost, nothing twice"
    );
    assert_eq!(log.hellos[0].run_id, log.hellos[1].run_id);
}

#[tokio::test]
async fn a_server_that_forgot_gets_again_what_it_had_not_acknowledged() {
    let (clock, log) = (clock(), log());
    {
        let mut log = log.lock().unwrap();
        (log.forgetful, log.ack_every, log.ack_late) = (true, 50, false);
    }
    let server = Server::start(any_port(), &log, &clock);
    let address = server.address;
    let mut config = config(address);
    config.drain = 500 * MS;
    let source = Script::new([Act::Frames(420, 5 * MS)]);
    let agent = tokio::spawn(run_with(source, config, parts(), pending()));
    until("120 frames came", || {
        log.lock().unwrap().frames.len() >= 120
    })
    .await;
    server.kill();
    let had = log.lock().unwrap().sequences();
    let _server = Server::start(address, &log, &clock);
    let report = agent.await.unwrap().unwrap();
    let acknowledged_later = report.captured - report.unacknowledged;
    let all = log.lock().unwrap().sequences();
    let again = all[had.len()];
    // Acknowledgements went out after 50 and 100 frames; the last may have been lost on its way.
    assert!(again == 100 || again == 50, "resent from {again}");
    assert_eq!(all[had.len()..], (again..420).collect::<Vec<_>>());
    assert!(
        report.unacknowledged > 0 && acknowledged_later >= 400 - 50,
        "{report:?}"
    );
}

#[tokio::test]
async fn what_does_not_fit_into_the_buffer_is_counted_and_told() {
    let (address, log) = (free_address(), log());
    let mut config = config(address);
    config.buffer = BufferLimits {
        frames: 100,
        bytes: 1 << 20,
    };
    let source = Script::new([
        Act::Frames(500, MS / 10),
        Act::Block(2000 * MS),
        Act::Frames(1, MS),
    ]);
    let agent = tokio::spawn(run_with(source, config, parts(), pending()));
    tokio::time::sleep(800 * MS).await;
    let _server = Server::start(address, &log, &clock());
    let report = agent.await.unwrap().unwrap();
    assert_eq!(
        (report.captured, report.dropped, report.unacknowledged),
        (501, 400, 0)
    );
    let log = log.lock().unwrap();
    assert_eq!(log.sequences(), (400..501).collect::<Vec<_>>());
    let told = log.health.last().unwrap();
    assert_eq!(
        (told.frames_dropped, told.connections),
        (Some(400), Some(1))
    );
}

#[tokio::test]
async fn clock_echoes_are_prompt_and_by_the_clock_that_stamps_the_frames() {
    let (clock, log) = (clock(), log());
    let server = Server::start(any_port(), &log, &clock);
    let mut source = Script::new([Act::Frames(3000, MS / 2), Act::Block(1000 * MS)]);
    const AHEAD_NS: i64 = 5_000_000_000;
    source.offset_ns = AHEAD_NS;
    let parts = Parts {
        clock: clock.clone(),
        ..Parts::system()
    };
    let report = run_with(source, config(server.address), parts, pending())
        .await
        .unwrap();
    assert_eq!(report.delivered, 3000);
    let log = log.lock().unwrap();
    assert!(log.echoes.len() > 50, "{} echoes", log.echoes.len());
    let mut held_ns = Vec::new();
    for echo in &log.echoes {
        // Agent and server read one and the same clock here, so the order of events is exact.
        let (received, sent) = (
            echo.agent_received_ns - AHEAD_NS,
            echo.agent_sent_ns - AHEAD_NS,
        );
        assert!(
            echo.sent_ns <= received && received <= sent && sent <= echo.returned_ns,
            "{echo:?}"
        );
        held_ns.push(echo.returned_ns - echo.sent_ns);
    }
    held_ns.sort_unstable();
    let quick = held_ns[held_ns.len() / 10];
    println!(
        "round trips: best {} us, 10 % {} us, median {} us",
        held_ns[0] / 1000,
        quick / 1000,
        held_ns[held_ns.len() / 2] / 1000
    );
    assert!(
        quick < 5_000_000,
        "a tenth of the echoes should take less than 5 ms, not {quick} ns"
    );
}

#[tokio::test]
async fn a_name_in_use_is_retried_and_said() {
    let log = log();
    let server = Server::start(any_port(), &log, &clock());
    log.lock().unwrap().refusals = vec![Status::already_exists("held by run 7"); 3];
    let source = Script::new([Act::Frames(10, MS)]);
    let report = run_with(source, config(server.address), parts(), pending())
        .await
        .unwrap();
    assert_eq!(
        (report.delivered, report.connections, report.trouble),
        (10, 1, None)
    );
    assert_eq!(log.lock().unwrap().hellos.len(), 4);

    log.lock().unwrap().refusals = vec![Status::already_exists("held by run 7"); 1000];
    let source = Script::new([Act::Frames(1000, 10 * MS)]);
    let stop = tokio::time::sleep(500 * MS);
    let report = run_with(source, config(server.address), parts(), stop)
        .await
        .unwrap();
    let trouble = report.trouble.unwrap();
    assert_eq!(report.end, End::ShutDown);
    assert!(
        trouble.contains("another agent is called `cam`") && trouble.contains("held by run 7"),
        "{trouble}"
    );
}

#[tokio::test]
async fn what_can_never_work_ends_the_agent_with_the_servers_words() {
    let log = log();
    let server = Server::start(any_port(), &log, &clock());
    let refusals = [
        (
            Status::invalid_argument("unknown joint set `x`"),
            "unknown joint set `x`",
        ),
        (
            Status::failed_precondition("protocol 1, this server speaks 2"),
            "matching versions",
        ),
    ];
    for (status, expected) in refusals {
        log.lock().unwrap().refusals = vec![status];
        let source = Script::new([Act::Frames(1000, 10 * MS)]);
        let error = run_with(source, config(server.address), parts(), pending())
            .await
            .unwrap_err();
        assert!(matches!(error, AgentError::Refused { .. }), "{error:?}");
        assert!(
            error.to_string().contains(expected) && error.to_string().contains("`cam`"),
            "{error}"
        );
    }
}

#[tokio::test]
async fn the_server_can_stop_an_agent() {
    let log = log();
    log.lock().unwrap().stop_after = Some(20);
    let server = Server::start(any_port(), &log, &clock());
    let source = Script::new([Act::Frames(10_000, MS)]);
    let report = run_with(source, config(server.address), parts(), pending())
        .await
        .unwrap();
    assert_eq!(report.end, End::Stopped("the room closes".into()));
}

#[tokio::test]
async fn a_shut_down_agent_delivers_its_last_frames_and_ends_at_once_without_a_server() {
    let log = log();
    let server = Server::start(any_port(), &log, &clock());
    log.lock().unwrap().ack_every = 1;
    let source = Script::new([Act::Frames(10_000, MS)]);
    let stop = tokio::time::sleep(500 * MS);
    let report = run_with(source, config(server.address), parts(), stop)
        .await
        .unwrap();
    assert_eq!((report.end, report.unacknowledged), (End::ShutDown, 0));
    assert_eq!(log.lock().unwrap().frames.len() as u64, report.captured);

    let source = Script::new([Act::Frames(10_000, MS)]);
    let began = Instant::now();
    let stop = tokio::time::sleep(100 * MS);
    let report = run_with(source, config(free_address()), parts(), stop)
        .await
        .unwrap();
    assert!(began.elapsed() < 800 * MS, "{:?}", began.elapsed());
    assert!(report.trouble.unwrap().to_lowercase().contains("refused"));
}

#[tokio::test]
async fn a_sensor_in_trouble_is_told_and_a_hung_driver_stalls_nothing() {
    let (clock, log) = (clock(), log());
    let server = Server::start(any_port(), &log, &clock);
    let acts = [
        Act::Frames(5, MS),
        Act::Trouble("unplugged"),
        Act::Trouble("still unplugged"),
        Act::Frames(5, MS),
        Act::Block(2500 * MS),
        Act::Frames(5, MS),
    ];
    let report = run_with(
        Script::new(acts),
        config(server.address),
        parts(),
        pending(),
    )
    .await
    .unwrap();
    assert_eq!((report.delivered, report.connections), (15, 1));
    let log = log.lock().unwrap();
    let troubles: Vec<&str> = log
        .health
        .iter()
        .map(|health| health.trouble.as_str())
        .collect();
    assert!(
        troubles
            .iter()
            .any(|trouble| trouble.ends_with("unplugged")),
        "{troubles:?}"
    );
    assert!(
        troubles
            .iter()
            .any(|trouble| trouble.contains("no frame for")),
        "{troubles:?}"
    );
    assert!(
        log.echoes.len() > 100,
        "the driver hung for 2.5 s, yet {} echoes",
        log.echoes.len()
    );
}

#[tokio::test]
async fn a_source_that_fails_for_good_ends_the_agent_with_its_reason() {
    let log = log();
    let server = Server::start(any_port(), &log, &clock());
    let source = Script::new([Act::Frames(7, MS), Act::Fail("no such device")]);
    let error = run_with(source, config(server.address), parts(), pending())
        .await
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "the source of sensor `cam` failed: no such device"
    );
    assert_eq!(
        log.lock().unwrap().frames.len(),
        7,
        "what came before is delivered"
    );
}
