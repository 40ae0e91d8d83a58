//! The uplink over a simulated network and in simulated time: partitions that take a minute pass in milliseconds.
// Helpers of tests are tests too, but clippy takes only what bears #[test] for one.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod support;

use std::sync::Arc;
use std::time::Duration;

use posefuse_agent::{AgentConfig, AgentReport, Connector, Io, Parts, SystemClock, run_with};
use posefuse_proto::v1::ingest_server::IngestServer;
use support::{Act, Script, Service, SharedLog, config, log};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf, duplex, split};
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, sleep};
use tokio_stream::wrappers::ReceiverStream;

const S: Duration = Duration::from_secs(1);
const FRAME: Duration = Duration::from_nanos(33_333_333);

/// What the network does at present.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Weather {
    Fine,
    /// Packets vanish: established connections hang, new ones never come about.
    Silent,
    /// Nobody listens: connections break, new ones are refused.
    Down,
}

/// A network with one server in it.
#[derive(Clone)]
struct Net {
    weather: watch::Sender<Weather>,
    /// When agents tried to connect.
    attempts: Arc<std::sync::Mutex<Vec<Instant>>>,
    to_server: mpsc::Sender<std::io::Result<DuplexStream>>,
}

impl Net {
    fn with_server(log: &SharedLog) -> Self {
        let (to_server, incoming) = mpsc::channel(64);
        let service = Service {
            log: log.clone(),
            clock: Arc::new(SystemClock::new()),
        };
        tokio::spawn(
            tonic::transport::Server::builder()
                .add_service(IngestServer::new(service))
                .serve_with_incoming(ReceiverStream::new(incoming)),
        );
        let weather = watch::Sender::new(Weather::Fine);
        Self {
            weather,
            attempts: Arc::default(),
            to_server,
        }
    }

    fn connector(&self) -> Connector {
        let net = self.clone();
        Arc::new(move |_| {
            net.attempts.lock().unwrap().push(Instant::now());
            Box::pin(net.clone().connect())
        })
    }

    async fn connect(self) -> std::io::Result<Box<dyn Io>> {
        let weather = *self.weather.borrow();
        match weather {
            Weather::Silent => std::future::pending().await,
            Weather::Down => Err(std::io::ErrorKind::ConnectionRefused.into()),
            Weather::Fine => {
                let (agent, agent_side) = duplex(1 << 16);
                let (server_side, server) = duplex(1 << 16);
                tokio::spawn(carry(agent_side, server_side, self.weather.subscribe()));
                self.to_server.send(Ok(server)).await.unwrap();
                Ok(Box::new(agent))
            }
        }
    }

    fn attempts_since(&self, start: Instant) -> Vec<Duration> {
        let attempts = self.attempts.lock().unwrap();
        attempts
            .iter()
            .filter(|at| **at >= start)
            .map(|at| *at - start)
            .collect()
    }
}

/// Carries bytes both ways until the weather breaks the connection.
async fn carry(left: DuplexStream, right: DuplexStream, weather: watch::Receiver<Weather>) {
    let ((left_in, left_out), (right_in, right_out)) = (split(left), split(right));
    let mut watched = weather.clone();
    tokio::select! {
        () = one_way(left_in, right_out, weather.clone()) => {}
        () = one_way(right_in, left_out, weather) => {}
        _ = watched.wait_for(|weather| *weather == Weather::Down) => {}
    }
}

async fn one_way(
    mut from: ReadHalf<DuplexStream>,
    mut to: WriteHalf<DuplexStream>,
    mut weather: watch::Receiver<Weather>,
) {
    let mut bytes = vec![0; 4096];
    while let Ok(count @ 1..) = from.read(&mut bytes).await {
        let through = weather
            .wait_for(|weather| *weather == Weather::Fine)
            .await
            .is_ok();
        if !through || to.write_all(&bytes[..count]).await.is_err() {
            return;
        }
    }
}

fn agent(
    net: &Net,
    config: AgentConfig,
    frames: u64,
    seed: u64,
) -> tokio::task::JoinHandle<AgentReport> {
    let parts = Parts {
        clock: Arc::new(SystemClock::new()),
        connector: net.connector(),
        seed,
        source_thread: false,
    };
    let source = Script::timed([Act::Frames(frames, FRAME)]);
    let running = run_with(source, config, parts, std::future::pending());
    tokio::spawn(async move { running.await.unwrap() })
}

/// An outage of a minute; how long it took to notice, and to resume.
async fn outage(weather: Weather, seed: u64) -> (Duration, Duration) {
    let log = log();
    let net = Net::with_server(&log);
    let frames = 30 * 90;
    let agent = agent(&net, config(([127, 0, 0, 1], 1).into()), frames, seed);
    sleep(10 * S + FRAME.mul_f64(seed as f64 * 0.37)).await;
    let before = log.lock().unwrap().frames.len();
    assert!((298..=310).contains(&before), "{before} frames in 10 s");

    let broke = Instant::now();
    net.weather.send_replace(weather);
    sleep(60 * S).await;
    let attempts = net.attempts_since(broke);
    assert!(attempts[0] < 2 * S, "noticed after {:?}", attempts[0]);

    net.weather.send_replace(Weather::Fine);
    let healed = Instant::now();
    let had = log.lock().unwrap().frames.len();
    while log.lock().unwrap().frames.len() == had {
        sleep(S / 1000).await;
    }
    let resumed = healed.elapsed();
    assert!(resumed < 2 * S, "resumed after {resumed:?}");

    let report = agent.await.unwrap();
    assert_eq!(
        (report.captured, report.dropped, report.unacknowledged),
        (frames, 0, 0)
    );
    assert_eq!(
        log.lock().unwrap().sequences(),
        (0..frames).collect::<Vec<_>>(),
        "each frame once"
    );
    (attempts[0], resumed)
}

async fn outages(weather: Weather) {
    let mut worst = (Duration::ZERO, Duration::ZERO);
    for seed in 0..20 {
        let (noticed, resumed) = outage(weather, seed).await;
        worst = (worst.0.max(noticed), worst.1.max(resumed));
    }
    println!(
        "{weather:?}, 20 times, at worst: noticed after {:?}, resumed after {:?}",
        worst.0, worst.1
    );
}

#[tokio::test(start_paused = true)]
async fn a_minute_of_silence_is_noticed_soon_and_loses_nothing() {
    outages(Weather::Silent).await;
}

#[tokio::test(start_paused = true)]
async fn a_minute_without_a_server_loses_nothing() {
    outages(Weather::Down).await;
}

#[tokio::test(start_paused = true)]
async fn fifty_agents_come_back_soon_and_not_all_at_once() {
    let net = Net::with_server(&log());
    let mut logs = Vec::new();
    let mut agents = Vec::new();
    for seed in 0..50 {
        // A room of its own for each agent, so that the test server need not tell agents apart.
        let log = log();
        let own = Net {
            weather: net.weather.clone(),
            ..Net::with_server(&log)
        };
        agents.push(agent(
            &own,
            config(([127, 0, 0, 1], 1).into()),
            30 * 40,
            seed,
        ));
        logs.push(log);
    }
    sleep(5 * S).await;
    net.weather.send_replace(Weather::Down);
    sleep(20 * S).await;
    net.weather.send_replace(Weather::Fine);
    let healed = Instant::now();
    let mut back = vec![None; logs.len()];
    while back.contains(&None) {
        for (log, back) in logs.iter().zip(&mut back) {
            let connected = log.lock().unwrap().hellos.len() == 2;
            if connected && back.is_none() {
                *back = Some(healed.elapsed());
            }
        }
        sleep(S / 1000).await;
        assert!(
            healed.elapsed() < 10 * S,
            "not all agents are back after 10 s"
        );
    }
    let mut back: Vec<Duration> = back.into_iter().flatten().collect();
    back.sort();
    println!("50 agents back between {:?} and {:?}", back[0], back[49]);
    assert!(back[49] < 2 * S);
    let busiest = back.iter().map(|at| {
        back.iter()
            .filter(|b| **b >= *at && **b < *at + S / 20)
            .count()
    });
    let busiest = busiest.max().unwrap();
    assert!(busiest < 20, "{busiest} agents within 50 ms");
    for agent in agents {
        assert_eq!(agent.await.unwrap().dropped, 0);
    }
}
