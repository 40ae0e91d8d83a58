//! What an image costs, step by step, at the usual sizes and with one, two and four people, beside the network alone.
//!
//! `cargo run --release -p posefuse-bodytrack --example cost [-- SECONDS]`
//!
//! Times are medians of the wall clock; "cpu ms" is the time that the process was given (Linux), which other programs do not change;
//! "ratio" is the whole image against one run of the body's network on one person, in the same process.
#![allow(clippy::unwrap_used, reason = "a tool for developers")]

use std::time::Instant;

use posefuse_bodytrack::crop::{CHANNELS, SIZE};
use posefuse_bodytrack::{BodyTracker, Step, TrackerConfig};
use posefuse_models::{Network, NetworkFile};
use posefuse_simulator::depth::DepthCamera;
use posefuse_simulator::{Scenario, World};
use posefuse_skeleton::DepthImage;

const RATE_HZ: f64 = 30.0;
/// What does not count: until everybody is known.
const SKIP_S: f64 = 1.0;
const TIMED: usize = 40;

fn main() {
    let given = std::env::args().nth(1);
    let seconds: f64 = given.map_or(4.0, |text| text.parse().unwrap());
    let reference = reference_ms();
    println!("the network alone, one person: {reference:.2} ms");
    let mut heading = String::from("image      people found");
    for step in Step::ALL {
        heading += &format!(" {:>9}", format!("{step:?}").to_lowercase());
    }
    println!("{heading}   all ms   p95 ms   cpu ms  ratio  % of a core at 30 Hz");
    for [width, height] in [[320, 240], [640, 480]] {
        for people in [1, 2, 4] {
            row(
                DepthCamera::structured_light(width, height),
                people,
                seconds,
                reference,
            );
        }
    }
}

fn row(camera: DepthCamera, people: usize, seconds: f64, reference: f64) {
    let world = World::new(&Scenario {
        people,
        ..Scenario::default()
    });
    let world = world.unwrap();
    let images: Vec<DepthImage> = (0..(seconds * RATE_HZ) as usize)
        .map(|image| world.depth(0, image as f64 / RATE_HZ, &camera))
        .collect();
    let mut tracker = BodyTracker::new(TrackerConfig::default(), camera.intrinsics).unwrap();
    let (mut all, mut steps) = (Vec::new(), Step::ALL.map(|_| Vec::new()));
    let (mut found, mut cpu) = (0, 0.0);
    for (number, image) in images.iter().enumerate() {
        let at = number as f64 / RATE_HZ;
        let (began, before) = (Instant::now(), cpu_ms());
        let bodies = tracker.track(image, (at * 1e9) as i64).unwrap();
        if at < SKIP_S {
            continue;
        }
        all.push(began.elapsed().as_secs_f64() * 1e3);
        cpu += cpu_ms() - before;
        found += bodies.len();
        for (step, times) in Step::ALL.into_iter().zip(&mut steps) {
            times.push(tracker.steps().took(step).as_secs_f64() * 1e3);
        }
    }
    let counted = all.len() as f64;
    let mut line = format!(
        "{:>4} x {:<4} {people:>5} {:>5.1}",
        camera.intrinsics.width,
        camera.intrinsics.height,
        found as f64 / counted
    );
    for times in &mut steps {
        line += &format!(" {:>9.2}", at(times, 0.5));
    }
    let (median, cpu) = (at(&mut all, 0.5), cpu / counted);
    println!(
        "{line} {median:>8.2} {:>8.2} {cpu:>8.2} {:>6.2} {:>6.0}",
        at(&mut all, 0.95),
        median / reference,
        cpu * RATE_HZ / 10.0
    );
}

/// One run of the body's network on one crop of nobody, ms: the median.
fn reference_ms() -> f64 {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("data/depth-joints.toml");
    let file = NetworkFile::read(&path).unwrap();
    let mut network = Network::open(&file, &TrackerConfig::default().models).unwrap();
    *network.input("crop").unwrap() = vec![0.25; CHANNELS * SIZE * SIZE];
    let mut times: Vec<f64> = (0..TIMED)
        .map(|_| {
            let began = Instant::now();
            network.run(1).unwrap();
            began.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    at(&mut times, 0.5)
}

fn at(times: &mut [f64], share: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    times[((times.len() - 1) as f64 * share) as usize]
}

/// What all threads of this process were given of the processor so far, ms; 0 where the system does not tell.
fn cpu_ms() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let given = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    given.sum::<f64>() * 1e-6
}
