//! A whole agent: a source, a buffer, an uplink, from start to end.

use std::sync::Arc;
use std::time::Duration;

use posefuse_proto::{PROTOCOL, v1};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use thiserror::Error;
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep, sleep_until};

use crate::clock::AgentClock;
use crate::health::SensorHealth;
use crate::source::{self, SourceEvent};
use crate::uplink::buffer::ResendBuffer;
use crate::uplink::connect::tcp_connector;
use crate::uplink::{Shared, Uplink, UplinkEnd};
use crate::{
    AgentConfig, Clock, Connector, SensorSource, SourceError, SourceFrame, SystemClock, wire,
};

/// How long a stopped agent goes on to deliver what it has.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// What an agent gets from its surroundings.
#[derive(Clone)]
pub struct Parts {
    /// Its time.
    pub clock: Arc<dyn Clock>,
    /// Its network.
    pub connector: Connector,
    /// Its randomness: the run's identity and the jitter of reconnects. Must differ between agents and starts.
    pub seed: u64,
    /// Whether the source runs on a thread of its own. Only simulated time needs `false`; the source must not block.
    pub source_thread: bool,
}

impl Parts {
    /// The machine's clock and network, and a seed that nobody else has.
    pub fn system() -> Self {
        use std::hash::{BuildHasher, Hasher, RandomState};
        Self {
            clock: Arc::new(SystemClock::new()),
            connector: tcp_connector(),
            // The standard library seeds each `RandomState` from the operating system.
            seed: RandomState::new().build_hasher().finish(),
            source_thread: true,
        }
    }
}

/// Why an agent ended without fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// The source came to its end.
    SourceEnded,
    /// `shutdown` was asked for.
    ShutDown,
    /// The server told the agent to stop, for this reason.
    Stopped(String),
}

/// What an agent has done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AgentReport {
    /// Why it ended.
    pub end: End,
    /// Frames that the source gave.
    pub captured: u64,
    /// Frames that the server has acknowledged.
    pub delivered: u64,
    /// Frames that were dropped because the server was away for too long.
    pub dropped: u64,
    /// Frames that nobody has acknowledged: lost, or in the server's hands without a word of it.
    pub unacknowledged: u64,
    /// Times the agent was connected.
    pub connections: u64,
    /// Why it was not connected at the end, if it was not.
    pub trouble: Option<String>,
}

/// Why an agent cannot go on.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AgentError {
    /// The configuration cannot work.
    #[error("{reason}")]
    Config {
        /// What was expected and found.
        reason: String,
    },
    /// The source failed for good.
    #[error("the source of sensor `{name}` failed: {reason}")]
    Source {
        /// The sensor.
        name: String,
        /// Why.
        reason: String,
    },
    /// The server will never take this agent as it is.
    #[error("{reason}")]
    Refused {
        /// What the server said.
        reason: String,
    },
}

/// Opens the configured source and runs the agent until its source ends, the server stops it or `shutdown` resolves.
///
/// A server that is away or full, or that has another agent of this name, is no error: the agent tries again for ever.
pub async fn run(
    config: AgentConfig,
    parts: Parts,
    shutdown: impl Future<Output = ()>,
) -> Result<AgentReport, AgentError> {
    config.check()?;
    let opened = if parts.source_thread {
        let (source, clock) = (config.source.clone(), parts.clock.clone());
        let opening = tokio::task::spawn_blocking(move || source.open(&clock));
        opening
            .await
            .unwrap_or_else(|error| Err(SourceError::Final(error.to_string())))
    } else {
        config.source.open(&parts.clock)
    };
    let source = opened.map_err(|error| failed_source(&config, error.to_string()))?;
    run_with(source, config, parts, shutdown).await
}

/// Like [`run`], with a source of one's own instead of `config.source`.
pub async fn run_with(
    source: Box<dyn SensorSource>,
    config: AgentConfig,
    parts: Parts,
    shutdown: impl Future<Output = ()>,
) -> Result<AgentReport, AgentError> {
    config.check()?;
    let (description, previews) = (source.description(), source.previews());
    let clock = AgentClock {
        base: parts.clock.clone(),
        sensor: source.clock(),
    };
    let mut random = StdRng::seed_from_u64(parts.seed);
    let shared = Arc::new(Shared::new(
        ResendBuffer::new(config.buffer),
        SensorHealth::new(clock.base.monotonic_ns()),
    ));
    let uplink = Uplink {
        server: config.server.clone(),
        hello: v1::Hello {
            sensor: config.name.clone(),
            model: description.model,
            joint_set: description.joint_set.name().to_owned(),
            protocol: PROTOCOL,
            agent_version: env!("CARGO_PKG_VERSION").to_owned(),
            run_id: random.random(),
            camera: wire::camera(description.camera, previews.is_some()),
        },
        connector: parts.connector.clone(),
        clock: clock.clone(),
        shared: shared.clone(),
        seed: random.random(),
        previews,
    };
    let (events, driver) = drive(source, &config, &parts)?;
    let intake = async { tokio::join!(driver, take_in(events, &shared, clock.base.as_ref())).1 };
    let ended = conduct(&config, &uplink, intake, shutdown).await;
    report(&config, &shared, ended)
}

type Driver = std::pin::Pin<Box<dyn Future<Output = ()> + Send>>;

/// Sets the source going: on a thread, or as a future to be polled beside the rest.
fn drive(
    source: Box<dyn SensorSource>,
    config: &AgentConfig,
    parts: &Parts,
) -> Result<(mpsc::Receiver<SourceEvent>, Driver), AgentError> {
    if parts.source_thread {
        let events = source::on_thread(source, &config.name)
            .map_err(|error| failed_source(config, format!("no thread for it: {error}")))?;
        return Ok((events, Box::pin(std::future::ready(()))));
    }
    let (sender, events) = source::inline_queue();
    Ok((events, Box::pin(source::inline(source, sender))))
}

/// Puts frames into the buffer when they are due, until the source ends. The error is why it failed.
async fn take_in(
    mut events: mpsc::Receiver<SourceEvent>,
    shared: &Shared,
    clock: &dyn Clock,
) -> Result<(), String> {
    while let Some(event) = events.recv().await {
        match event {
            SourceEvent::Frame(frame) => {
                wait_until_due(&frame, clock).await;
                let bodies = frame.bodies.iter().map(wire::body).collect();
                let mut state = shared.lock();
                state.buffer.push(frame.captured.ns(), bodies);
                state.sensor.frame(clock.monotonic_ns());
                drop(state);
                shared.changed.notify_one();
            }
            SourceEvent::Trouble(why) => {
                tracing::warn!("the sensor gives no frames: {why}");
                shared.lock().sensor.trouble(why);
            }
            SourceEvent::Failed(why) => return Err(why),
            SourceEvent::Ended => break,
        }
    }
    Ok(())
}

async fn wait_until_due(frame: &SourceFrame, clock: &dyn Clock) {
    let wait_ns = frame
        .due_ns
        .map_or(0, |due| due.saturating_sub(clock.monotonic_ns()));
    if let Ok(wait_ns @ 1..) = u64::try_from(wait_ns) {
        sleep(Duration::from_nanos(wait_ns)).await;
    }
}

/// How it ended, and the source's failure if that was the cause.
struct Ended {
    end: Result<End, UplinkEnd>,
    source_failure: Option<String>,
}

/// Runs intake and uplink side by side; ends with the uplink, or some time after the source or on `shutdown`.
async fn conduct(
    config: &AgentConfig,
    uplink: &Uplink,
    intake: impl Future<Output = Result<(), String>>,
    shutdown: impl Future<Output = ()>,
) -> Ended {
    let mut ended = Ended {
        end: Ok(End::SourceEnded),
        source_failure: None,
    };
    let mut deadline: Option<Instant> = None;
    let (mut taking_in, mut listening) = (true, true);
    let close = |within: Duration| {
        uplink.shared.lock().closing = true;
        uplink.shared.changed.notify_one();
        Some(Instant::now() + within)
    };
    let sending = uplink.run();
    tokio::pin!(intake, shutdown, sending);
    loop {
        let last_moment = deadline.unwrap_or_else(Instant::now);
        tokio::select! {
            biased;
            () = &mut shutdown, if listening => {
                (listening, taking_in) = (false, false);
                ended.end = Ok(End::ShutDown);
                deadline = close(LAST_WORDS);
                if !uplink.shared.lock().connected {
                    return ended;
                }
            }
            result = &mut intake, if taking_in => {
                taking_in = false;
                ended.source_failure = result.err();
                let failed = ended.source_failure.is_some();
                deadline = close(if failed { LAST_WORDS } else { config.drain });
            }
            end = &mut sending => {
                if end != UplinkEnd::Delivered {
                    ended.end = Err(end);
                }
                return ended;
            }
            () = sleep_until(last_moment), if deadline.is_some() => return ended,
        }
    }
}

fn report(config: &AgentConfig, shared: &Shared, ended: Ended) -> Result<AgentReport, AgentError> {
    if let Some(reason) = ended.source_failure {
        return Err(failed_source(config, reason));
    }
    let end = match ended.end {
        Ok(end) => end,
        Err(UplinkEnd::Stopped(reason)) => End::Stopped(reason),
        Err(UplinkEnd::Refused(reason)) => return Err(AgentError::Refused { reason }),
        Err(UplinkEnd::Delivered) => End::SourceEnded,
    };
    let state = shared.lock();
    Ok(AgentReport {
        end,
        captured: state.buffer.captured(),
        delivered: state.buffer.acknowledged(),
        dropped: state.buffer.dropped(),
        unacknowledged: state.buffer.in_doubt() + state.buffer.len() as u64,
        connections: state.connections,
        trouble: state.trouble.clone(),
    })
}

fn failed_source(config: &AgentConfig, reason: String) -> AgentError {
    AgentError::Source {
        name: config.name.clone(),
        reason,
    }
}
