//! What solving costs: `cargo run --release -p posefuse-kinematics --example speed -- [seeds] [seconds]`.
//!
//! Procedural people with 15 mm of noise on every joint; microseconds per person and frame on one core, and the same for
//! the solver's other ways. The mean is of the processor's time where the system tells it (Linux), so that other programs
//! do not count; median and 99th percentile are by the clock.

use std::time::Instant;

use nalgebra::{Matrix3, Vector3};
use posefuse_kinematics::{Body, Config, Solver, Start};
use posefuse_simulator::motion::{Cast, Performance, Situation};
use posefuse_skeleton::{
    Confidence, JointState, Provenance, SensorId, SensorSet, Timestamp, Track, TrackId,
};

const RATE_HZ: f64 = 30.0;
const SIGMA_M: f64 = 0.015;

/// A name, and what is changed in the configuration.
type Way = (&'static str, fn(&mut Config));

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().map_or(Ok(3), |text| text.parse())?;
    let seconds: f64 = arguments.next().map_or(Ok(60.0), |text| text.parse())?;
    let people: Vec<Vec<Track>> = (1..=seeds).map(|seed| tracks(seed, seconds)).collect();
    let ways: [Way; 4] = [
        ("ships", |_| {}),
        ("from-skeleton", |c| c.fit.start = Start::Skeleton),
        ("no-feet", |c| c.feet.enabled = false),
        ("bones", |c| c.fit.enabled = false),
    ];
    println!("{:16}{:>8}{:>8}{:>8}", "way", "mean us", "median", "p99");
    for (name, change) in ways {
        let mut config = Config::default();
        change(&mut config);
        let (mut took, mut busy): (Vec<f64>, f64) = (Vec::new(), 0.0);
        for tracks in &people {
            let mut solver = Solver::new(&Body::learn(tracks), config.clone());
            let before = processor_us();
            let begun = Instant::now();
            for (frame, track) in tracks.iter().enumerate() {
                let at = Timestamp::from_seconds(frame as f64 / RATE_HZ);
                let begun = Instant::now();
                std::hint::black_box(solver.step(track, at));
                took.push(begun.elapsed().as_secs_f64() * 1e6);
            }
            busy += match (before, processor_us()) {
                (Some(before), Some(after)) => after - before,
                _ => begun.elapsed().as_secs_f64() * 1e6,
            };
        }
        took.sort_by(f64::total_cmp);
        let mean = busy / took.len() as f64;
        let at = |share: f64| took[(share * (took.len() - 1) as f64) as usize];
        println!("{name:16}{mean:8.1}{:8.1}{:8.1}", at(0.5), at(0.99));
    }
    Ok(())
}

/// What this thread has had of the processor so far.
fn processor_us() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let ns: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(ns * 1e-3)
}

fn tracks(seed: u64, seconds: f64) -> Vec<Track> {
    let performance = Performance::procedural(Cast {
        seed,
        people: 1,
        area_m: 2.6,
        hugs: false,
        situation: Situation::Everyday,
        away_s: 1.8,
    });
    let sensors = SensorId::new(0).map_or(SensorSet::EMPTY, SensorSet::only);
    let mut state = seed;
    // The upper bits of a linear congruential generator (Knuth's MMIX); twelve uniform numbers have variance 1.
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut noise = move || SIGMA_M * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0);
    let mut track = |frame: usize| Track {
        id: TrackId(seed),
        since: Timestamp::ZERO,
        sensors,
        skeleton: performance
            .pose(0, frame as f64 / RATE_HZ)
            .map(|_, position| JointState {
                position: position.moved(Vector3::new(noise(), noise(), noise())),
                covariance: Matrix3::from_diagonal_element(SIGMA_M * SIGMA_M),
                confidence: Confidence::FULL,
                provenance: Provenance::Measured(sensors),
            }),
        hands: [None; 2],
    };
    (0..(seconds * RATE_HZ) as usize).map(&mut track).collect()
}
