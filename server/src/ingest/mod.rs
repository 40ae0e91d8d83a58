//! Agents' streams: greeting, frames, clock probes, health.
//!
//! A frame is validated once, here, and becomes an [`Input::Observation`](posefuse_fusion::Input) in the one bounded
//! queue to the fusion thread. When that queue is full a stream waits up to `max_wait_ms` for room (its agent is
//! held back by TCP and buffers); after that the frame is dropped and counted as `queue-full`.

mod agent;
mod depth;
mod downlink;
mod gap;
mod registry;
mod sensor;

use std::sync::Arc;
use std::time::Duration;

use futures_util::future::FutureExt;
use posefuse_proto::v1;
use serde::{Deserialize, Serialize};
use tonic::{Request, Response, Status, Streaming};

pub(crate) use depth::watch as watch_depth;
pub(crate) use registry::Registry;
pub(crate) use sensor::{Refusal, Sensor};

use crate::Clock;
use crate::fusion_thread::Inputs;
use crate::net::Peer;
use agent::Agent;
use downlink::Downlink;

/// How long an agent may take to say hello.
const HELLO_TIMEOUT: Duration = Duration::from_secs(4);

/// Limits of agents. Section `[ingest]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Frames and clock samples that may wait for the fusion thread.
    pub queue: usize,
    /// How long a stream waits for room in that queue before it drops a frame, milliseconds.
    pub max_wait_ms: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            queue: 1024,
            max_wait_ms: 250,
        }
    }
}

/// The service `posefuse.v1.Ingest`.
#[derive(Clone)]
pub(crate) struct IngestService {
    pub(crate) registry: Arc<Registry>,
    pub(crate) inputs: Inputs,
    pub(crate) clock: Arc<dyn Clock>,
    pub(crate) tasks: tokio_util::task::TaskTracker,
    pub(crate) stop: tokio_util::sync::CancellationToken,
}

#[tonic::async_trait]
impl v1::ingest_server::Ingest for IngestService {
    type StreamStream = Downlink;

    async fn stream(
        &self,
        request: Request<Streaming<v1::AgentMessage>>,
    ) -> Result<Response<Downlink>, Status> {
        let peer = request.extensions().get::<Peer>();
        let peer = peer.map_or_else(String::new, |Peer(address)| address.to_string());
        let mut up = request.into_inner();
        let hello = tokio::select! {
            hello = first_message(&mut up) => hello?,
            () = self.clock.sleep(HELLO_TIMEOUT) => {
                return Err(Status::deadline_exceeded("the first message must be Hello, none came"));
            }
        };
        if self.stop.is_cancelled() {
            return Err(Status::unavailable("the server is stopping"));
        }
        let joined = self
            .registry
            .join(&hello, &self.inputs, self.clock.as_ref(), &self.stop)
            .await
            .inspect_err(|status| {
                tracing::warn!(peer, "an agent was refused: {}", status.message())
            })?;
        tracing::info!(
            sensor = %joined.sensor.name(), id = %joined.sensor.id(), peer,
            model = %hello.model, joint_set = %hello.joint_set, "an agent joined"
        );
        let (agent, downlink) = Agent::new(joined, self);
        // The task ends when the agent goes, another stream takes over, or the server stops.
        self.tasks.spawn(agent.attend(up).map(|()| ()));
        Ok(Response::new(downlink))
    }
}

async fn first_message(up: &mut Streaming<v1::AgentMessage>) -> Result<v1::Hello, Status> {
    match up.message().await?.and_then(|message| message.message) {
        Some(v1::agent_message::Message::Hello(hello)) => Ok(hello),
        _ => Err(Status::invalid_argument("the first message must be Hello")),
    }
}
