//! Engine time per fused frame and per input frame, beside the least any fusion must do: the bare mean of the same
//! joints, already placed and associated, in the same run.
//!
//! `cargo bench -p posefuse-fusion --bench engine [seconds]`. Simulated people with all default errors; the
//! simulation itself is not timed. One core.

#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_fusion::{Config, Engine, Input, Output};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{JOINT_COUNT, Joint, Timestamp};
use support::inputs;

fn main() {
    let seconds = std::env::args()
        .skip(1)
        .find_map(|a| a.parse::<f64>().ok())
        .unwrap_or(6.0);
    println!(
        "engine, default configuration, {seconds} s of simulated room; us per fused frame, one core"
    );
    println!(
        "{:>7} {:>6} {:>7} {:>11} {:>11} {:>14} {:>11} {:>7}",
        "sensors",
        "people",
        "frames",
        "us / frame",
        "worst us",
        "us / input",
        "mean of joints",
        "ratio"
    );
    for sensors in [2, 6, 16] {
        for people in [1, 2, 4] {
            row(sensors, people, seconds);
        }
    }
    row(64, 2, seconds.min(3.0));
}

fn row(sensors: usize, people: usize, seconds: f64) {
    let scenario = Scenario {
        seed: 3,
        sensors,
        people,
        area_m: 4.0,
        ..Scenario::default()
    };
    let Ok(world) = World::new(&scenario).map(Arc::new) else {
        return;
    };
    let events = inputs(&world, seconds);
    let observations = events
        .iter()
        .filter(|(_, i)| matches!(i, Input::Observation(_)))
        .count();
    // The best of three runs: what the code costs, not what else the machine does.
    let runs: Vec<Run> = (0..3).map(|_| time_engine(&events)).collect();
    let best = runs.iter().min_by_key(|run| run.total).expect("three runs");
    let reference = (0..3)
        .map(|_| time_mean(sensors, people, best.frames))
        .min()
        .unwrap_or_default();
    let us = |time: Duration, count: usize| time.as_secs_f64() * 1e6 / count.max(1) as f64;
    println!(
        "{sensors:>7} {people:>6} {:>7} {:>11.1} {:>11.1} {:>14.2} {:>11.2} {:>7.1}",
        best.frames,
        us(best.total, best.frames),
        best.worst.as_secs_f64() * 1e6,
        us(best.total, observations),
        us(reference, best.frames),
        best.total.as_secs_f64() / reference.as_secs_f64().max(1e-12),
    );
}

struct Run {
    total: Duration,
    /// Longest single input.
    worst: Duration,
    frames: usize,
}

fn time_engine(events: &[(Timestamp, Input)]) -> Run {
    let events = events.to_vec();
    let mut engine = Engine::new(Config::default());
    let (mut total, mut worst, mut frames) = (Duration::ZERO, Duration::ZERO, 0);
    let mut deadline = None;
    for (time, input) in events {
        let start = Instant::now();
        while let Some(due) = deadline.filter(|due| *due < time) {
            engine.handle(Input::Tick(due));
            deadline = take(&mut engine, &mut frames);
        }
        engine.handle(input);
        deadline = take(&mut engine, &mut frames);
        let spent = start.elapsed();
        total += spent;
        worst = worst.max(spent);
    }
    Run {
        total,
        worst,
        frames,
    }
}

fn take(engine: &mut Engine, frames: &mut usize) -> Option<Timestamp> {
    loop {
        match engine.poll() {
            Output::Frame(frame) => {
                black_box(&frame);
                *frames += 1;
            }
            Output::Rejected(rejection) => {
                black_box(&rejection);
            }
            Output::WakeAt(deadline) => return deadline,
        }
    }
}

/// The reference: the mean of every joint over the sensors, nothing else.
fn time_mean(sensors: usize, people: usize, frames: usize) -> Duration {
    let seen: Vec<[[f64; 3]; JOINT_COUNT]> = (0..sensors * people)
        .map(|i| Joint::ALL.map(|j| [i as f64, j as u8 as f64, 1.0]))
        .collect();
    let start = Instant::now();
    for _ in 0..frames {
        for person in black_box(&seen).chunks_exact(sensors) {
            let mut sum = [[0.0; 3]; JOINT_COUNT];
            for joints in person {
                for (sum, joint) in sum.iter_mut().zip(joints) {
                    for (sum, value) in sum.iter_mut().zip(joint) {
                        *sum += value;
                    }
                }
            }
            let mean = sum.map(|joint| joint.map(|value| value / sensors as f64));
            black_box(&mean);
        }
    }
    start.elapsed()
}
