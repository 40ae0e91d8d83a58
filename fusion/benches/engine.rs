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
    let run = time_engine(&events);
    let reference = (0..RUNS)
        .map(|_| time_mean(sensors, people, run.frames))
        .min()
        .unwrap_or_default();
    let us = |time: Duration, count: usize| time.as_secs_f64() * 1e6 / count.max(1) as f64;
    println!(
        "{sensors:>7} {people:>6} {:>7} {:>11.1} {:>11.1} {:>14.2} {:>14.2} {:>7.1}",
        run.frames,
        us(run.total, run.frames),
        us(run.worst, 1),
        us(run.total, observations),
        us(reference, run.frames),
        run.total.as_secs_f64() / reference.as_secs_f64().max(1e-12),
    );
}

/// How often everything is run. Equal inputs make equal work, so the least time of each input is what it costs; the
/// rest is what else the machine did.
const RUNS: usize = 5;

struct Run {
    total: Duration,
    /// Longest single input.
    worst: Duration,
    frames: usize,
}

fn time_engine(events: &[(Timestamp, Input)]) -> Run {
    let mut least = vec![Duration::MAX; events.len()];
    let mut frames = 0;
    for _ in 0..RUNS {
        frames = 0;
        let mut engine = Engine::new(Config::default());
        let mut deadline = None;
        for ((time, input), least) in events.iter().cloned().zip(&mut least) {
            let start = Instant::now();
            while let Some(due) = deadline.filter(|due| *due < time) {
                engine.handle(Input::Tick(due));
                deadline = take(&mut engine, &mut frames);
            }
            engine.handle(input);
            deadline = take(&mut engine, &mut frames);
            *least = start.elapsed().min(*least);
        }
    }
    Run {
        total: least.iter().sum(),
        worst: least.iter().max().copied().unwrap_or_default(),
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
