//! Seconds to calibrate, and how far off the answer is, beside plain single-shot SVD in the same run.
//!
//! `cargo bench -p posefuse-calibration`. Plain SVD: for each sensor one Kabsch fit of every joint of nearest frames
//! onto the first sensor, no weights, no labels, no time offset, as the papers of this field do it.

#[path = "../tests/common/mod.rs"]
mod common;

use std::collections::BTreeMap;
use std::time::Instant;

use common::{Errors, Scene, middle, pair_errors};
use posefuse_calibration::{Options, PointPair, Walk, kabsch, solve};
use posefuse_skeleton::{Calibration, FloorSource, Room, Sensor, SensorPose, Transform};

const SEEDS: u64 = 5;

fn main() {
    println!(
        "4 sensors in a ring, {SEEDS} seeds; volume RMS error in mm, median over pairs and seeds"
    );
    println!(
        "{:>6} {:>10} {:>10} {:>12} {:>12} {:>8}",
        "walk", "solve mm", "SVD mm", "solve s", "SVD s", "ratio"
    );
    for seconds in [10.0, 30.0] {
        let (mut ours, mut plain) = (Vec::new(), Vec::new());
        let (mut ours_s, mut plain_s) = (0.0, 0.0);
        for seed in 1..=SEEDS {
            let scene = Scene::ring(4, seconds, Errors::USUAL, seed);
            let (walk, _) = scene.record();
            let start = Instant::now();
            match solve(&walk, &Options::default()) {
                Ok(solution) => ours.extend(pair_errors(&solution.calibration, &scene.sensors)),
                Err(error) => println!("seed {seed}: {error}"),
            }
            ours_s += start.elapsed().as_secs_f64() / SEEDS as f64;
            let start = Instant::now();
            let calibration = single_shot(&walk);
            plain_s += start.elapsed().as_secs_f64() / SEEDS as f64;
            plain.extend(pair_errors(&calibration, &scene.sensors));
        }
        println!(
            "{seconds:>4.0} s {:>10.1} {:>10.1} {ours_s:>12.3} {plain_s:>12.4} {:>8.0}",
            middle(&mut ours) * 1e3,
            middle(&mut plain) * 1e3,
            ours_s / plain_s
        );
    }
}

fn single_shot(walk: &Walk) -> Calibration {
    let first = &walk.sensors[0];
    let mut sensors = BTreeMap::new();
    for sensor in &walk.sensors {
        let mut pairs: Vec<PointPair<Room, Sensor>> = Vec::new();
        for frame in &sensor.frames {
            let next = first.frames.partition_point(|f| f.time < frame.time);
            let nearest = first.frames[next.saturating_sub(1)..].iter().take(2);
            let nearest = nearest.min_by_key(|f| f.time.since_ns(frame.time).abs());
            let Some(other) = nearest else { continue };
            for (joint, from) in frame.bodies[0].joints.iter() {
                if let Some(to) = &other.bodies[0].joints[joint] {
                    let to = Transform::<Room, Sensor>::identity().apply(to.position);
                    pairs.push(PointPair {
                        to,
                        from: from.position,
                        weight: 1.0,
                    });
                }
            }
        }
        let pose = SensorPose {
            room_from_sensor: kabsch(&pairs)
                .expect("a walk is not degenerate")
                .to_from_from,
            time_offset_ns: 0,
            residual_median_m: 0.0,
            residual_p95_m: 0.0,
            samples: pairs.len() as u64,
            ..SensorPose::default()
        };
        sensors.insert(sensor.name.clone(), pose);
    }
    Calibration {
        created: String::new(),
        method: "single-shot".to_owned(),
        floor: FloorSource::Assumed,
        sensors,
        ..Calibration::default()
    }
}
