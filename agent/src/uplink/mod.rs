//! Keeps a connection to the server, for as long as the agent lives.

mod backoff;
pub(crate) mod buffer;
pub(crate) mod connect;
mod outbound;
mod previews;
mod session;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use posefuse_proto::v1;
use tokio::sync::Notify;
use tokio::time::Instant;
use tonic::transport::Uri;
use tonic::{Code, Status};

use crate::PreviewSlot;
use crate::clock::AgentClock;
use crate::health::SensorHealth;
use backoff::Backoff;
use buffer::ResendBuffer;
use connect::Connector;

/// What the intake of frames and the uplink share.
pub(crate) struct Shared {
    state: Mutex<State>,
    /// A frame came in, or `closing` was set.
    pub(crate) changed: Notify,
}

/// Behind the lock of [`Shared`].
pub(crate) struct State {
    pub(crate) buffer: ResendBuffer,
    pub(crate) sensor: SensorHealth,
    pub(crate) connections: u64,
    pub(crate) connected: bool,
    /// No more frames will come: end as soon as all are acknowledged.
    pub(crate) closing: bool,
    /// Why the server has not taken us in, in words.
    pub(crate) trouble: Option<String>,
}

impl Shared {
    pub(crate) fn new(buffer: ResendBuffer, sensor: SensorHealth) -> Self {
        let state = State {
            buffer,
            sensor,
            connections: 0,
            connected: false,
            closing: false,
            trouble: None,
        };
        Self {
            state: Mutex::new(state),
            changed: Notify::new(),
        }
    }

    /// The shared state. Held for microseconds only, never across an await.
    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How the uplink came to its end by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum UplinkEnd {
    /// Closing, and everything is acknowledged.
    Delivered,
    /// The server told the agent to stop.
    Stopped(String),
    /// The server will never take this agent as it is.
    Refused(String),
}

/// Everything that one connection after the other needs.
pub(crate) struct Uplink {
    pub(crate) server: Uri,
    pub(crate) hello: v1::Hello,
    pub(crate) connector: Connector,
    pub(crate) clock: AgentClock,
    pub(crate) shared: Arc<Shared>,
    pub(crate) seed: u64,
    /// Where the source leaves depth previews, if it has any.
    pub(crate) previews: Option<PreviewSlot>,
}

impl Uplink {
    /// Connects, serves, and connects again, until there is a reason to end.
    pub(crate) async fn run(&self) -> UplinkEnd {
        let mut backoff = Backoff::new(self.seed);
        loop {
            let began = Instant::now();
            let before = self.shared.lock().connections;
            let failure = match self.attempt().await {
                Ok(end) => return end,
                Err(failure) => failure,
            };
            let stood = {
                let mut state = self.shared.lock();
                state.connected = false;
                state.connections > before
            };
            if stood {
                backoff.reset();
            }
            if let Failure::Final(reason) = failure {
                return UplinkEnd::Refused(reason);
            }
            let pause = backoff.next(matches!(failure, Failure::Refused(_)), began.elapsed());
            self.tell(&failure, pause);
            tokio::time::sleep(pause).await;
        }
    }

    async fn attempt(&self) -> Result<UplinkEnd, Failure> {
        let channel = connect::open(&self.server, &self.connector)
            .await
            .map_err(|error| Failure::Lost(format!("cannot reach it: {}", deepest(&error))))?;
        let served = session::serve(self, channel).await;
        // Whoever watched did so over this connection.
        self.ask_for_previews(0.0);
        served.map_err(|status| self.judge(&status))
    }

    fn ask_for_previews(&self, max_rate_hz: f64) {
        if let Some(previews) = &self.previews {
            previews.ask(max_rate_hz);
        }
    }

    fn tell(&self, failure: &Failure, pause: Duration) {
        let (Failure::Lost(reason) | Failure::Refused(reason) | Failure::Final(reason)) = failure;
        let mut state = self.shared.lock();
        // The same sentence over and over would bury everything else.
        if state.trouble.as_ref() != Some(reason) {
            let (server, sensor) = (&self.server, &self.hello.sensor);
            tracing::warn!(%server, sensor, ?pause, "not connected, trying again: {reason}");
            state.trouble = Some(reason.clone());
        }
    }

    fn judge(&self, status: &Status) -> Failure {
        let (name, said) = (&self.hello.sensor, status.message());
        match status.code() {
            Code::AlreadyExists => Failure::Refused(format!(
                "another agent is called `{name}`; stop it or give this one another name ({said})"
            )),
            Code::ResourceExhausted => Failure::Refused(format!("the room is full ({said})")),
            Code::Unimplemented => Failure::Refused(format!(
                "what answers at {} is no Posefuse server; check the address ({said})",
                self.server
            )),
            Code::InvalidArgument => Failure::Final(format!("the server refuses `{name}`: {said}")),
            Code::FailedPrecondition => Failure::Final(format!(
                "the server refuses `{name}`: {said}; agent and server must be of matching versions"
            )),
            _ if said.is_empty() => Failure::Lost("the connection broke".into()),
            _ => Failure::Lost(format!("the connection broke: {said}")),
        }
    }
}

/// Why a connection is over or never began.
#[derive(Debug)]
enum Failure {
    /// No server, or no longer: soon again.
    Lost(String),
    /// The server is there but cannot take us now: again without hurry.
    Refused(String),
    /// Never again.
    Final(String),
}

/// The innermost cause, which is what a person can act on ("connection refused").
fn deepest(error: &dyn std::error::Error) -> String {
    let mut error = error;
    while let Some(source) = error.source() {
        error = source;
    }
    error.to_string()
}
