//! Whole agents of simulated sensors, in real time, against a real gRPC server.
// Helpers of tests are tests too, but clippy takes only what bears #[test] for one.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod support;

use std::time::Duration;

use posefuse_agent::source::SimConfig;
use posefuse_agent::{AgentConfig, End, Parts, SourceConfig, run};
use posefuse_simulator::{Scenario, World};
use support::{Server, any_port, clock, config, log};

#[tokio::test]
async fn two_agents_deliver_one_room_in_real_time() {
    let clock = clock();
    let scenario = Scenario {
        seed: 3,
        ..Scenario::default()
    };
    let world = World::new(&scenario).unwrap();
    let epoch_unix_ns = clock.unix_ns() - 20_000_000_000;
    let epoch_ns = clock.monotonic_ns() - 20_000_000_000;
    let logs = [log(), log()];
    let mut servers = Vec::new();
    let mut agents = Vec::new();
    for (sensor, log) in logs.iter().enumerate() {
        let server = Server::start(any_port(), log, &clock);
        let source = SimConfig {
            scenario: scenario.clone(),
            sensor,
            epoch_unix_ns: Some(epoch_unix_ns),
        };
        let config = AgentConfig {
            source: SourceConfig::Sim(source),
            ..config(server.address)
        };
        // Each agent has a monotonic clock of its own, as a process has.
        let stop = tokio::time::sleep(Duration::from_secs(3));
        agents.push(tokio::spawn(run(config, Parts::system(), stop)));
        servers.push(server);
    }
    for agent in agents {
        let report = agent.await.unwrap().unwrap();
        assert_eq!(
            (report.end, report.dropped, report.unacknowledged),
            (End::ShutDown, 0, 0)
        );
    }
    for (sensor, log) in logs.iter().enumerate() {
        let log = log.lock().unwrap();
        let shows = world.sensor_clock(sensor);
        // How long after its capture, in truth, each frame was with the server; the stamps jitter by 2 ms.
        let mut ways_ms: Vec<f64> = log
            .frames
            .iter()
            .zip(&log.arrivals_ns)
            .map(|(frame, arrived_ns)| {
                (shows.shows(arrived_ns - epoch_ns).ns() - frame.captured_ns) as f64 * 1e-6
            })
            .collect();
        ways_ms.sort_by(f64::total_cmp);
        let (count, median) = (ways_ms.len(), ways_ms[ways_ms.len() / 2]);
        println!(
            "sensor {sensor}: {count} frames, on the way {:.1} / {median:.1} / {:.1} ms (least, median, most)",
            ways_ms[0],
            ways_ms[count - 1]
        );
        assert!((60..=92).contains(&count), "{count} frames in at most 3 s");
        assert!(
            ways_ms[0] > 5.0,
            "a frame arrived before it can have: {} ms",
            ways_ms[0]
        );
        assert!(
            (14.0..80.0).contains(&median),
            "15 ms of simulated delay and a little more, not {median} ms"
        );
        let probes = log.echoes.len();
        assert!(probes > 50, "{probes} probes");
        let wrong = log.echoes.iter().filter(|echo| {
            let between = shows.shows(echo.sent_ns - epoch_ns).ns()
                ..=shows.shows(echo.returned_ns - epoch_ns).ns();
            // The two processes' views of civil time may differ by the time between two clock readings.
            let slack = 2_000_000;
            echo.agent_received_ns < between.start() - slack
                || echo.agent_sent_ns > between.end() + slack
        });
        assert_eq!(
            wrong.count(),
            0,
            "probes are answered by the simulated clock"
        );
    }
}
