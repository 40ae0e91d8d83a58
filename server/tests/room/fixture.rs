//! A server on a port of its own, and a minimal agent.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_proto::v1::ingest_client::IngestClient;
use posefuse_proto::v1::room_client::RoomClient;
use posefuse_proto::v1::{self, agent_message, server_message};
use posefuse_server::{Config, Parts, ServerError, SystemClock, Threads};
use posefuse_session::{MemoryStorage, Storage};
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::JoinHandle;
use tonic::transport::Channel;
use tonic::{Code, Status};

/// Names and counts of the canonical joint set.
pub(crate) const JOINTS: usize = 25;

/// A running server.
pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    stop: oneshot::Sender<()>,
    running: JoinHandle<Result<(), ServerError>>,
}

/// The shipped configuration on any free port, with room for tests' takes.
pub(crate) fn config() -> Config {
    let mut config = Config {
        listen: "127.0.0.1:0".parse().unwrap(),
        ..Config::default()
    };
    config.takes.min_free_mb = 1;
    config
}

pub(crate) async fn start() -> Server {
    start_with(config(), memory(), memory()).await
}

pub(crate) fn memory() -> Arc<dyn Storage> {
    Arc::new(MemoryStorage::new())
}

pub(crate) async fn start_with(
    config: Config,
    takes: Arc<dyn Storage>,
    calibration: Arc<dyn Storage>,
) -> Server {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let parts = Parts {
        listener,
        clock: Arc::new(SystemClock::new()),
        takes,
        calibration,
        threads: Threads::Own,
    };
    serve(config, parts)
}

pub(crate) fn serve(config: Config, parts: Parts<TcpListener>) -> Server {
    let address = parts.listener.local_addr().unwrap();
    let (stop, stopped) = oneshot::channel::<()>();
    let shutdown = async move {
        let _ = stopped.await;
    };
    let running = tokio::spawn(posefuse_server::run(config, parts, shutdown));
    Server {
        address,
        stop,
        running,
    }
}

impl Server {
    pub(crate) async fn room(&self) -> RoomClient<Channel> {
        let channel = Channel::from_shared(format!("http://{}", self.address)).unwrap();
        RoomClient::new(channel.connect().await.unwrap())
    }

    pub(crate) async fn agent(&self, name: &str) -> Agent {
        Agent::join(self.address, hello(name, 1)).await.unwrap()
    }

    /// Stops the server as Ctrl-C would.
    pub(crate) async fn stop(self) {
        let _ = self.stop.send(());
        let ended = tokio::time::timeout(Duration::from_secs(10), self.running).await;
        ended.expect("the server did not stop").unwrap().unwrap();
    }

    /// Ends it without letting anything finish.
    pub(crate) async fn kill(self) {
        self.running.abort();
        let _ = self.running.await;
    }
}

pub(crate) fn hello(name: &str, run_id: u64) -> v1::Hello {
    v1::Hello {
        sensor: name.to_owned(),
        model: "Kinect v2".to_owned(),
        joint_set: "kinect-v2".to_owned(),
        protocol: 1,
        agent_version: "test".to_owned(),
        run_id,
        camera: None,
    }
}

/// An agent that answers clock probes and remembers acknowledgements.
pub(crate) struct Agent {
    up: mpsc::Sender<v1::AgentMessage>,
    zero: Instant,
    pub(crate) welcome: v1::Welcome,
    pub(crate) acked: watch::Receiver<Option<u64>>,
    /// How many of the server's probes were answered.
    pub(crate) probes: watch::Receiver<u32>,
    /// How many depth previews a second the server asks for.
    pub(crate) previews_hz: watch::Receiver<f64>,
    /// How the stream ended.
    pub(crate) ended: JoinHandle<Result<(), Status>>,
}

impl Agent {
    pub(crate) async fn join(address: SocketAddr, hello: v1::Hello) -> Result<Self, Status> {
        let channel = Channel::from_shared(format!("http://{address}")).unwrap();
        let mut client = IngestClient::new(channel.connect().await.unwrap());
        let (up, queue) = mpsc::channel(256);
        let first = agent_message::Message::Hello(hello);
        up.send(message(first)).await.unwrap();
        let sent = tokio_stream::wrappers::ReceiverStream::new(queue);
        let mut down = client.stream(sent).await?.into_inner();
        let Some(server_message::Message::Welcome(welcome)) =
            down.message().await?.and_then(|message| message.message)
        else {
            panic!("the first answer is no Welcome");
        };
        let zero = Instant::now();
        let (ack, acked) = watch::channel(welcome.last_sequence);
        let (probed, probes) = watch::channel(0);
        let (asked, previews_hz) = watch::channel(0.0);
        let echo = up.downgrade();
        let ended = tokio::spawn(async move {
            while let Some(received) = down.message().await? {
                match received.message {
                    Some(server_message::Message::Ack(v1::Ack { sequence })) => {
                        ack.send_replace(Some(sequence));
                    }
                    Some(server_message::Message::ClockProbe(probe)) => {
                        let now = agent_ns(zero);
                        let reply = agent_message::Message::ClockEcho(v1::ClockEcho {
                            probe: probe.probe,
                            agent_received_ns: now,
                            agent_sent_ns: now,
                        });
                        if let Some(up) = echo.upgrade() {
                            let _ = up.send(message(reply)).await;
                        }
                        probed.send_modify(|count| *count += 1);
                    }
                    Some(server_message::Message::Command(v1::Command {
                        command: Some(v1::command::Command::Preview(wanted)),
                    })) => {
                        asked.send_replace(wanted.max_rate_hz);
                    }
                    _ => {}
                }
            }
            Ok(())
        });
        Ok(Self {
            up,
            zero,
            welcome,
            acked,
            probes,
            previews_hz,
            ended,
        })
    }

    pub(crate) async fn frame(&self, sequence: u64, bodies: Vec<v1::Body>) {
        self.frame_aged(sequence, 0, bodies).await;
    }

    /// Sends a frame that was caught so long before.
    pub(crate) async fn frame_aged(&self, sequence: u64, age_ns: i64, bodies: Vec<v1::Body>) {
        let frame = v1::Frame {
            sequence,
            captured_ns: agent_ns(self.zero) - age_ns,
            bodies,
        };
        let frame = agent_message::Message::Frame(frame);
        self.up.send(message(frame)).await.unwrap();
    }

    pub(crate) async fn preview(&self, preview: v1::DepthPreview) {
        let preview = agent_message::Message::Preview(preview);
        self.up.send(message(preview)).await.unwrap();
    }

    /// Waits until the server asks for so many depth previews a second.
    pub(crate) async fn asked(&mut self, hz: f64) {
        let asked = self.previews_hz.wait_for(|asked| *asked == hz);
        tokio::time::timeout(Duration::from_secs(5), asked)
            .await
            .unwrap()
            .unwrap();
    }

    /// Waits until the clocks are mapped.
    pub(crate) async fn mapped(&mut self) {
        let two = self.probes.wait_for(|count| *count >= 2);
        tokio::time::timeout(Duration::from_secs(5), two)
            .await
            .unwrap()
            .unwrap();
    }

    /// Sends a walking person's frames `range` at 100 Hz.
    pub(crate) async fn walk(&self, range: std::ops::Range<u64>) {
        for sequence in range {
            self.frame(sequence, vec![person(sequence as f32 * 0.01)])
                .await;
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }

    pub(crate) async fn acked(&mut self, sequence: u64) {
        let enough = self
            .acked
            .wait_for(|acked| acked.is_some_and(|acked| acked >= sequence));
        tokio::time::timeout(Duration::from_secs(5), enough)
            .await
            .unwrap()
            .unwrap();
    }
}

/// The agent's clock is not the server's: it starts at another time.
fn agent_ns(zero: Instant) -> i64 {
    zero.elapsed().as_nanos() as i64 + 5_000_000_000_000
}

fn message(message: agent_message::Message) -> v1::AgentMessage {
    v1::AgentMessage {
        message: Some(message),
    }
}

/// A standing person 2.5 m in front of the sensor, swaying a little: sensor axes, metres.
pub(crate) fn person(seconds: f32) -> v1::Body {
    #[rustfmt::skip]
    let pose: [[f32; 3]; JOINTS] = [
        [0.0, 0.1, 2.5], [0.0, -0.15, 2.5], [0.0, -0.5, 2.5], [0.0, -0.65, 2.48],
        [-0.18, -0.38, 2.5], [-0.24, -0.1, 2.5], [-0.26, 0.14, 2.47], [-0.27, 0.22, 2.46],
        [0.18, -0.38, 2.5], [0.24, -0.1, 2.5], [0.26, 0.14, 2.47], [0.27, 0.22, 2.46],
        [-0.09, 0.12, 2.48], [-0.1, 0.5, 2.5], [-0.1, 0.88, 2.53], [-0.11, 0.94, 2.42],
        [0.09, 0.12, 2.48], [0.1, 0.5, 2.5], [0.1, 0.88, 2.53], [0.11, 0.94, 2.42],
        [0.0, -0.42, 2.5], [-0.27, 0.29, 2.45], [-0.23, 0.2, 2.43], [0.27, 0.29, 2.45], [0.23, 0.2, 2.43],
    ];
    let sway = 0.2 * (2.0 * seconds).sin();
    v1::Body {
        tracking_id: 7,
        positions: pose
            .iter()
            .flat_map(|[x, y, z]| [x + sway, *y, *z])
            .collect(),
        confidences: vec![1.0; JOINTS],
        orientations: Vec::new(),
        hands_closed: Vec::new(),
    }
}

/// A calibration for these sensors: all at the same place, 1 m up, level, looking along the room's x.
pub(crate) fn calibration(names: &[&str]) -> v1::Calibration {
    let pose = v1::Pose {
        translation: Some(v1::Vector3 {
            x: 0.0,
            y: 0.0,
            z: 1.0,
        }),
        // Sensor z (forward) to room x, sensor x (right) to room -y, sensor y (down) to room -z.
        rotation: Some(v1::Quaternion {
            x: -0.5,
            y: 0.5,
            z: -0.5,
            w: 0.5,
        }),
    };
    v1::Calibration {
        created: "2026-01-01T00:00:00Z".to_owned(),
        method: "test".to_owned(),
        floor: "manual".to_owned(),
        sensors: names
            .iter()
            .map(|name| v1::SensorPose {
                sensor: (*name).to_owned(),
                room_from_sensor: Some(pose),
                ..Default::default()
            })
            .collect(),
        ..Default::default()
    }
}

/// Puts that calibration in force.
pub(crate) async fn calibrated(room: &mut RoomClient<Channel>, names: &[&str]) {
    let request = v1::SetCalibrationRequest {
        calibration: Some(calibration(names)),
    };
    room.set_calibration(request).await.unwrap();
}

/// Asks for the status until `enough` holds; panics with the last one after 5 s.
pub(crate) async fn status_when(
    room: &mut RoomClient<Channel>,
    enough: impl Fn(&v1::RoomStatus) -> bool,
) -> v1::RoomStatus {
    let deadline = Instant::now() + Duration::from_secs(5);
    loop {
        let status = room
            .get_status(v1::GetStatusRequest {})
            .await
            .unwrap()
            .into_inner();
        if enough(&status) {
            return status;
        }
        assert!(Instant::now() < deadline, "never came: {status:#?}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// The refusal must have this code and say each of these.
pub(crate) fn assert_refused<T: std::fmt::Debug>(
    result: Result<T, Status>,
    code: Code,
    says: &[&str],
) {
    let status = result.expect_err("it was not refused");
    assert_eq!(status.code(), code, "{status:?}");
    for part in says {
        assert!(
            status.message().contains(part),
            "`{}` lacks `{part}`",
            status.message()
        );
    }
}
