//! Walks with a known truth: what `solve` recovers, and what it refuses to call good.

mod common;

use common::{
    Errors, Scene, eight, line, looking, middle, other_eight, pair_errors, ring, standing,
};
use posefuse_calibration::{CalibrationError, Cause, Options, Solution, Verdict, Walk, solve};

fn options() -> Options {
    Options {
        created: "2024-05-01T12:00:00Z".to_owned(),
        ..Options::default()
    }
}

fn reasons(solution: &Solution) -> String {
    let lines = solution.report.reasons.iter();
    lines
        .map(|r| format!("{}: {} -> {}\n", r.severity, r.what, r.remedy))
        .collect()
}

#[test]
fn exact_data_is_solved_exactly() {
    let scene = Scene::ring(3, 20.0, Errors::NONE, 1);
    // Without errors there is no skin between joint and sensor either.
    let options = Options {
        ray_bias: false,
        ..options()
    };
    let solution = solve(&scene.record().0, &options).unwrap();
    let worst = pair_errors(&solution.calibration, &scene.sensors)
        .into_iter()
        .fold(0.0, f64::max);
    // What is left is linear interpolation between frames.
    assert!(worst < 0.001, "{} mm", worst * 1e3);
    assert_eq!(
        solution.report.verdict,
        Verdict::Passed,
        "{}",
        reasons(&solution)
    );
}

#[test]
fn a_ring_of_four_is_found_in_spite_of_errors() {
    let mut all = Vec::new();
    for seed in 1..=4 {
        let scene = Scene::ring(4, 30.0, Errors::USUAL, seed);
        let (walk, offsets) = scene.record();
        let solution = solve(&walk, &options()).unwrap();
        let errors = pair_errors(&solution.calibration, &scene.sensors);
        assert!(errors.iter().all(|e| *e < 0.04), "{errors:?}");
        all.extend(errors);
        assert_eq!(
            solution.report.verdict,
            Verdict::Passed,
            "{}",
            reasons(&solution)
        );
        let offsets_ns = solution
            .calibration
            .sensors
            .values()
            .map(|p| p.time_offset_ns);
        assert_eq!(
            offsets_ns.max(),
            Some(0),
            "no frame is moved into the future"
        );
        for (name, pose) in &solution.calibration.sensors {
            let of_root = solution.calibration.sensors["s0"].time_offset_ns;
            let truth = offsets[name] - offsets["s0"];
            let found = (pose.time_offset_ns - of_root) as f64 * 1e-9;
            assert!(
                (found - truth).abs() < 0.004,
                "{name}: {found} for {truth} s"
            );
        }
    }
    println!(
        "ring of 4, 30 s: median volume RMS error {:.1} mm",
        middle(&mut all) * 1e3
    );
}

#[test]
fn the_floor_is_where_the_feet_stand() {
    let scene = Scene::ring(4, 30.0, Errors::USUAL, 5);
    let solution = solve(&scene.record().0, &options()).unwrap();
    let first = scene.sensors["s0"].translation.vector;
    for (name, truth) in &scene.sensors {
        let found = solution.calibration.sensors[name]
            .room_from_sensor
            .origin()
            .vector();
        let off = found.z - truth.translation.vector.z;
        assert!(off.abs() < 0.04, "{name} stands {off} m too high");
        let distance = (truth.translation.vector - first).xy().norm();
        let root = solution.calibration.sensors["s0"]
            .room_from_sensor
            .origin()
            .vector();
        assert!(((found - root).xy().norm() - distance).abs() < 0.03);
    }
    let root = solution.calibration.sensors["s0"]
        .room_from_sensor
        .origin()
        .vector();
    assert!(
        root.y.abs() < 1e-9 && root.x > 2.0,
        "X points to the root sensor: {root:?}"
    );
    assert!(solution.report.floor.share_in_band > 0.95);
}

#[test]
fn two_people_are_told_apart() {
    let scene = Scene {
        people: vec![eight, other_eight],
        ..Scene::ring(3, 30.0, Errors::USUAL, 6)
    };
    let solution = solve(&scene.record().0, &options()).unwrap();
    let errors = pair_errors(&solution.calibration, &scene.sensors);
    assert!(errors.iter().all(|e| *e < 0.04), "{errors:?}");
}

#[test]
fn neither_order_nor_root_changes_the_relations() {
    let scene = Scene::ring(3, 15.0, Errors::USUAL, 7);
    let (mut walk, _) = scene.record();
    let first = solve(&walk, &options()).unwrap();
    walk.sensors.rotate_left(1);
    walk.sensors[0].frames.reverse();
    assert_eq!(solve(&walk, &options()).unwrap(), first);
    let other = solve(
        &walk,
        &Options {
            root: Some("s2".to_owned()),
            ..options()
        },
    )
    .unwrap();
    let relation = |solution: &Solution, a: &str, b: &str| {
        let of = |name: &str| {
            *solution.calibration.sensors[name]
                .room_from_sensor
                .isometry()
        };
        of(a).inverse() * of(b)
    };
    for (a, b) in [("s0", "s1"), ("s1", "s2"), ("s0", "s2")] {
        let apart = relation(&first, a, b).inverse() * relation(&other, a, b);
        assert!(apart.translation.vector.norm() < 1e-9 && apart.rotation.angle() < 1e-9);
    }
    let offset =
        |solution: &Solution, name: &str| solution.calibration.sensors[name].time_offset_ns;
    for name in ["s0", "s1", "s2"] {
        assert!((offset(&first, name) - offset(&other, name)).abs() < 1000);
    }
    assert!(
        other.calibration.sensors["s2"]
            .room_from_sensor
            .origin()
            .vector()
            .y
            .abs()
            < 1e-9
    );
}

#[test]
fn sensors_that_share_no_view_are_joined_through_others() {
    let mut scene = Scene::ring(3, 24.0, Errors::USUAL, 8);
    scene.sensors = ring(3, 120.0);
    let (mut walk, _) = scene.record();
    // s0 sees the first two thirds, s2 the last two thirds but nothing of what s0 sees.
    let keep = |walk: &mut posefuse_calibration::Walk, name: &str, from: f64, to: f64| {
        walk.sensor_mut(name)
            .frames
            .retain(|f| (1000.0 + from..1000.0 + to).contains(&f.time.seconds()));
    };
    keep(&mut walk, "s0", 0.0, 11.5);
    keep(&mut walk, "s2", 12.0, 24.0);
    let solution = solve(&walk, &options()).unwrap();
    let errors = pair_errors(&solution.calibration, &scene.sensors);
    assert!(errors.iter().all(|e| *e < 0.06), "{errors:?}");
    assert_eq!(solution.report.pairs.len(), 2);
    assert!(solution.report.pairs.iter().all(|pair| pair.in_tree));
}

#[test]
fn separate_groups_are_named() {
    let scene = Scene::ring(4, 24.0, Errors::USUAL, 9);
    let (mut walk, _) = scene.record();
    for (index, sensor) in walk.sensors.iter_mut().enumerate() {
        let first_half = index % 2 == 0;
        sensor
            .frames
            .retain(|f| (f.time.seconds() < 1011.9) == first_half);
    }
    // The second half of the walk starts after the first has ended.
    walk.sensors
        .iter_mut()
        .skip(1)
        .step_by(2)
        .for_each(|s| s.frames.retain(|f| f.time.seconds() > 1012.1));
    let error = solve(&walk, &options()).unwrap_err();
    let groups = vec![
        vec!["s0".to_owned(), "s2".to_owned()],
        vec!["s1".to_owned(), "s3".to_owned()],
    ];
    let cause = Cause::Apart;
    assert_eq!(error, CalibrationError::Disconnected { groups, cause });
    assert!(
        error.to_string().contains("(`s0`, `s2`) and (`s1`, `s3`)"),
        "{error}"
    );
}

#[test]
fn standing_still_fails() {
    let scene = Scene {
        people: vec![standing],
        ..Scene::ring(3, 30.0, Errors::USUAL, 10)
    };
    let solution = solve(&scene.record().0, &options()).unwrap();
    assert_eq!(solution.report.verdict, Verdict::Failed);
    assert!(
        reasons(&solution).contains("hardly moved"),
        "{}",
        reasons(&solution)
    );
}

#[test]
fn a_report_survives_json() {
    let scene = Scene::ring(2, 8.0, Errors::USUAL, 16);
    let solution = solve(&scene.record().0, &options()).unwrap();
    let text = serde_json::to_string(&solution.report).unwrap();
    let read: posefuse_calibration::Report = serde_json::from_str(&text).unwrap();
    assert_eq!(read.reasons, solution.report.reasons);
    assert_eq!(read.sensors.len(), 2);
    assert!(text.contains("\"verdict\":\"weak\""), "{text}");
}

#[test]
fn too_few_frames_fail() {
    let scene = Scene::ring(3, 2.0, Errors::USUAL, 11);
    let solution = solve(&scene.record().0, &options()).unwrap();
    assert_eq!(solution.report.verdict, Verdict::Failed);
    assert!(
        reasons(&solution).contains("saw somebody together with another sensor for"),
        "{}",
        reasons(&solution)
    );
}

#[test]
fn one_line_does_not_pass() {
    let scene = Scene {
        people: vec![line],
        ..Scene::ring(3, 30.0, Errors::USUAL, 12)
    };
    let solution = solve(&scene.record().0, &options()).unwrap();
    assert!(solution.report.verdict > Verdict::Passed);
    assert!(
        reasons(&solution).contains("on one line"),
        "{}",
        reasons(&solution)
    );
}

#[test]
fn a_sensor_bumped_half_way_does_not_pass() {
    let scene = Scene::ring(3, 30.0, Errors::USUAL, 13);
    let (mut walk, _) = scene.record();
    let mut bumped = scene;
    let from = bumped.sensors["s1"].translation.vector;
    let moved = looking([from.x + 0.25, from.y - 0.1, from.z], [0.3, 0.2, 0.9]);
    bumped.sensors.insert("s1".to_owned(), moved);
    let (after, _) = bumped.record();
    let frames = &mut walk.sensors[1].frames;
    frames.retain(|f| f.time.seconds() < 1015.0);
    frames.extend(
        after.sensors[1]
            .frames
            .iter()
            .filter(|f| f.time.seconds() >= 1015.0)
            .cloned(),
    );
    let verdict = solve(&walk, &options()).map_or(Verdict::Failed, |s| s.report.verdict);
    assert!(verdict > Verdict::Passed);
}

/// Somebody who stands at first and walks then.
fn waiting(t: f64) -> nalgebra::Vector3<f64> {
    eight((t - 12.0).max(0.0))
}

#[test]
fn what_a_tracker_does_wrong_in_one_place_is_no_motion_of_the_sensor() {
    let scene = Scene {
        people: vec![waiting],
        ..Scene::ring(3, 30.0, Errors::USUAL, 13)
    };
    let (mut walk, _) = scene.record();
    for frame in walk.sensors[1].frames.iter_mut() {
        if frame.time.seconds() > 1012.0 {
            continue;
        }
        for body in &mut frame.bodies {
            for (_, joint) in body.joints.iter_mut() {
                joint.position = joint
                    .position
                    .moved(nalgebra::Vector3::new(0.07, 0.0, 0.05));
            }
        }
    }
    let solution = solve(&walk, &options()).unwrap();
    let reasons = reasons(&solution);
    assert!(!reasons.contains("moved during the walk"), "{reasons}");
}

#[test]
fn a_wrong_unit_a_mirrored_sensor_and_a_wrong_clock_do_not_pass() {
    use posefuse_skeleton::Position;
    type Spoil = fn(&mut posefuse_calibration::SensorWalk);
    let spoils: [(&str, Spoil); 3] = [
        ("unit", |sensor| each(sensor, |p| p * 1.3)),
        ("mirror", |sensor| {
            each(sensor, |p| nalgebra::Vector3::new(-p.x, p.y, p.z))
        }),
        ("clock", |sensor| {
            sensor
                .frames
                .iter_mut()
                .for_each(|f| f.time = f.time.plus_ns(2_000_000_000));
        }),
    ];
    fn each(
        sensor: &mut posefuse_calibration::SensorWalk,
        change: fn(nalgebra::Vector3<f64>) -> nalgebra::Vector3<f64>,
    ) {
        for body in sensor.frames.iter_mut().flat_map(|f| &mut f.bodies) {
            for (_, joint) in body.joints.iter_mut() {
                joint.position = Position::from_vector(change(joint.position.vector()));
            }
        }
    }
    for (what, spoil) in spoils {
        let scene = Scene::ring(3, 30.0, Errors::USUAL, 14);
        let (mut walk, _) = scene.record();
        spoil(&mut walk.sensors[1]);
        match solve(&walk, &options()) {
            Ok(solution) => assert!(solution.report.verdict > Verdict::Passed, "{what} passed"),
            Err(error) => assert!(
                matches!(error, CalibrationError::Disconnected { .. }),
                "{what}: {error}"
            ),
        }
    }
}

#[test]
fn what_cannot_be_solved_says_why() {
    let scene = Scene::ring(3, 10.0, Errors::USUAL, 15);
    let (walk, _) = scene.record();
    assert_eq!(
        solve(&Walk::default(), &options()),
        Err(CalibrationError::NoSensor)
    );
    let mut twice = walk.clone();
    twice.sensors[1].name = "s0".to_owned();
    assert_eq!(
        solve(&twice, &options()),
        Err(CalibrationError::DuplicateSensor("s0".to_owned()))
    );
    let mut blind = walk.clone();
    blind.sensors[2]
        .frames
        .iter_mut()
        .for_each(|f| f.bodies.clear());
    let error = solve(&blind, &options()).unwrap_err();
    assert_eq!(
        error,
        CalibrationError::NobodySeen {
            sensors: vec!["s2".to_owned()]
        }
    );
    let error = solve(
        &walk,
        &Options {
            root: Some("door".to_owned()),
            ..options()
        },
    )
    .unwrap_err();
    assert!(
        error.to_string().contains("`door`") && error.to_string().contains("`s0`, `s1`"),
        "{error}"
    );
}

#[test]
fn a_lone_sensor_is_laid_on_the_floor() {
    for seed in 1..=4 {
        let scene = Scene::ring(1, 30.0, Errors::USUAL, seed);
        let solution = solve(&scene.record().0, &options()).unwrap();
        let report = &solution.report;
        assert_eq!(report.verdict, Verdict::Passed, "{}", reasons(&solution));
        assert_eq!(report.reasons.len(), 1, "{}", reasons(&solution));
        assert!(report.reasons[0].what.contains("`s0` is the only sensor"));
        assert_eq!(
            (report.sensors[0].median_mm, report.ray_bias_mm),
            (0.0, None)
        );
        assert_eq!(solution.calibration.method, "floor");
        let found = *solution.calibration.sensors["s0"]
            .room_from_sensor
            .isometry();
        let truth = scene.sensors["s0"];
        let (at, true_at) = (found.translation.vector, truth.translation.vector);
        assert!(
            (at.z - true_at.z).abs() < 0.03,
            "{} for {} m",
            at.z,
            true_at.z
        );
        let up = |room_from_sensor: &nalgebra::Isometry3<f64>| {
            room_from_sensor.rotation.inverse() * nalgebra::Vector3::z()
        };
        let tilt = up(&found).angle(&up(&truth)).to_degrees();
        assert!(tilt < 1.5, "the floor is tilted by {tilt} degrees");
        assert!(
            at.x > 1.0 && at.y.abs() < 1e-9,
            "X points towards the sensor: {at:?}"
        );
    }
    let mut scene = Scene::ring(1, 30.0, Errors::USUAL, 1);
    scene.people = vec![standing];
    let solution = solve(&scene.record().0, &options()).unwrap();
    assert_eq!(
        solution.report.verdict,
        Verdict::Failed,
        "{}",
        reasons(&solution)
    );
    scene.people = vec![eight];
    scene.seconds = 2.0;
    let solution = solve(&scene.record().0, &options()).unwrap();
    assert!(
        reasons(&solution).contains("saw somebody for"),
        "{}",
        reasons(&solution)
    );
}
