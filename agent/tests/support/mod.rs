//! A small Ingest server that keeps account of everything, and scripted sensors.
#![allow(dead_code)]

use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use posefuse_agent::{
    AgentConfig, Clock, Description, SensorSource, SourceBody, SourceConfig, SourceError,
    SourceFrame, SystemClock, source::SensorClock,
};
use posefuse_proto::v1::agent_message::Message as Up;
use posefuse_proto::v1::ingest_server::{Ingest, IngestServer};
use posefuse_proto::v1::server_message::Message as Down;
use posefuse_proto::v1::{self, AgentMessage, ServerMessage};
use posefuse_skeleton::{AgentTime, Confidence, JointSet, Position, RawJoint};
use tokio::sync::mpsc;
use tokio_stream::wrappers::{ReceiverStream, TcpListenerStream};
use tokio_stream::{Stream, StreamExt};
use tonic::{Request, Response, Status, Streaming};

/// One answered probe: the server's clock at sending and return, and what the agent said.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Echo {
    pub(crate) sent_ns: i64,
    pub(crate) returned_ns: i64,
    pub(crate) agent_received_ns: i64,
    pub(crate) agent_sent_ns: i64,
}

/// What a server has seen, over all its lives.
#[derive(Default)]
pub(crate) struct Log {
    pub(crate) hellos: Vec<v1::Hello>,
    pub(crate) frames: Vec<v1::Frame>,
    /// When each frame came, by the server's clock.
    pub(crate) arrivals_ns: Vec<i64>,
    pub(crate) echoes: Vec<Echo>,
    pub(crate) health: Vec<v1::Health>,
    /// What the next greetings get instead of a welcome.
    pub(crate) refusals: Vec<Status>,
    /// Whether Welcome says what is already there.
    pub(crate) forgetful: bool,
    /// Acknowledge after each this many frames; 0 never.
    pub(crate) ack_every: usize,
    /// Acknowledge the rest whenever a probe goes out.
    pub(crate) ack_late: bool,
    /// Tell the agent to stop after this many frames.
    pub(crate) stop_after: Option<usize>,
    /// After so many frames ask for so many previews a second.
    pub(crate) preview_wishes: Vec<(usize, f64)>,
    /// The previews that came, and when, by the server's clock.
    pub(crate) previews: Vec<(i64, v1::DepthPreview)>,
}

impl Log {
    pub(crate) fn sequences(&self) -> Vec<u64> {
        self.frames.iter().map(|frame| frame.sequence).collect()
    }
}

pub(crate) type SharedLog = Arc<Mutex<Log>>;

pub(crate) fn log() -> SharedLog {
    Arc::new(Mutex::new(Log {
        ack_every: 5,
        ack_late: true,
        ..Log::default()
    }))
}

#[derive(Clone)]
pub(crate) struct Service {
    pub(crate) log: SharedLog,
    pub(crate) clock: Arc<dyn Clock>,
}

#[tonic::async_trait]
impl Ingest for Service {
    type StreamStream = Pin<Box<dyn Stream<Item = Result<ServerMessage, Status>> + Send>>;

    async fn stream(
        &self,
        request: Request<Streaming<AgentMessage>>,
    ) -> Result<Response<Self::StreamStream>, Status> {
        let mut inbound = request.into_inner();
        let hello = match inbound.message().await?.and_then(|message| message.message) {
            Some(Up::Hello(hello)) => hello,
            other => {
                return Err(Status::invalid_argument(format!(
                    "expected Hello, found {other:?}"
                )));
            }
        };
        let last = {
            let mut log = self.log.lock().unwrap();
            log.hellos.push(hello);
            if !log.refusals.is_empty() {
                return Err(log.refusals.remove(0));
            }
            let last = log.frames.iter().map(|frame| frame.sequence).max();
            last.filter(|_| !log.forgetful)
        };
        let (down, messages) = mpsc::channel(64);
        let welcome = v1::Welcome {
            sensor_id: 0,
            server_version: "test".into(),
            last_sequence: last,
        };
        let _ = down.send(Ok(say(Down::Welcome(welcome)))).await;
        tokio::spawn(serve(self.clone(), inbound, down));
        Ok(Response::new(Box::pin(ReceiverStream::new(messages))))
    }
}

fn say(message: Down) -> ServerMessage {
    ServerMessage {
        message: Some(message),
    }
}

async fn serve(
    service: Service,
    mut inbound: Streaming<AgentMessage>,
    down: mpsc::Sender<Result<ServerMessage, Status>>,
) {
    let mut probe_sent_ns = Vec::new();
    let mut probes = tokio::time::interval(Duration::from_millis(20));
    loop {
        tokio::select! {
            message = inbound.next() => {
                let Some(Ok(message)) = message else { return };
                let returned_ns = service.clock.monotonic_ns();
                let answers = hear(&service.log, message, returned_ns, &probe_sent_ns);
                for answer in answers {
                    if down.send(Ok(say(answer))).await.is_err() {
                        return;
                    }
                }
            }
            _ = probes.tick() => {
                let probe = v1::ClockProbe { probe: probe_sent_ns.len() as u64 };
                let late = {
                    let log = service.log.lock().unwrap();
                    log.frames.last().filter(|_| log.ack_late).map(|frame| frame.sequence)
                };
                if let Some(sequence) = late {
                    let _ = down.send(Ok(say(Down::Ack(v1::Ack { sequence })))).await;
                }
                probe_sent_ns.push(service.clock.monotonic_ns());
                if down.send(Ok(say(Down::ClockProbe(probe)))).await.is_err() {
                    return;
                }
            }
        }
    }
}

fn hear(log: &SharedLog, message: AgentMessage, returned_ns: i64, sent: &[i64]) -> Vec<Down> {
    let mut log = log.lock().unwrap();
    let mut answers = Vec::new();
    match message.message.expect("an empty message") {
        Up::Hello(_) => panic!("a second Hello on one stream"),
        Up::Frame(frame) => {
            let sequence = frame.sequence;
            log.frames.push(frame);
            log.arrivals_ns.push(returned_ns);
            if log.ack_every > 0 && log.frames.len().is_multiple_of(log.ack_every) {
                answers.push(Down::Ack(v1::Ack { sequence }));
            }
            let came = log.frames.len();
            let wishes = log
                .preview_wishes
                .iter()
                .filter(|(after, _)| *after == came);
            answers.extend(wishes.map(|(_, max_rate_hz)| {
                let wish = v1::PreviewRequest {
                    max_rate_hz: *max_rate_hz,
                };
                Down::Command(v1::Command {
                    command: Some(v1::command::Command::Preview(wish)),
                })
            }));
            if log.stop_after == Some(log.frames.len()) {
                let command = v1::command::Command::Stop("the room closes".into());
                answers.push(Down::Command(v1::Command {
                    command: Some(command),
                }));
            }
        }
        Up::ClockEcho(echo) => log.echoes.push(Echo {
            sent_ns: sent[echo.probe as usize],
            returned_ns,
            agent_received_ns: echo.agent_received_ns,
            agent_sent_ns: echo.agent_sent_ns,
        }),
        Up::Health(health) => log.health.push(health),
        Up::Preview(preview) => log.previews.push((returned_ns, preview)),
    }
    answers
}

/// A server on a thread and runtime of its own, so that it can be killed with all its connections.
pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    stop: Option<tokio::sync::oneshot::Sender<()>>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Server {
    /// Listens on `address` (port 0: any).
    pub(crate) fn start(address: SocketAddr, log: &SharedLog, clock: &Arc<dyn Clock>) -> Self {
        let service = IngestServer::new(Service {
            log: log.clone(),
            clock: clock.clone(),
        });
        let (stop, stopped) = tokio::sync::oneshot::channel();
        let (bound, listening) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread()
                .enable_all()
                .build()
                .unwrap();
            runtime.block_on(async {
                let listener = tokio::net::TcpListener::bind(address).await.unwrap();
                bound.send(listener.local_addr().unwrap()).unwrap();
                let serving = tonic::transport::Server::builder()
                    .tcp_nodelay(true)
                    .add_service(service)
                    .serve_with_incoming(TcpListenerStream::new(listener));
                tokio::select! {
                    result = serving => result.unwrap(),
                    _ = stopped => {}
                }
            });
        });
        let address = listening.recv().unwrap();
        Self {
            address,
            stop: Some(stop),
            thread: Some(thread),
        }
    }

    /// Ends it like a kill: no goodbye, all its sockets closed.
    pub(crate) fn kill(self) {}
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

pub(crate) fn any_port() -> SocketAddr {
    ([127, 0, 0, 1], 0).into()
}

/// An address where nobody listens at present.
pub(crate) fn free_address() -> SocketAddr {
    std::net::TcpListener::bind(any_port())
        .unwrap()
        .local_addr()
        .unwrap()
}

pub(crate) fn clock() -> Arc<dyn Clock> {
    Arc::new(SystemClock::new())
}

/// What a scripted sensor does next.
#[derive(Clone, Debug)]
pub(crate) enum Act {
    /// So many frames, one each this long.
    Frames(u64, Duration),
    /// Fails recoverably once.
    Trouble(&'static str),
    /// Fails for good.
    Fail(&'static str),
    /// Blocks like a hung driver.
    Block(Duration),
}

/// A sensor that follows a script in real time, blocking; or, for simulated time, by due times.
pub(crate) struct Script {
    acts: std::vec::IntoIter<Act>,
    present: Option<(u64, Duration)>,
    count: i64,
    due_ns: Option<i64>,
    pub(crate) offset_ns: i64,
}

impl Script {
    pub(crate) fn new(acts: impl Into<Vec<Act>>) -> Box<Self> {
        let acts = acts.into().into_iter();
        Box::new(Self {
            acts,
            present: None,
            count: 0,
            due_ns: None,
            offset_ns: 0,
        })
    }

    /// Does not block but says when frames are due, from monotonic time 0 on.
    pub(crate) fn timed(acts: impl Into<Vec<Act>>) -> Box<Self> {
        Box::new(Self {
            due_ns: Some(0),
            ..*Self::new(acts)
        })
    }
}

impl SensorSource for Script {
    fn description(&self) -> Description {
        Description {
            model: "script".into(),
            joint_set: JointSet::Nite,
            camera: None,
        }
    }

    fn clock(&self) -> SensorClock {
        let offset_ns = self.offset_ns;
        Arc::new(move |monotonic_ns| AgentTime::from_ns(monotonic_ns + offset_ns))
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        loop {
            if let Some((left @ 1.., period)) = self.present {
                self.present = Some((left - 1, period));
                match &mut self.due_ns {
                    Some(due_ns) => *due_ns += period.as_nanos() as i64,
                    None => std::thread::sleep(period),
                }
                return Ok(Some(self.frame()));
            }
            match self.acts.next() {
                None => return Ok(None),
                Some(Act::Frames(count, period)) => self.present = Some((count, period)),
                Some(Act::Trouble(why)) => return Err(SourceError::Trouble(why.into())),
                Some(Act::Fail(why)) => return Err(SourceError::Final(why.into())),
                Some(Act::Block(pause)) => std::thread::sleep(pause),
            }
        }
    }
}

impl Script {
    /// Frame `n` is captured at `n`, so that content and sequence number can be compared.
    fn frame(&mut self) -> SourceFrame {
        let number = self.count;
        self.count += 1;
        let joint = |index: usize| {
            let position = Position::new(index as f64, number as f64, 2.0);
            (index != 3).then_some(RawJoint {
                position,
                confidence: Confidence::FULL,
            })
        };
        SourceFrame {
            captured: AgentTime::from_ns(number),
            due_ns: self.due_ns,
            bodies: vec![SourceBody {
                tracking_id: 9,
                joints: (0..JointSet::Nite.joint_count()).map(joint).collect(),
                orientations: Vec::new(),
                hands_closed: [None; 2],
            }],
        }
    }
}

/// An agent called `cam` for the server at `address`. Its configured source is never opened.
pub(crate) fn config(address: SocketAddr) -> AgentConfig {
    let unused = SourceConfig::Csv(posefuse_agent::source::CsvConfig::new("unused", "1"));
    let server = posefuse_agent::parse_server(&address.to_string()).unwrap();
    AgentConfig::new(server, "cam", unused)
}

/// Waits until `holds`, for at most 10 s.
pub(crate) async fn until(what: &str, mut holds: impl FnMut() -> bool) {
    for _ in 0..2000 {
        if holds() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("waited 10 s in vain until {what}");
}
