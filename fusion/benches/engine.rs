//! Engine time per fused frame and per input frame, beside the least any fusion must do: the bare mean of the same
//! joints, already placed and associated, in the same run. Then how the cost grows with sensors times people, and how
//! fast a take is smoothed offline.
//!
//! `cargo bench -p posefuse-fusion --bench engine [seconds]`. Simulated people with all default errors; the
//! simulation itself is not timed. One core.

#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_fusion::{Config, Engine, FuseMethod, Input, Output};
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::{JOINT_COUNT, Joint, Timestamp};
use support::inputs;

/// How often everything is run. Equal inputs make equal work, so the least time of each input is what it costs; the
/// rest is what else the machine did.
const RUNS: usize = 5;
/// What a fused frame of six sensors and two people may cost, us.
const AIM_US: f64 = 150.0;
/// How many times faster than it was recorded a take of four sensors and one person is to be smoothed.
const AIM_OFFLINE: f64 = 300.0;
/// Frames that smoothing goes back over, as when a take is fused again.
const SMOOTH_FRAMES: usize = 90;

type Events = Vec<(Timestamp, Input)>;

fn main() {
    let seconds = std::env::args()
        .skip(1)
        .find_map(|a| a.parse::<f64>().ok())
        .unwrap_or(6.0);
    println!("engine, {seconds} s of simulated room; us per fused frame, one core");
    println!(
        "{:>9} {:>7} {:>6} {:>7} {:>11} {:>11} {:>14} {:>11} {:>7}",
        "method",
        "sensors",
        "people",
        "frames",
        "us / frame",
        "worst us",
        "us / input",
        "mean of joints",
        "ratio"
    );
    let mut costs = Vec::new();
    for sensors in [2, 6, 16, 32, 64] {
        for people in [1, 2, 4, 8] {
            // Few frames are enough where each costs much.
            let seconds = seconds.min(f64::max(1.5, 100.0 / (sensors * people) as f64));
            costs.extend(row(FuseMethod::Kalman, sensors, people, seconds));
        }
    }
    for method in [FuseMethod::Weighted, FuseMethod::Average] {
        for (sensors, people) in [(6, 2), (16, 4)] {
            row(method, sensors, people, seconds);
        }
    }
    fit(&costs);
    let usual = costs
        .iter()
        .find(|cost| (cost.sensors, cost.people) == (6, 2));
    if let Some(cost) = usual {
        println!(
            "6 sensors, 2 people: {:.1} us per frame; aim {AIM_US} us",
            cost.us
        );
    }
    offline(seconds.max(20.0));
}

/// What one fused frame costs.
struct Cost {
    sensors: usize,
    people: usize,
    us: f64,
}

fn room(sensors: usize, people: usize, seconds: f64) -> Option<Events> {
    let scenario = Scenario {
        seed: 3,
        sensors,
        people,
        area_m: 4.0,
        ..Scenario::default()
    };
    let world = World::new(&scenario).map(Arc::new).ok()?;
    Some(inputs(&world, seconds))
}

fn row(method: FuseMethod, sensors: usize, people: usize, seconds: f64) -> Option<Cost> {
    let events = room(sensors, people, seconds)?;
    let observations = events
        .iter()
        .filter(|(_, i)| matches!(i, Input::Observation(_)))
        .count();
    let mut config = Config::default();
    config.fuse.method = method;
    let run = time_engine(&events, &config, None);
    let reference = (0..RUNS)
        .map(|_| time_mean(sensors, people, run.frames))
        .min()
        .unwrap_or_default();
    let us = |time: Duration, count: usize| time.as_secs_f64() * 1e6 / count.max(1) as f64;
    let cost = Cost {
        sensors,
        people,
        us: us(run.total, run.frames),
    };
    println!(
        "{:>9} {sensors:>7} {people:>6} {:>7} {:>11.1} {:>11.1} {:>14.2} {:>14.2} {:>7.1}",
        format!("{method:?}").to_lowercase(),
        run.frames,
        cost.us,
        us(run.worst, 1),
        us(run.total, observations),
        us(reference, run.frames),
        run.total.as_secs_f64() / reference.as_secs_f64().max(1e-12),
    );
    Some(cost)
}

/// Prints the straight line, `fixed + each * sensors * people`, from which the costs deviate least in proportion.
fn fit(costs: &[Cost]) {
    // Each equation divided by its cost, so that small rooms count as much as large ones.
    let (mut a, mut b) = ([[0.0; 2]; 2], [0.0; 2]);
    let terms = |cost: &Cost| [1.0, (cost.sensors * cost.people) as f64];
    for cost in costs {
        let row = terms(cost).map(|term| term / cost.us);
        for i in 0..2 {
            b[i] += row[i];
            for j in 0..2 {
                a[i][j] += row[i] * row[j];
            }
        }
    }
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let fixed = (b[0] * a[1][1] - b[1] * a[0][1]) / determinant;
    let each = (b[1] * a[0][0] - b[0] * a[1][0]) / determinant;
    let line = |cost: &Cost| fixed + each * terms(cost)[1];
    let mean = costs.iter().map(|cost| cost.us).sum::<f64>() / costs.len().max(1) as f64;
    let sum = |of: &dyn Fn(&Cost) -> f64| costs.iter().map(|cost| of(cost).powi(2)).sum::<f64>();
    let r2 = 1.0 - sum(&|cost| cost.us - line(cost)) / sum(&|cost| cost.us - mean);
    println!("kalman: {fixed:.1} us + {each:.2} us per sensor and person; R^2 {r2:.4}");
    let off = |cost: &Cost| line(cost) / cost.us - 1.0;
    let worst = costs
        .iter()
        .max_by(|a, b| off(a).abs().total_cmp(&off(b).abs()));
    if let Some(cost) = worst {
        println!(
            "largest deviation {:.0} % ({} sensors, {} people)",
            off(cost) * 100.0,
            cost.sensors,
            cost.people
        );
    }
    let per = |cost: &Cost| cost.us / terms(cost)[1];
    let (least, most) = costs
        .iter()
        .map(per)
        .fold((f64::MAX, 0.0), |(least, most), us| {
            (us.min(least), us.max(most))
        });
    println!("between {least:.2} and {most:.2} us per sensor and person, all included");
}

/// Prints how fast a take is smoothed.
fn offline(seconds: f64) {
    let Some(events) = room(4, 1, seconds) else {
        return;
    };
    let run = time_engine(&events, &Config::default(), Some(SMOOTH_FRAMES));
    println!(
        "offline, 4 sensors, 1 person: {} frames of {seconds} s smoothed at {:.0} times real time; aim {AIM_OFFLINE}",
        run.frames,
        seconds / run.total.as_secs_f64(),
    );
}

struct Run {
    total: Duration,
    /// Longest single input.
    worst: Duration,
    frames: usize,
}

fn time_engine(events: &Events, config: &Config, smooth: Option<usize>) -> Run {
    // The last is for the end of a take.
    let mut least = vec![Duration::MAX; events.len() + 1];
    let mut frames = 0;
    for _ in 0..RUNS {
        frames = 0;
        let mut engine = Engine::new(config.clone());
        if let Some(frames) = smooth {
            engine.smooth_over(frames);
        }
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
        let start = Instant::now();
        if smooth.is_some() {
            engine.finish();
            take(&mut engine, &mut frames);
        }
        if let Some(least) = least.last_mut() {
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
            Output::Repair(_) => {}
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
