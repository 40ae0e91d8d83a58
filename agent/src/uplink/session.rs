//! One connection: greeting, frames up, acknowledgements and probes down.
//!
//! One loop serves everything. Nothing in it waits for the network except the loop itself, so that a clock probe is
//! answered at once even while frames are stuck.

use std::time::Duration;

use posefuse_proto::v1;
use posefuse_proto::v1::agent_message::Message as Up;
use posefuse_proto::v1::ingest_client::IngestClient;
use posefuse_proto::v1::server_message::Message as Down;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval, timeout};
use tonic::transport::Channel;
use tonic::{Status, Streaming};

use super::outbound::Outbound;
use super::previews::Previews;
use super::{Uplink, UplinkEnd};

/// How long the server may take to welcome us.
const WELCOME_TIMEOUT: Duration = Duration::from_secs(5);
/// How often health goes up.
const HEALTH_INTERVAL: Duration = Duration::from_secs(1);
/// Echoes and health that may wait for the connection; what does not fit is not said (a late echo is worthless).
const URGENT_QUEUE: usize = 16;
/// Frames that may wait for the connection outside the resend buffer.
const FRAME_QUEUE: usize = 4;
/// How long the server may take to end its half after we ended ours.
const GOODBYE_TIMEOUT: Duration = Duration::from_secs(1);

/// Serves one connection. An error is why it broke; the way it ended otherwise is final.
pub(super) async fn serve(uplink: &Uplink, channel: Channel) -> Result<UplinkEnd, Status> {
    let (urgent, urgent_receiver) = mpsc::channel(URGENT_QUEUE);
    let (frames, frame_receiver) = mpsc::channel(FRAME_QUEUE);
    let outbound = Outbound {
        urgent: urgent_receiver,
        frames: frame_receiver,
        previews: uplink
            .previews
            .clone()
            .map(|slot| Previews::new(slot, uplink.shared.clone())),
        clock: uplink.clock.clone(),
    };
    let said = urgent.try_send(Up::Hello(uplink.hello.clone()));
    said.map_err(|_| Status::internal("the queue for the greeting is full"))?;
    let greeting = greet(uplink, IngestClient::new(channel), outbound);
    let inbound = timeout(WELCOME_TIMEOUT, greeting).await.map_err(|_| {
        Status::deadline_exceeded(format!("no welcome within {} s", WELCOME_TIMEOUT.as_secs()))
    })??;
    Session {
        uplink,
        inbound,
        urgent,
        frames,
    }
    .run()
    .await
}

/// Opens the stream and waits for Welcome.
async fn greet(
    uplink: &Uplink,
    mut client: IngestClient<Channel>,
    outbound: Outbound,
) -> Result<Streaming<v1::ServerMessage>, Status> {
    let mut inbound = client.stream(outbound).await?.into_inner();
    loop {
        let message = inbound.message().await?.and_then(|message| message.message);
        match message {
            Some(Down::Welcome(welcome)) => {
                welcomed(uplink, &welcome);
                return Ok(inbound);
            }
            // A probe before the welcome: there will be more.
            Some(_) => {}
            None => return Err(Status::unavailable("the server hung up before its welcome")),
        }
    }
}

fn welcomed(uplink: &Uplink, welcome: &v1::Welcome) {
    let mut state = uplink.shared.lock();
    state.connections += 1;
    state.connected = true;
    state.trouble = None;
    state.buffer.welcomed(welcome.last_sequence);
    let (waiting, server, sensor) = (state.buffer.len(), &uplink.server, &uplink.hello.sensor);
    let version = &welcome.server_version;
    tracing::info!(%server, sensor, version, waiting, "connected");
}

struct Session<'a> {
    uplink: &'a Uplink,
    inbound: Streaming<v1::ServerMessage>,
    urgent: mpsc::Sender<Up>,
    frames: mpsc::Sender<Up>,
}

impl Session<'_> {
    async fn run(mut self) -> Result<UplinkEnd, Status> {
        let shared = &self.uplink.shared;
        let mut health = interval(HEALTH_INTERVAL);
        health.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let (unsent, delivered) = {
                let state = shared.lock();
                (
                    state.buffer.has_unsent(),
                    state.closing && state.buffer.len() == 0,
                )
            };
            if delivered {
                self.say_goodbye().await;
                return Ok(UplinkEnd::Delivered);
            }
            tokio::select! {
                biased;
                message = self.inbound.message() => match message? {
                    Some(message) => {
                        if let Some(end) = self.hear(message) {
                            return Ok(end);
                        }
                    }
                    None => return Err(Status::unavailable("the server ended the stream")),
                },
                _ = health.tick() => self.report(),
                permit = self.frames.reserve(), if unsent => {
                    let permit = permit.map_err(|_| Status::unavailable("the stream is closed"))?;
                    if let Some(frame) = shared.lock().buffer.send_next() {
                        permit.send(Up::Frame(frame));
                    }
                }
                () = shared.changed.notified(), if !unsent => {}
            }
        }
    }

    fn hear(&self, message: v1::ServerMessage) -> Option<UplinkEnd> {
        match message.message? {
            Down::ClockProbe(probe) => {
                let now_ns = self.uplink.clock.now().ns();
                let echo = v1::ClockEcho {
                    probe: probe.probe,
                    agent_received_ns: now_ns,
                    agent_sent_ns: now_ns,
                };
                let _ = self.urgent.try_send(Up::ClockEcho(echo));
            }
            Down::Ack(ack) => self.uplink.shared.lock().buffer.acknowledge(ack.sequence),
            Down::Command(command) => match command.command? {
                v1::command::Command::Stop(reason) => return Some(UplinkEnd::Stopped(reason)),
                v1::command::Command::Preview(wanted) => {
                    self.uplink.ask_for_previews(wanted.max_rate_hz);
                }
            },
            Down::Welcome(_) => {}
        }
        None
    }

    fn report(&self) {
        let now_ns = self.uplink.clock.base.monotonic_ns();
        let health = {
            let state = self.uplink.shared.lock();
            v1::Health {
                frames_dropped: Some(state.buffer.dropped()),
                frames_buffered: Some(state.buffer.len() as u64),
                connections: Some(state.connections),
                ..state.sensor.report(now_ns)
            }
        };
        let _ = self.urgent.try_send(Up::Health(health));
    }

    /// Ends our half of the stream properly, so that the server sees an end and no break.
    async fn say_goodbye(self) {
        let Self {
            mut inbound,
            urgent,
            frames,
            ..
        } = self;
        drop((urgent, frames));
        let rest = async { while let Ok(Some(_)) = inbound.message().await {} };
        let _ = timeout(GOODBYE_TIMEOUT, rest).await;
    }
}
