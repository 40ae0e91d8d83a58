//! Depth previews beside frames, against a real gRPC server on loopback sockets.
// Helpers of tests are tests too, but clippy takes only what bears #[test] for one.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod support;

use std::future::pending;
use std::sync::Arc;
use std::time::Duration;

use posefuse_agent::{
    Clock, Connector, Description, Io, Parts, PreviewSlot, SensorSource, SourceBody, SourceError,
    SourceFrame, run_with,
};
use posefuse_skeleton::{
    AgentTime, Confidence, DepthImage, Intrinsics, JointSet, Position, RawJoint,
};
use support::{Server, any_port, clock, config, log, until};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

const MS: Duration = Duration::from_millis(1);
const FRAME: Duration = Duration::from_millis(10);

/// A depth sensor with a tracker: 640 x 480 pixels, one body, at 100 Hz; image `n` is `n` millimetres away.
struct Depth {
    clock: Arc<dyn Clock>,
    slot: PreviewSlot,
    left: u16,
    number: u16,
}

impl Depth {
    fn new(clock: &Arc<dyn Clock>, frames: u16) -> Box<Self> {
        Box::new(Self {
            clock: clock.clone(),
            slot: PreviewSlot::new(),
            left: frames,
            number: 0,
        })
    }
}

impl SensorSource for Depth {
    fn description(&self) -> Description {
        Description {
            model: "depth".into(),
            joint_set: JointSet::KinectV2,
            camera: None,
        }
    }

    fn previews(&self) -> Option<PreviewSlot> {
        Some(self.slot.clone())
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        std::thread::sleep(FRAME);
        self.number += 1;
        let joint = RawJoint {
            position: Position::new(0.0, 0.0, 2.0),
            confidence: Confidence::FULL,
        };
        let body = SourceBody {
            tracking_id: 1,
            joints: vec![Some(joint); 25],
            orientations: Vec::new(),
            hands_closed: [None; 2],
        };
        let captured = AgentTime::from_ns(self.clock.monotonic_ns());
        let camera = Intrinsics::from_view(640, 480, 1.0, 0.8);
        let image = DepthImage {
            width: 640,
            height: 480,
            millimetres: vec![self.number; 640 * 480],
        };
        self.slot
            .offer(captured, &camera, &image, std::slice::from_ref(&body));
        Ok(Some(SourceFrame {
            captured,
            due_ns: None,
            bodies: vec![body],
        }))
    }
}

fn parts(clock: &Arc<dyn Clock>) -> Parts {
    Parts {
        clock: clock.clone(),
        ..Parts::system()
    }
}

/// The half of the values that is below it, nanoseconds.
fn median(mut values: Vec<i64>) -> i64 {
    values.sort_unstable();
    values[values.len() / 2]
}

#[tokio::test]
async fn previews_come_while_asked_for_behind_their_frames_and_delay_none() {
    let (clock, log) = (clock(), log());
    log.lock().unwrap().preview_wishes = vec![(150, 10.0), (350, 0.0)];
    let server = Server::start(any_port(), &log, &clock);
    let source = Depth::new(&clock, 500);
    let report = run_with(source, config(server.address), parts(&clock), pending())
        .await
        .unwrap();
    assert_eq!(
        (report.captured, report.delivered, report.dropped),
        (500, 500, 0)
    );
    let log = log.lock().unwrap();
    assert!(log.hellos[0].camera.unwrap().depth_preview);
    assert_eq!(
        log.sequences(),
        (0..500).collect::<Vec<_>>(),
        "none lost, none twice"
    );

    let previews = &log.previews;
    let (first, last) = (log.arrivals_ns[149], log.arrivals_ns[349]);
    // As many as ten a second; the connection may have been busy now and then.
    let most = (last - first) as f64 / 1e9 * 10.0 + 2.0;
    let came = previews.len() as f64;
    assert!(
        (most / 2.0..=most).contains(&came),
        "{came} previews of {most}"
    );
    for (arrived_ns, preview) in previews {
        assert!(*arrived_ns >= first, "before anybody asked");
        assert!(
            *arrived_ns <= last + 200_000_000,
            "long after nobody watched any more"
        );
        assert_eq!((preview.width, preview.height), (160, 120));
        assert_eq!(preview.millimetres.len(), 2 * 160 * 120);
        assert_eq!(preview.bodies[0].confidences.len(), 25);
        let frame = log
            .frames
            .iter()
            .position(|frame| frame.captured_ns == preview.captured_ns);
        let frame = frame.expect("the frame of the same image");
        assert_eq!(preview.millimetres[..2], (frame as u16 + 1).to_le_bytes());
        assert!(log.arrivals_ns[frame] <= *arrived_ns, "before its frame");
    }
    let latency = |range: std::ops::Range<usize>| {
        median(
            range
                .map(|n| log.arrivals_ns[n] - log.frames[n].captured_ns)
                .collect(),
        )
    };
    let (without, with) = (latency(20..150), latency(150..350));
    println!(
        "median latency without previews {} us, with {} us",
        without / 1000,
        with / 1000
    );
    assert!(
        with < without + 3_000_000,
        "{with} ns instead of {without} ns"
    );
}

#[tokio::test]
async fn a_new_connection_begins_without_previews() {
    let (clock, log) = (clock(), log());
    log.lock().unwrap().preview_wishes = vec![(20, 10.0)];
    let server = Server::start(any_port(), &log, &clock);
    let address = server.address;
    let source = Depth::new(&clock, 400);
    let agent = tokio::spawn(run_with(source, config(address), parts(&clock), pending()));
    until("previews came", || log.lock().unwrap().previews.len() >= 3).await;
    server.kill();
    tokio::time::sleep(100 * MS).await;
    let (frames, previews) = {
        let log = log.lock().unwrap();
        (log.frames.len(), log.previews.len())
    };
    let _server = Server::start(address, &log, &clock);
    let report = agent.await.unwrap().unwrap();
    assert_eq!(
        (report.delivered, report.dropped, report.connections),
        (400, 0, 2)
    );
    let log = log.lock().unwrap();
    assert!(
        log.frames.len() > frames + 50,
        "the new connection carried frames"
    );
    assert_eq!(
        log.previews.len(),
        previews,
        "and nobody had asked it for previews"
    );
}

/// A network that carries so many bytes a second upwards.
fn slow_line(bytes_per_second: u32) -> Connector {
    const PIECE: usize = 1000;
    Arc::new(move |uri| {
        Box::pin(async move {
            let address = (uri.host().unwrap_or_default(), uri.port_u16().unwrap_or(80));
            let (mut from_server, mut to_server) = TcpStream::connect(address).await?.into_split();
            let (ours, theirs) = tokio::io::duplex(PIECE);
            let (mut up, mut down) = tokio::io::split(theirs);
            tokio::spawn(async move { tokio::io::copy(&mut from_server, &mut down).await });
            tokio::spawn(async move {
                let mut piece = [0; PIECE];
                while let Ok(count @ 1..) = up.read(&mut piece).await {
                    let seconds = count as f64 / f64::from(bytes_per_second);
                    tokio::time::sleep(Duration::from_secs_f64(seconds)).await;
                    if to_server.write_all(&piece[..count]).await.is_err() {
                        return;
                    }
                }
            });
            Ok(Box::new(ours) as Box<dyn Io>)
        })
    })
}

#[tokio::test]
async fn a_slow_line_gets_few_previews_and_most_frames_in_time() {
    let (clock, log) = (clock(), log());
    // Ten previews a second would be twice what the line carries.
    log.lock().unwrap().preview_wishes = vec![(1, 10.0)];
    let server = Server::start(any_port(), &log, &clock);
    let parts = Parts {
        connector: slow_line(200_000),
        ..parts(&clock)
    };
    let report = run_with(
        Depth::new(&clock, 400),
        config(server.address),
        parts,
        pending(),
    );
    let report = report.await.unwrap();
    assert_eq!(
        (report.delivered, report.dropped, report.connections),
        (400, 0, 1)
    );
    let log = log.lock().unwrap();
    let late = |n: &usize| log.arrivals_ns[*n] - log.frames[*n].captured_ns > 100_000_000;
    let late = (0..400).filter(late).count();
    println!(
        "{late} of 400 frames came after 100 ms, {} previews",
        log.previews.len()
    );
    assert!(late < 140, "{late} frames came after 100 ms");
    assert!(
        (2..=12).contains(&log.previews.len()),
        "{} previews",
        log.previews.len()
    );
}
