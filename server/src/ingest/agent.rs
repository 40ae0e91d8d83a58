//! One agent's stream: frames in, acknowledgements and clock probes out.

use std::sync::Arc;
use std::time::Duration;

use futures_util::FutureExt;
use posefuse_fusion::{ClockSample, Input};
use posefuse_proto::v1::{self, agent_message, server_message};
use posefuse_proto::{WireError, bodies_from_agent};
use posefuse_skeleton::{AgentTime, Observation, Timestamp};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;
use tonic::{Status, Streaming};

use super::depth;
use super::downlink::{Down, Downlink, Probes};
use super::gap::{Gap, gap};
use super::registry::Joined;
use super::{IngestService, Refusal};
use crate::Clock;
use crate::fusion_thread::{Inputs, Pushed};
use crate::sinks::Pace;

/// Messages that may wait to go down. They are few: an acknowledgement or a probe that finds no room is left out.
const DOWN_QUEUE: usize = 16;
/// Longest trouble of an agent that is shown, characters.
const MAX_TROUBLE: usize = 300;
/// Messages taken at once, if they are there.
const BURST: usize = 32;
/// How often acknowledgements and probes are looked after.
const BEAT: Duration = Duration::from_millis(50);
/// The clocks are mapped fast at first ...
const FIRST_PROBES: u32 = 10;
const FIRST_PROBE_NS: i64 = 100_000_000;
/// ... and then kept in step.
const PROBE_NS: i64 = 1_000_000_000;

/// One stream of one agent.
pub(super) struct Agent {
    joined: Joined,
    inputs: Inputs,
    clock: Arc<dyn Clock>,
    /// Cancelled when the server stops; `joined.cancel` follows it.
    stop: CancellationToken,
    down: mpsc::Sender<Down>,
    probes: Probes,
    /// The highest sequence number in our hands, and the highest one acknowledged.
    last: Option<u64>,
    acked: Option<u64>,
    probes_sent: u32,
    next_probe: Timestamp,
    /// Depth previews a second the agent was last asked for.
    previews_hz: f64,
    /// Of the previews that are taken.
    preview_pace: Pace,
}

impl Drop for Agent {
    fn drop(&mut self) {
        self.joined.sensor.greeting().last_sequence = self.last;
    }
}

/// What an agent's stream gives.
type Message = Result<Option<v1::AgentMessage>, Status>;

/// Whether to go on.
enum Next {
    Go,
    End,
}

impl Agent {
    pub(super) fn new(joined: Joined, service: &IngestService) -> (Self, Downlink) {
        let (down, queue) = mpsc::channel(DOWN_QUEUE);
        let probes = Probes::default();
        let clock = service.clock.clone();
        let agent = Self {
            inputs: service.inputs.clone(),
            stop: service.stop.clone(),
            down,
            probes: probes.clone(),
            last: joined.last_sequence,
            acked: joined.last_sequence,
            probes_sent: 0,
            next_probe: clock.now(),
            previews_hz: 0.0,
            preview_pace: Pace::new(depth::MAX_RATE_HZ),
            clock: clock.clone(),
            joined,
        };
        (agent, Downlink::new(queue, probes, clock))
    }

    /// Serves the stream to its end. Whatever ends it, dropping `self` lets go of the name.
    pub(super) async fn attend(mut self, mut up: Streaming<v1::AgentMessage>) {
        let welcome = v1::Welcome {
            sensor_id: self.joined.sensor.id().index() as u32,
            server_version: env!("CARGO_PKG_VERSION").to_owned(),
            last_sequence: self.joined.last_sequence,
        };
        self.send(server_message::Message::Welcome(welcome));
        let cancel = self.joined.cancel.clone();
        let mut cancelled = std::pin::pin!(cancel.cancelled());
        let mut beat = self.clock.sleep(Duration::ZERO);
        loop {
            let next = tokio::select! {
                biased;
                () = cancelled.as_mut() => self.cancelled(),
                () = &mut beat => {
                    beat = self.clock.sleep(BEAT);
                    self.beat()
                }
                message = up.message() => self.take_burst(message, &mut up).await,
            };
            if matches!(next, Next::End) {
                self.acknowledge();
                return;
            }
        }
    }

    /// Takes `message` and those that are there already: what else there is to look after is cheap, but not for
    /// each of a hundred thousand messages a second.
    async fn take_burst(
        &mut self,
        mut message: Message,
        up: &mut Streaming<v1::AgentMessage>,
    ) -> Next {
        for left in (0..BURST).rev() {
            let next = match message {
                Ok(Some(message)) => self.take(message).await,
                Ok(None) => Next::End,
                Err(status) => {
                    tracing::debug!(sensor = %self.joined.sensor.name(), %status, "an agent's stream broke");
                    self.end(status)
                }
            };
            if left == 0 || matches!(next, Next::End) {
                return next;
            }
            match up.message().now_or_never() {
                Some(another) => message = another,
                None => break,
            }
        }
        Next::Go
    }

    fn cancelled(&self) -> Next {
        self.end(if self.stop.is_cancelled() {
            Status::unavailable("the server is stopping")
        } else {
            Status::aborted("another stream of the same agent took over")
        })
    }

    fn end(&self, status: Status) -> Next {
        let _ = self.down.try_send(Down::End(status));
        Next::End
    }

    fn send(&self, message: server_message::Message) -> bool {
        self.down.try_send(Down::Message(message)).is_ok()
    }

    fn beat(&mut self) -> Next {
        self.acknowledge();
        let now = self.clock.now();
        if now >= self.next_probe && self.down.try_send(Down::Probe).is_ok() {
            self.probes_sent += 1;
            let pause = if self.probes_sent < FIRST_PROBES {
                FIRST_PROBE_NS
            } else {
                PROBE_NS
            };
            self.next_probe = now.plus_ns(pause);
        }
        self.ask_for_previews();
        if self.down.is_closed() {
            Next::End
        } else {
            Next::Go
        }
    }

    fn ask_for_previews(&mut self) {
        let max_rate_hz = self.joined.sensor.depth().wanted_hz();
        let wanted = v1::command::Command::Preview(v1::PreviewRequest { max_rate_hz });
        let command = v1::Command {
            command: Some(wanted),
        };
        if max_rate_hz != self.previews_hz && self.send(server_message::Message::Command(command)) {
            self.previews_hz = max_rate_hz;
        }
    }

    /// Hands on a depth preview. One that nobody waits for any more, or that comes too soon, is left out.
    fn preview(&mut self, preview: v1::DepthPreview, now: Timestamp) {
        let sensor = self.joined.sensor.clone();
        if sensor.depth().wanted_hz() == 0.0 || !self.preview_pace.is_due(now) {
            return;
        }
        match depth::checked(&sensor, self.joined.joint_set, preview, now) {
            Ok(preview) => sensor.depth().publish(&preview),
            Err(what) => {
                let what = format!("a depth preview was refused: {what}");
                self.refuse(Refusal::BadPreview, now, what);
            }
        }
    }

    fn acknowledge(&mut self) {
        if let Some(sequence) = self.last.filter(|_| self.last != self.acked)
            && self.send(server_message::Message::Ack(v1::Ack { sequence }))
        {
            self.acked = self.last;
        }
    }

    async fn take(&mut self, message: v1::AgentMessage) -> Next {
        let now = self.clock.now();
        match message.message {
            Some(agent_message::Message::Frame(frame)) => return self.frame(frame, now).await,
            Some(agent_message::Message::ClockEcho(echo)) => self.echo(echo, now),
            Some(agent_message::Message::Health(mut health)) => {
                health.trouble = health.trouble.chars().take(MAX_TROUBLE).collect();
                self.joined.sensor.greeting().health = Some(health);
            }
            Some(agent_message::Message::Preview(preview)) => self.preview(preview, now),
            Some(agent_message::Message::Hello(_)) => {
                return self.end(Status::invalid_argument(
                    "Hello was said already; open a new stream",
                ));
            }
            None => self.refuse(
                Refusal::Malformed,
                now,
                "a message of no known kind".to_owned(),
            ),
        }
        Next::Go
    }

    fn echo(&self, echo: v1::ClockEcho, returned: Timestamp) {
        let Some(sent) = self.probes.answered(echo.probe) else {
            return;
        };
        // One that finds no room is left out: another follows within a second.
        self.inputs.offer(Input::ClockSample(ClockSample {
            sensor: self.joined.sensor.id(),
            sent,
            returned,
            agent_received: AgentTime::from_ns(echo.agent_received_ns),
            agent_sent: AgentTime::from_ns(echo.agent_sent_ns),
        }));
    }

    async fn frame(&mut self, frame: v1::Frame, received: Timestamp) -> Next {
        let sensor = self.joined.sensor.clone();
        sensor.count_received(received);
        let sequence = frame.sequence;
        let lost = match gap(self.last, sequence) {
            Gap::Frames(lost) => lost,
            Gap::Duplicate => {
                sensor.count_refused(Refusal::Duplicate);
                return Next::Go;
            }
            Gap::TooWide => {
                let what = format!(
                    "frame {sequence} was refused: an agent counts its frames one by one, and this number is out of \
                     reach of the last one; start the agent again"
                );
                self.refuse(Refusal::Malformed, received, what);
                return Next::Go;
            }
        };
        let bodies = match bodies_from_agent(sensor.id(), self.joined.joint_set, &frame.bodies) {
            Ok(bodies) => bodies,
            Err(error) => {
                self.refuse(Refusal::from(&error), received, describe(&error, sequence));
                self.settle(sequence, lost);
                return Next::Go;
            }
        };
        let input = Input::Observation(Observation {
            sensor: sensor.id(),
            sequence,
            captured: AgentTime::from_ns(frame.captured_ns),
            received,
            bodies,
        });
        match self.inputs.push(input, self.clock.as_ref()).await {
            Pushed::Queued => {}
            Pushed::Full => {
                let what =
                    "the fusion thread cannot keep up with the sensors of this room".to_owned();
                self.refuse(Refusal::QueueFull, received, what);
            }
            // Nobody has it: it must not be acknowledged.
            Pushed::Stopped => return self.end(Status::unavailable("the server is stopping")),
        }
        self.settle(sequence, lost);
        Next::Go
    }

    /// A frame was used or refused for good: it need not be sent again.
    fn settle(&mut self, sequence: u64, lost: u64) {
        self.last = Some(sequence);
        self.joined.sensor.count_lost(lost);
    }

    fn refuse(&self, refusal: Refusal, now: Timestamp, what: String) {
        let sensor = &self.joined.sensor;
        sensor.count_refused(refusal);
        // The first, second, fourth, eighth ... of a kind: a tracker that is wrong all the time does not flood the log.
        let (name, reason, count) = (sensor.name(), refusal.name(), sensor.refused(refusal));
        if count.is_power_of_two() {
            tracing::warn!(sensor = %name, reason, count, "refused: {what}");
        }
        sensor.greeting().last_refusal = Some((now, what));
    }
}

fn describe(error: &WireError, sequence: u64) -> String {
    format!("frame {sequence} was refused: {error}")
}
