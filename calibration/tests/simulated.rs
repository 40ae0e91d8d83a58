//! The project's own simulator: occlusion, guessed joints, missing joints, swaps, spikes, false clocks.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::sync::Arc;

use posefuse_calibration::{Options, Verdict, Walk, WalkBody, WalkFrame, WalkJoint, solve};
use posefuse_simulator::{Layout, Scenario, SimSensor, World};
use posefuse_skeleton::{JointSet, Position, Room, Sensor, Timestamp, Transform};

fn record(world: &Arc<World>, seconds: f64) -> Walk {
    let mut walk = Walk::default();
    for index in 0..world.sensor_count() {
        let mut sensor = SimSensor::new(Arc::clone(world), index);
        let frames = &mut walk.sensor_mut(world.sensor_name(index)).frames;
        while (sensor.next_at_ns() as f64) < seconds * 1e9 {
            let frame = sensor.next_frame();
            let body = |body: &posefuse_simulator::SimBody| WalkBody {
                tracking_id: body.tracking_id,
                joints: JointSet::KinectV2
                    .to_canonical(&body.joints)
                    .map(|_, joint| WalkJoint {
                        position: joint.position,
                        confidence: joint.confidence,
                    }),
            };
            if !frame.dropped {
                frames.push(WalkFrame {
                    // The worst case: nobody has mapped the agents' clocks.
                    time: Timestamp::from_ns(frame.captured.ns()),
                    bodies: frame.bodies.iter().map(body).collect(),
                });
            }
        }
    }
    walk
}

/// RMS over the volume, metres, for every pair of sensors.
fn pair_errors(world: &World, solution: &posefuse_calibration::Solution) -> Vec<f64> {
    let found = |i: usize| solution.calibration.sensors[world.sensor_name(i)].room_from_sensor;
    let mut errors = Vec::new();
    for a in 0..world.sensor_count() {
        for b in a + 1..world.sensor_count() {
            let (mut squares, mut count) = (0.0, 0.0);
            for i in 0..125 {
                let [x, y, z] = [i % 5, i / 5 % 5, i / 25].map(f64::from);
                let point = Position::new(x * 0.75 - 1.5, y * 0.75 - 1.5, z * 0.5);
                let of_b = world.room_from_sensor(b).inverse().apply(point);
                let through = found(a).inverse().then(&found(b)).isometry() * of_b.point();
                let truth = world.room_from_sensor(a).inverse().apply(point).point();
                squares += (through - truth).norm_squared();
                count += 1.0;
            }
            errors.push(f64::sqrt(squares / count));
        }
    }
    errors
}

#[test]
fn simulated_rooms_are_calibrated() {
    for (layout, sensors, people) in [
        (Layout::Ring, 4, 1),
        (Layout::Arc, 3, 1),
        (Layout::Ring, 4, 2),
    ] {
        let mut all = Vec::new();
        for seed in 1..=2 {
            let scenario = Scenario {
                seed,
                sensors,
                people,
                layout,
                ..Scenario::default()
            };
            let world = Arc::new(World::new(&scenario).unwrap());
            let solution = solve(&record(&world, 30.0), &Options::default())
                .unwrap_or_else(|error| panic!("{layout:?} of {sensors}, seed {seed}: {error}"));
            let errors = pair_errors(&world, &solution);
            let median = solution
                .report
                .pairs
                .iter()
                .map(|p| p.median_mm)
                .fold(0.0, f64::max);
            let worst = errors.iter().copied().fold(0.0, f64::max) * 1e3;
            println!(
                "{layout:?} of {sensors}, {people} people, seed {seed}: {}, worst pair {worst:.1} mm off, worst residual {median:.1} mm, bias {:?}, floor {:.2}",
                solution.report.verdict,
                solution.report.ray_bias_mm,
                solution.report.floor.share_in_band
            );
            for reason in &solution.report.reasons {
                println!("    {}: {}", reason.severity, reason.what);
            }
            assert!(people > 1 || solution.report.verdict < Verdict::Failed);
            all.extend(errors);
        }
        all.sort_by(f64::total_cmp);
        let (median, worst) = (all[all.len() / 2], all[all.len() - 1]);
        println!(
            "{layout:?} of {sensors}, {people} people: volume RMS median {:.1} mm, worst {:.1} mm",
            median * 1e3,
            worst * 1e3
        );
        assert!(median < 0.04, "{all:?}");
    }
}

#[test]
fn a_lone_simulated_sensor_is_laid_on_its_floor() {
    for seed in 1..=3 {
        let scenario = Scenario {
            seed,
            sensors: 1,
            ..Scenario::default()
        };
        let world = Arc::new(World::new(&scenario).unwrap());
        let solution = solve(&record(&world, 20.0), &Options::default()).unwrap();
        let found = solution.calibration.sensors[world.sensor_name(0)].room_from_sensor;
        let truth = world.room_from_sensor(0);
        let up = |pose: &Transform<Room, Sensor>| pose.inverse().rotate(nalgebra::Vector3::z());
        let tilt = up(&found).angle(&up(&truth)).to_degrees();
        let height = found.origin().vector().z - truth.origin().vector().z;
        println!(
            "seed {seed}: {}, tilted by {tilt:.2} degrees, {:.0} mm too high",
            solution.report.verdict,
            height * 1e3
        );
        for reason in &solution.report.reasons {
            println!("    {}: {}", reason.severity, reason.what);
        }
        assert!(solution.report.verdict < Verdict::Failed);
        assert!(
            tilt < 3.0 && height.abs() < 0.1,
            "{tilt} degrees, {height} m"
        );
    }
}
