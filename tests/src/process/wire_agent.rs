//! An agent of a few lines that sends whatever a test wants, straight over the wire.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use posefuse_proto::v1::agent_message::Message as Up;
use posefuse_proto::v1::ingest_client::IngestClient;
use posefuse_proto::v1::server_message::Message as Down;
use posefuse_proto::{PROTOCOL, v1};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;
use tonic::transport::Channel;

/// The agent's end of a stream. It answers clock probes and counts acknowledgements by itself.
pub struct WireAgent {
    up: mpsc::Sender<v1::AgentMessage>,
    zero: Instant,
    acknowledged: Arc<AtomicU64>,
    /// How the stream ended.
    pub ended: tokio::task::JoinHandle<Status>,
}

impl WireAgent {
    /// Greets the server as a Kinect v2 called `name`.
    pub async fn join(channel: Channel, name: &str) -> Result<Self, Status> {
        let (up, queue) = mpsc::channel(64);
        let hello = v1::Hello {
            sensor: name.to_owned(),
            model: "Kinect v2".to_owned(),
            joint_set: "kinect-v2".to_owned(),
            protocol: PROTOCOL,
            agent_version: "test".to_owned(),
            run_id: 1,
            camera: None,
        };
        let zero = Instant::now();
        let _ = up.send(message(Up::Hello(hello))).await;
        let mut down = IngestClient::new(channel)
            .stream(ReceiverStream::new(queue))
            .await?
            .into_inner();
        let acknowledged = Arc::new(AtomicU64::new(0));
        let (echo, count) = (up.downgrade(), acknowledged.clone());
        let ended = tokio::spawn(async move {
            loop {
                let received = match down.message().await {
                    Ok(Some(received)) => received,
                    Ok(None) => return Status::ok("the stream ended"),
                    Err(status) => return status,
                };
                match received.message {
                    Some(Down::Ack(ack)) => count.store(ack.sequence + 1, Ordering::Relaxed),
                    Some(Down::ClockProbe(probe)) => {
                        let now = zero.elapsed().as_nanos() as i64;
                        let reply = v1::ClockEcho {
                            probe: probe.probe,
                            agent_received_ns: now,
                            agent_sent_ns: now,
                        };
                        if let Some(up) = echo.upgrade() {
                            let _ = up.send(message(Up::ClockEcho(reply))).await;
                        }
                    }
                    _ => {}
                }
            }
        });
        Ok(Self {
            up,
            zero,
            acknowledged,
            ended,
        })
    }

    /// Sends a frame captured now. `false`: the stream has ended.
    pub async fn frame(&self, sequence: u64, bodies: Vec<v1::Body>) -> bool {
        let captured_ns = self.zero.elapsed().as_nanos() as i64;
        let frame = v1::Frame {
            sequence,
            captured_ns,
            bodies,
        };
        self.up.send(message(Up::Frame(frame))).await.is_ok()
    }

    /// How many frames the server has acknowledged.
    pub fn acknowledged(&self) -> u64 {
        self.acknowledged.load(Ordering::Relaxed)
    }
}

fn message(message: Up) -> v1::AgentMessage {
    v1::AgentMessage {
        message: Some(message),
    }
}
