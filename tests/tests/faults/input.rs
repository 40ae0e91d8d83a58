//! Messages that make no sense: raw garbage, malformed and oversized gRPC, numbers that are none.

use std::io::Write;
use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use posefuse_proto::{agent_body, v1};
use posefuse_simulator::SimSensor;
use posefuse_tests::account::sensor;
use posefuse_tests::process::{Follower, Room, WireAgent, send_raw};
use prost::Message;
use rand::rngs::StdRng;
use rand::{Rng, RngExt, SeedableRng};
use tokio::time::{Instant, sleep, timeout};
use tonic::Code;

fn garbage(random: &mut StdRng, length: usize) -> Vec<u8> {
    let mut bytes = vec![0; length];
    random.fill_bytes(&mut bytes);
    bytes
}

/// A gRPC method that takes a message a client may get wrong.
const METHODS: [&str; 5] = [
    "/posefuse.v1.Ingest/Stream",
    "/posefuse.v1.Room/StartTake",
    "/posefuse.v1.Room/Watch",
    "/posefuse.v1.Room/SetCalibration",
    "/posefuse.v1.Room/NoSuchMethod",
];

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nonsense_on_the_port_leaves_the_server_healthy() {
    let mut room = Room::new(2).await;
    let _agents = room.agents().await;
    let follower = Follower::new(&room).await;
    let mut random = StdRng::seed_from_u64(1);
    for round in 0..60 {
        let mut bytes = match round % 3 {
            0 => Vec::new(),
            1 => b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec(),
            _ => b"POST /posefuse.v1.Room/StartTake HTTP/1.1\r\nHost: 127.0.0.1\r\n".to_vec(),
        };
        let length = random.random_range(1..4096);
        bytes.extend(garbage(&mut random, length));
        let mut stream = TcpStream::connect(room.address()).expect("a connection");
        // The server may hang up while we still write.
        let _ = stream.write_all(&bytes);
    }
    for method in METHODS {
        for length in [1, 17, 1000] {
            let answer = send_raw(
                room.channel().await,
                method,
                vec![garbage(&mut random, length)],
            );
            let answer = timeout(Duration::from_secs(6), answer)
                .await
                .expect("an answer in time");
            // Bytes that happen to decode are a valid request; what is refused is refused with a code.
            if let Err(status) = answer {
                assert!(
                    !matches!(status.code(), Code::Unknown | Code::Ok),
                    "{method}: {status:?}"
                );
            }
        }
    }
    let huge = v1::StartTakeRequest {
        notes: "x".repeat(2 << 20),
        ..Default::default()
    };
    let answer = send_raw(room.channel().await, METHODS[1], vec![huge.encode_to_vec()]).await;
    let status = answer.expect_err("a request of 2 MiB");
    assert!(
        matches!(status.code(), Code::OutOfRange | Code::ResourceExhausted),
        "{status:?}"
    );

    let from = Instant::now();
    sleep(Duration::from_secs(2)).await;
    assert!(
        follower.since(from).len() >= 45,
        "{} frames in 2 s afterwards",
        follower.since(from).len()
    );
    follower.complete();
    let status = room.status().await;
    for name in ["cam1", "cam2"] {
        assert_eq!(sensor(&status, name).frames_lost, 0);
    }
    assert!(room.server.runs());
    assert!(
        !room.server.said().contains("panicked"),
        "{}",
        room.server.said()
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn numbers_that_are_none_are_counted_and_never_come_out() {
    let room = Room::new(2).await;
    let follower = Follower::new(&room).await;
    room.start_take("nan").await;
    let agent = WireAgent::join(room.channel().await, "cam1")
        .await
        .expect("a welcome");
    let mut simulated = SimSensor::new(Arc::clone(&room.world()), 0);
    // Clocks are mapped within a few probes.
    sleep(Duration::from_secs(1)).await;
    const FRAMES: u64 = 90;
    let mut spoilt = 0;
    for sequence in 0..FRAMES {
        let frame = simulated.next_frame();
        let mut bodies: Vec<_> = frame
            .bodies
            .iter()
            .map(|body| agent_body(body.tracking_id, &body.joints))
            .collect();
        for body in &mut bodies {
            // One joint a frame, each of its kinds of nonsense in turn; sometimes all of them.
            let nonsense =
                [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30][sequence as usize % 4];
            let joints = if sequence % 10 == 9 { 0..25 } else { 5..6 };
            for joint in joints {
                body.positions[3 * joint + sequence as usize % 3] = nonsense;
                body.confidences[joint] = 1.0;
                spoilt += 1;
            }
        }
        assert!(agent.frame(sequence, bodies).await, "the stream was ended");
        sleep(Duration::from_millis(33)).await;
    }
    let status = room
        .status_when("all is counted", |status| {
            let rejected = &sensor(status, "cam1").rejected;
            let count = |reason: &str| rejected.get(reason).copied().unwrap_or(0);
            count("non-finite") + count("absurd") >= spoilt
        })
        .await;
    println!(
        "{spoilt} joints spoilt, rejected: {:?}",
        sensor(&status, "cam1").rejected
    );
    assert_eq!(sensor(&status, "cam1").frames_received, FRAMES);
    while agent.acknowledged() < FRAMES {
        sleep(Duration::from_millis(10)).await;
    }
    let seen = follower.complete();
    let tracks: Vec<_> = seen.iter().flat_map(|seen| &seen.frame.tracks).collect();
    assert!(
        tracks.len() > 30,
        "hardly anybody was fused: {} tracks",
        tracks.len()
    );
    for track in tracks {
        let numbers = track
            .positions
            .iter()
            .chain(&track.covariances)
            .chain(&track.confidences);
        assert!(
            numbers.clone().all(|x| x.is_finite() && x.abs() < 100.0),
            "{track:?}"
        );
    }
    room.stop_take().await;
    let take = room.take("nan");
    assert_eq!(
        take.observations().map(Result::unwrap).count() as u64,
        FRAMES,
        "what came is in the take"
    );
    assert!(take.frames().all(|frame| frame.is_ok()));
}
