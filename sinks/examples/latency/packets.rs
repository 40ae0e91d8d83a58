//! Sinks that send packets, each to a receiver of this machine.
//!
//! `to the system`: from the offer on the fusion thread until the system has the frame's last byte, as sinks measure it
//! themselves (bodies are solved on the way); `to the receiver`: until the last packet is read. `bare` writes the same bytes to
//! a bare socket, paced alike, and reads them. LSL is measured where PYLSL_LIB names liblsl.

use std::error::Error;
use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use posefuse_kinematics::Crowd;
use posefuse_sinks::Config;
use posefuse_skeleton::RoomFrame;
use tokio::runtime::Runtime;

use crate::figures::{Row, share};

/// Sinks and bare sockets by turns, so that both meet the same other programs.
const ROUNDS: usize = 5;
/// A frame's last packet is the one after which none came for so long.
const FRAME_END: Duration = Duration::from_millis(3);

pub(crate) fn measure(
    runtime: &Runtime,
    frames: &[RoomFrame],
    rate_hz: f64,
) -> Result<(), Box<dyn Error>> {
    let mut config = Config::default();
    let osc = Receiver::start("osc")?;
    config.osc.enabled = true;
    config.osc.targets = vec![osc.address];
    let vmc = Receiver::start("vmc")?;
    config.vmc.enabled = true;
    config.vmc.target = vmc.address;
    config.vmc.people = 1;
    config.lsl.enabled = std::env::var_os("PYLSL_LIB").is_some();
    config.allow_remote = config.lsl.enabled;
    for rate in [
        &mut config.osc.rate_hz,
        &mut config.vmc.rate_hz,
        &mut config.lsl.rate_hz,
    ] {
        *rate = 0.0;
    }
    let (sinks, tap, hub) = posefuse_sinks::open(&config)?;
    runtime.spawn(hub.run());
    sinks.start();
    std::thread::sleep(Duration::from_secs(1));
    let mut receivers = [(osc, Vec::new(), Vec::new()), (vmc, Vec::new(), Vec::new())];
    for round in frames.chunks(frames.len().div_ceil(ROUNDS).max(1)) {
        let offered = paced(round.len(), rate_hz, |number| {
            tap.offer(&round[number], || 0)
        });
        std::thread::sleep(Duration::from_millis(100));
        for (receiver, took, bare) in &mut receivers {
            let heard = receiver.take();
            took.extend(delays(&offered, &heard, rate_hz));
            bare.extend(by_bare_socket(&heard, rate_hz)?);
            receiver.take();
        }
    }
    println!("sinks that send, microseconds");
    println!("{:10}{}", "bodies", Row(&solving(&config, frames)));
    println!("to the system:");
    for status in sinks.statuses() {
        if let (Some(p50), Some(p99)) = (status.p50_ms, status.p99_ms) {
            let (kind, p50, p99) = (status.kind.name(), p50 * 1e3, p99 * 1e3);
            let (out, lost) = (status.delivered, status.dropped);
            println!("{kind:10}  p50 {p50:8.1}  p99 {p99:8.1}  {out} out, {lost} lost");
        }
    }
    println!("to the receiver, and the same bytes by a bare socket:");
    for (receiver, took, bare) in &receivers {
        let ratio = |of| share(took, of) / share(bare, of);
        println!(
            "{:10}{}   bare{}   ratio p50 {:.2}  p99 {:.2}",
            receiver.name,
            Row(took),
            Row(bare),
            ratio(0.5),
            ratio(0.99)
        );
    }
    runtime.block_on(sinks.stop());
    Ok(())
}

/// Does something at a rate, and says when each was begun.
fn paced(count: usize, rate_hz: f64, mut work: impl FnMut(usize)) -> Vec<Instant> {
    let begun = Instant::now();
    let one = |number| {
        let due = begun + Duration::from_secs_f64(number as f64 / rate_hz);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let at = Instant::now();
        work(number);
        at
    };
    (0..count).map(one).collect()
}

/// A datagram, and when it was read.
type Heard = (Instant, Vec<u8>);

/// A thread that reads datagrams.
struct Receiver {
    name: &'static str,
    address: SocketAddr,
    heard: Arc<Mutex<Vec<Heard>>>,
}

impl Receiver {
    fn start(name: &'static str) -> std::io::Result<Self> {
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        let address = socket.local_addr()?;
        let heard: Arc<Mutex<Vec<Heard>>> = Arc::default();
        let to = heard.clone();
        let reading = std::thread::Builder::new().name(format!("{name}-receiver"));
        reading.spawn(move || {
            let mut buffer = [0; 2048];
            while let Ok(size) = socket.recv(&mut buffer) {
                let at = Instant::now();
                if let Ok(mut heard) = to.lock() {
                    heard.push((at, buffer[..size].to_vec()));
                }
            }
        })?;
        Ok(Self {
            name,
            address,
            heard,
        })
    }

    /// What was read since.
    fn take(&self) -> Vec<Heard> {
        let heard = self.heard.lock();
        heard
            .map(|mut heard| std::mem::take(&mut *heard))
            .unwrap_or_default()
    }
}

/// From each offer to the last datagram before the next one, microseconds; those after which none came are left out.
fn delays(offered: &[Instant], heard: &[Heard], rate_hz: f64) -> Vec<f64> {
    let interval = Duration::from_secs_f64(1.0 / rate_hz);
    let delay = |(index, begun): (usize, &Instant)| {
        let end = offered
            .get(index + 1)
            .map_or(*begun + interval, |next| *next);
        let mut in_time = heard.iter().filter(|(at, _)| (*begun..end).contains(at));
        let (last, _) = in_time.next_back()?;
        Some(last.duration_since(*begun).as_secs_f64() * 1e6)
    };
    offered.iter().enumerate().filter_map(delay).collect()
}

/// What a bare socket takes for the same packets, frame by frame.
fn by_bare_socket(heard: &[Heard], rate_hz: f64) -> Result<Vec<f64>, Box<dyn Error>> {
    let mut frames: Vec<Vec<&[u8]>> = Vec::new();
    let mut last: Option<Instant> = None;
    for (at, packet) in heard {
        if last.is_none_or(|last| at.duration_since(last) > FRAME_END) {
            frames.push(Vec::new());
        }
        last = Some(*at);
        if let Some(frame) = frames.last_mut() {
            frame.push(packet);
        }
    }
    let receiver = Receiver::start("bare")?;
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    let offered = paced(frames.len(), rate_hz, |number| {
        for packet in &frames[number] {
            let _ = socket.send_to(packet, receiver.address);
        }
    });
    std::thread::sleep(Duration::from_millis(50));
    Ok(delays(&offered, &receiver.take(), rate_hz))
}

/// What solving everybody's bodies takes, microseconds a frame.
fn solving(config: &Config, frames: &[RoomFrame]) -> Vec<f64> {
    let mut crowd = Crowd::new(config.bodies.clone());
    let solved = frames.iter().map(|frame| {
        let begun = Instant::now();
        std::hint::black_box(crowd.step(frame));
        begun.elapsed().as_secs_f64() * 1e6
    });
    solved.collect()
}
