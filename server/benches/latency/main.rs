//! What the server costs beside bare tonic, over real loopback sockets, each figure with its reference in the same run.
//!
//! - ingest: frames per second of agents that send flat out, as a share of a bare tonic stream of the same messages;
//! - latency: from sending a frame to the fused frame at a `Watch` subscriber, beside a bare tonic echo of the frame;
//! - load: 64 sensors at 30 Hz, fused and recorded.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
#[path = "../../tests/room/fixture.rs"]
mod fixture;

mod bare;
mod cpu;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_fusion::{SmoothConfig, Stage};
use posefuse_proto::v1::{self, agent_message, ingest_client::IngestClient, server_message};
use posefuse_session::DiskStorage;
use tokio::sync::mpsc;
use tonic::transport::Channel;

const ROUNDS: usize = 5;
const FLAT_OUT: Duration = Duration::from_secs(2);
const FLAT_OUT_AGENTS: usize = 4;
const LATENCY_SAMPLES: u64 = 2000;
const LOAD_SENSORS: usize = 64;
const LOAD: Duration = Duration::from_secs(10);

#[tokio::main]
async fn main() {
    ingest().await;
    latency().await;
    load().await;
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((share * values.len() as f64) as usize).min(values.len() - 1)]
}

async fn ingest() {
    let names: Vec<_> = (0..FLAT_OUT_AGENTS).map(|i| format!("cam{i}")).collect();
    let names: Vec<_> = names.iter().map(String::as_str).collect();
    let server = fixture::start().await;
    let fusing = fixture::start().await;
    fixture::calibrated(&mut fusing.room().await, &names).await;
    let bare = bare::ingest().await;
    let (mut rates, mut fusing_rates, mut references) = (vec![], vec![], vec![]);
    for round in 0..ROUNDS as u64 {
        references.push(flat_out(bare, &names, round).await);
        rates.push(flat_out(server.address, &names, round).await);
        fusing_rates.push(flat_out(fusing.address, &names, round).await);
    }
    let (rate, with_fusion, reference) = (median(rates), median(fusing_rates), median(references));
    println!(
        "ingest, {FLAT_OUT_AGENTS} agents flat out, one body of 25 joints a frame, median of {ROUNDS} rounds:"
    );
    println!("  bare tonic stream      {reference:>9.0} frames/s");
    println!(
        "  posefuse ingest        {rate:>9.0} frames/s  {:.0} % of bare (aim: 70 %)",
        100.0 * rate / reference
    );
    println!(
        "  with every frame fused {with_fusion:>9.0} frames/s  {:.0} % of bare",
        100.0 * with_fusion / reference
    );
    server.stop().await;
    fusing.stop().await;
}

/// Frames per second that are acknowledged.
async fn flat_out(address: SocketAddr, names: &[&str], round: u64) -> f64 {
    let began = Instant::now();
    let agents: Vec<_> = names
        .iter()
        .map(|name| tokio::spawn(send_flat_out(address, fixture::hello(name, round + 10))))
        .collect();
    let mut frames = 0;
    for agent in agents {
        frames += agent.await.unwrap();
    }
    frames as f64 / began.elapsed().as_secs_f64()
}

async fn send_flat_out(address: SocketAddr, hello: v1::Hello) -> u64 {
    let channel = Channel::from_shared(format!("http://{address}")).unwrap();
    let mut client = IngestClient::new(channel.connect().await.unwrap());
    let (up, queue) = mpsc::channel(256);
    up.send(upward(agent_message::Message::Hello(hello)))
        .await
        .unwrap();
    let sent = tokio_stream::wrappers::ReceiverStream::new(queue);
    let mut down = client.stream(sent).await.unwrap().into_inner();
    let zero = Instant::now();
    let agent_ns = move || zero.elapsed().as_nanos() as i64;
    // Also keeps the stream open until everything is acknowledged.
    let echo = up.clone();
    let sender = tokio::spawn(async move {
        let (began, mut sequence) = (Instant::now(), 0);
        let body = fixture::person(0.0);
        while began.elapsed() < FLAT_OUT {
            let mut body = body.clone();
            body.positions[0] += sequence as f32 * 1e-6;
            let frame = v1::Frame {
                sequence,
                captured_ns: agent_ns(),
                bodies: vec![body],
            };
            let _ = up.send(upward(agent_message::Message::Frame(frame))).await;
            sequence += 1;
        }
        sequence
    });
    let mut acked = 0;
    let mut sender = std::pin::pin!(sender);
    let mut target = None;
    while target.is_none_or(|target| acked + 1 < target) {
        tokio::select! {
            done = &mut sender, if target.is_none() => target = Some(done.unwrap()),
            message = down.message() => match message.unwrap().unwrap().message {
                Some(server_message::Message::Ack(ack)) => acked = ack.sequence,
                Some(server_message::Message::ClockProbe(probe)) => {
                    let now = agent_ns();
                    let reply = agent_message::Message::ClockEcho(v1::ClockEcho {
                        probe: probe.probe,
                        agent_received_ns: now,
                        agent_sent_ns: now,
                    });
                    let _ = echo.try_send(upward(reply));
                }
                _ => {}
            }
        }
    }
    drop(echo);
    while let Ok(Some(_)) = down.message().await {}
    acked + 1
}

fn upward(message: agent_message::Message) -> v1::AgentMessage {
    v1::AgentMessage {
        message: Some(message),
    }
}

async fn latency() {
    let mut config = fixture::config();
    config.fusion.intake.coalesce_ms = 0.0;
    config.fusion.intake.rate_hz = 240.0;
    for stage in &mut config.fusion.stages {
        if let Stage::Smooth(SmoothConfig { enabled, .. }) = stage {
            *enabled = false;
        }
    }
    let server = fixture::start_with(config, fixture::memory(), fixture::memory()).await;
    let mut room = server.room().await;
    fixture::calibrated(&mut room, &["left"]).await;
    let mut agent = server.agent("left").await;
    agent.mapped().await;
    let mut frames = room
        .watch(v1::WatchRequest::default())
        .await
        .unwrap()
        .into_inner();
    let mut echo = bare::echo().await;

    let (mut through, mut echoed) = (Vec::new(), Vec::new());
    let mut beat = tokio::time::interval(Duration::from_millis(10));
    // Never two frames within the engine's shortest period: that wait is chosen, not suffered.
    beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    for sequence in 0..LATENCY_SAMPLES + 20 {
        let body = fixture::person(sequence as f32 * 0.01);
        beat.tick().await;
        let began = Instant::now();
        echo.round_trip(v1::Frame {
            sequence,
            captured_ns: 0,
            bodies: vec![body.clone()],
        })
        .await;
        let echo_took = began.elapsed();
        let began = Instant::now();
        agent.frame(sequence, vec![body]).await;
        let answer = tokio::time::timeout(Duration::from_secs(1), frames.message()).await;
        let took = began.elapsed();
        // The first frames open the tracks.
        if sequence >= 20 {
            let frame = answer.expect("no fused frame").unwrap().unwrap();
            assert_eq!(frame.tracks.len(), 1);
            through.push(took.as_secs_f64() * 1e3);
            echoed.push(echo_took.as_secs_f64() * 1e3);
        }
    }
    println!(
        "from sending a frame to the fused frame at a subscriber, {LATENCY_SAMPLES} frames, smoothing off:"
    );
    for (name, values) in [("bare tonic echo", &mut echoed), ("posefuse", &mut through)] {
        println!(
            "  {name:<16} p50 {:.3} ms  p99 {:.3} ms",
            quantile(values, 0.5),
            quantile(values, 0.99)
        );
    }
    let added =
        |share| quantile(&mut through.clone(), share) - quantile(&mut echoed.clone(), share);
    println!(
        "  added            p50 {:.3} ms  p99 {:.3} ms (aim: p99 <= 2 ms)",
        added(0.5),
        added(0.99)
    );
    server.stop().await;
}

async fn load() {
    let scratch = tempfile::tempdir().unwrap();
    let storage = Arc::new(DiskStorage::new(scratch.path()).unwrap());
    let server = fixture::start_with(fixture::config(), storage, fixture::memory()).await;
    let mut room = server.room().await;
    let names: Vec<_> = (0..LOAD_SENSORS).map(|i| format!("cam{i}")).collect();
    let names: Vec<_> = names.iter().map(String::as_str).collect();
    fixture::calibrated(&mut room, &names).await;
    let mut agents = Vec::new();
    for name in &names {
        agents.push(server.agent(name).await);
    }
    for agent in &mut agents {
        agent.mapped().await;
    }
    room.start_take(v1::StartTakeRequest::default())
        .await
        .unwrap();
    let frames = room
        .watch(v1::WatchRequest::default())
        .await
        .unwrap()
        .into_inner();
    let watching = tokio::spawn(watch(frames));
    let (began, busy) = (Instant::now(), cpu::Usage::now());
    let sending: Vec<_> = agents
        .into_iter()
        .enumerate()
        .map(|(index, agent)| tokio::spawn(send_30_hz(agent, index)))
        .collect();
    let mut sent = 0;
    for sending in sending {
        sent += sending.await.unwrap();
    }
    let (seconds, used) = (
        began.elapsed().as_secs_f64(),
        cpu::Usage::now().since(&busy),
    );
    let status = room.get_status(v1::GetStatusRequest {}).await;
    let status = status.unwrap().into_inner();
    let take = room.stop_take(v1::StopTakeRequest {}).await;
    let take = take.unwrap().into_inner();
    let received: u64 = status.sensors.iter().map(|s| s.frames_received).sum();
    let lost: u64 = status.sensors.iter().map(|s| s.frames_lost).sum();
    let queue_full: u64 = status
        .sensors
        .iter()
        .filter_map(|s| s.rejected.get("queue-full"))
        .sum();
    server.stop().await;
    let (count, missing) = watching.await.unwrap();
    println!("{LOAD_SENSORS} sensors at 30 Hz for {seconds:.1} s, fused, watched and recorded:");
    println!(
        "  sent {sent}, received {received}, lost {lost}, refused for want of room {queue_full}, not recorded {}",
        take.dropped
    );
    println!(
        "  fused frames {count}, missing at the subscriber {missing}, latency p50 {:.2} ms p99 {:.2} ms, thread {:.0} us a frame",
        status.latency_p50_ms, status.latency_p99_ms, status.engine_us
    );
    let percent = |s: f64| 100.0 * s / seconds;
    println!(
        "  CPU: fusion thread {:.0} %, recorder {:.0} %, all of it with the {LOAD_SENSORS} agents {:.0} % of one core",
        percent(used.fusion_s),
        percent(used.recorder_s),
        percent(used.all_s)
    );
}

/// How many fused frames came, and how many were missing.
async fn watch(mut frames: tonic::Streaming<v1::RoomFrame>) -> (u64, u64) {
    let (mut last, mut missing, mut count) = (None, 0, 0_u64);
    while let Ok(Some(frame)) = frames.message().await {
        missing += last.map_or(0, |last| frame.number - last - 1);
        last = Some(frame.number);
        count += 1;
    }
    (count, missing)
}

async fn send_30_hz(mut agent: fixture::Agent, index: usize) -> u64 {
    let mut beat = tokio::time::interval(Duration::from_nanos(33_333_333));
    tokio::time::sleep(Duration::from_micros(500 * index as u64)).await;
    let began = Instant::now();
    let mut sequence = 0;
    while began.elapsed() < LOAD {
        beat.tick().await;
        let seconds = began.elapsed().as_secs_f32();
        let mut body = fixture::person(seconds);
        body.positions[1] += index as f32 * 1e-4;
        agent.frame(sequence, vec![body]).await;
        sequence += 1;
    }
    agent.acked(sequence - 1).await;
    sequence
}
