//! What the bundle finds besides poses, and what it leaves alone: clock drift, joint definitions, covariances, sensors that
//! are held, a floor set by hand.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

#[path = "common/simulated.rs"]
mod simulated;

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use posefuse_calibration::{CalibrationError, HandFloor, Options, Solution, Walk, solve};
use posefuse_simulator::{Layout, Scenario, SensorErrors, World};
use posefuse_skeleton::{Joint, JointSet, SensorPose};
use simulated::{pair_errors, record};

fn room(scenario: &Scenario, seconds: f64) -> (Arc<World>, Walk) {
    let world = Arc::new(World::new(scenario).unwrap());
    let walk = record(&world, seconds);
    (world, walk)
}

fn pose(solution: &Solution, name: &str) -> Isometry3<f64> {
    *solution.calibration.sensors[name]
        .room_from_sensor
        .isometry()
}

fn worst_mm(world: &World, solution: &Solution, seconds: f64) -> f64 {
    let errors = pair_errors(world, &solution.calibration, seconds);
    errors.iter().map(|(_, e)| e.volume_mm).fold(0.0, f64::max)
}

#[test]
fn clocks_that_drift_are_found_on_long_walks_only() {
    let scenario = Scenario {
        sensors: 3,
        layout: Layout::Arc,
        errors: SensorErrors {
            clock_offset_ms: 40.0,
            clock_drift_ppm: 150.0,
            field_of_view: true,
            ..SensorErrors::none()
        },
        ..Scenario::default()
    };
    let (world, mut walk) = room(&scenario, 64.0);
    let solution = solve(&walk, &Options::default()).unwrap();
    let truth: Vec<f64> = (0..3).map(|i| world.sensor_clock(i).drift_ppm).collect();
    let mean = truth.iter().sum::<f64>() / 3.0;
    for (row, truth) in solution.report.sensors.iter().zip(&truth) {
        let found = row.clock_drift_ppm.unwrap();
        assert!(
            (found - (truth - mean)).abs() < 5.0,
            "{found} for {} ppm",
            truth - mean
        );
    }
    for sensor in &mut walk.sensors {
        sensor.frames.truncate(600);
    }
    let solution = solve(&walk, &Options::default()).unwrap();
    assert!(
        solution
            .report
            .sensors
            .iter()
            .all(|row| row.clock_drift_ppm.is_none())
    );
}

#[test]
fn trackers_that_mean_other_points_are_told_apart_and_agree_afterwards() {
    let scenario = Scenario {
        seed: 3,
        other_models: 1,
        ..Scenario::default()
    };
    let (world, mut walk) = room(&scenario, 30.0);
    let unaware = solve(&walk, &Options::default()).unwrap();
    for (index, sensor) in walk.sensors.iter_mut().enumerate() {
        sensor.joint_set = Some(if world.is_other_model(index) {
            JointSet::AzureKinect
        } else {
            JointSet::KinectV2
        });
    }
    let solution = solve(&walk, &Options::default()).unwrap();
    let found = &solution.calibration.joint_offsets_m[&JointSet::AzureKinect];
    let mut off: Vec<f64> = world
        .true_joint_offsets_m()
        .iter()
        .filter_map(|(joint, truth)| Some((found[joint]? - truth).norm() * 1e3))
        .collect();
    off.sort_by(f64::total_cmp);
    let (median, aware, before) = (
        off[off.len() / 2],
        worst_mm(&world, &solution, 30.0),
        worst_mm(&world, &unaware, 30.0),
    );
    println!("definitions {median:.1} mm off, poses {aware:.1} mm, {before:.1} without joint sets");
    assert!(off.len() > 15 && median < 15.0, "{off:?}");
    assert!(aware < 20.0 && aware < before, "{aware} {before}");
    let note = |s: &Solution| {
        s.report
            .reasons
            .iter()
            .any(|r| r.what.contains("azure-kinect"))
    };
    assert!(note(&solution) && !note(&unaware));
    assert!(unaware.calibration.joint_offsets_m.is_empty());
}

#[test]
fn errors_lie_within_what_is_said_of_them() {
    let (mut inside, mut of, mut sizes) = (0, 0, Vec::new());
    for seed in 1..=4 {
        let scenario = Scenario {
            seed,
            sensors: 3,
            ..Scenario::default()
        };
        let (world, walk) = room(&scenario, 15.0);
        let solution = solve(&walk, &Options::default()).unwrap();
        assert_eq!(solution.report.covariance.len(), 3);
        // Turns against the mean turn of all sensors, in sigmas.
        let turns: Vec<Vector3<f64>> = (0..3)
            .map(|i| {
                let relative = |s: usize| {
                    let found = pose(&solution, world.sensor_name(s));
                    world.room_from_sensor(s).isometry() * found.inverse()
                };
                (relative(0).inverse() * relative(i)).rotation.scaled_axis()
            })
            .collect();
        let mean = turns.iter().sum::<Vector3<f64>>() / 3.0;
        for (turn, row) in turns.iter().zip(&solution.report.sensors) {
            let sigma = row.sigma.unwrap();
            assert!(sigma.position_m > 0.0 && sigma.time_s > 0.0);
            let ratio = (turn - mean).norm() / sigma.rotation_rad;
            inside += u32::from(ratio < 3.0);
            of += 1;
            sizes.push(ratio);
        }
    }
    sizes.sort_by(f64::total_cmp);
    assert!(
        inside * 4 >= of * 3,
        "{inside} of {of} within three sigmas: {sizes:?}"
    );
    assert!(
        sizes[sizes.len() / 2] > 0.15,
        "the bound says nothing: {sizes:?}"
    );
}

#[test]
fn a_sensor_is_placed_anew_beside_others_that_do_not_move() {
    let scenario = Scenario {
        sensors: 3,
        seed: 2,
        ..Scenario::default()
    };
    let (world, walk) = room(&scenario, 20.0);
    let before = solve(&walk, &Options::default()).unwrap();
    let mut fixed = before.calibration.sensors.clone();
    fixed.remove("sim2");
    let options = Options {
        held_ray_bias_m: before.calibration.ray_bias_m.clone(),
        fixed,
        ..Options::default()
    };
    let after = solve(&walk, &options).unwrap();
    let place = |pose: &SensorPose| (pose.room_from_sensor, pose.time_offset_ns);
    for name in ["sim1", "sim3"] {
        let [old, new] = [&before, &after].map(|s| place(&s.calibration.sensors[name]));
        assert_eq!(old, new, "{name}");
    }
    assert_eq!(after.calibration.ray_bias_m, before.calibration.ray_bias_m);
    let moved = pose(&before, "sim2").inverse() * pose(&after, "sim2");
    assert!(moved.translation.vector.norm() < 0.02, "{moved}");
    assert!(moved.rotation.angle().to_degrees() < 0.3, "{moved}");
    let [old, new] = [&before, &after].map(|s| s.calibration.sensors["sim2"].time_offset_ns);
    assert!((old - new).abs() < 3_000_000, "{old} {new} ns");
    let covariances: Vec<_> = after
        .report
        .covariance
        .iter()
        .map(|c| c.name.as_str())
        .collect();
    assert_eq!(covariances, ["sim2"], "what is held is known");
    assert!(worst_mm(&world, &after, 20.0) < 30.0);
}

#[test]
fn a_floor_set_by_hand_is_the_floor() {
    let scenario = Scenario {
        sensors: 2,
        layout: Layout::Arc,
        ..Scenario::default()
    };
    let (world, walk) = room(&scenario, 12.0);
    let truth = *world.room_from_sensor(1).isometry();
    let up = truth.rotation.inverse() * Vector3::z();
    let looks = truth.rotation * Vector3::z();
    let by_hand = HandFloor {
        sensor: "sim2".to_owned(),
        up: Some([up.x * 9.81, up.y * 9.81, up.z * 9.81]),
        height_m: Some(truth.translation.z),
        at_m: Some([truth.translation.x, truth.translation.y]),
        looks_deg: Some(looks.y.atan2(looks.x).to_degrees()),
    };
    let with = |floor: HandFloor| {
        let options = Options {
            floor: Some(floor),
            ..Options::default()
        };
        solve(&walk, &options)
    };
    let found = pose(&with(by_hand.clone()).unwrap(), "sim2");
    let off = truth.inverse() * found;
    assert!(
        off.translation.vector.norm() < 1e-6 && off.rotation.angle() < 1e-6,
        "{off}"
    );
    // A height alone lifts the floor that the feet show.
    let height = HandFloor {
        height_m: Some(2.5),
        sensor: "sim1".to_owned(),
        ..HandFloor::default()
    };
    let found = pose(&with(height).unwrap(), "sim1");
    assert!((found.translation.z - 2.5).abs() < 1e-9);
    for wrong in [
        HandFloor {
            sensor: "door".to_owned(),
            ..by_hand.clone()
        },
        HandFloor {
            up: Some([0.0; 3]),
            ..by_hand.clone()
        },
        HandFloor {
            height_m: Some(f64::NAN),
            ..by_hand
        },
    ] {
        assert!(matches!(with(wrong), Err(CalibrationError::HandFloor(_))));
    }
}

#[test]
fn joints_that_were_seen_have_a_ray_bias_near_the_truth() {
    let scenario = Scenario {
        seed: 4,
        ..Scenario::default()
    };
    let (world, walk) = room(&scenario, 30.0);
    let solution = solve(&walk, &Options::default()).unwrap();
    let (found, truth) = (&solution.calibration.ray_bias_m, world.true_ray_bias_m());
    let mut off: Vec<f64> = Joint::ALL
        .into_iter()
        .map(|joint| (found[joint].unwrap() - truth[joint].unwrap()).abs() * 1e3)
        .collect();
    off.sort_by(f64::total_cmp);
    assert!(off[12] < 5.0, "median {:.1} mm off: {off:?}", off[12]);
}
