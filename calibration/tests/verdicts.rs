//! What the verdict says of walks that went wrong: never `passed`, the cause by name, and what to do about it.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{Errors, Random, Scene, eight, other_eight};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use posefuse_calibration::{
    CalibrationError, Cause, Options, SensorWalk, Solution, Verdict, Walk, solve,
};
use posefuse_skeleton::{Confidence, Position};

/// A walk of 24 s before three sensors, of which `s1` is spoilt.
fn spoilt(seed: u64, spoil: impl Fn(&mut SensorWalk)) -> Walk {
    let (mut walk, _) = Scene::ring(3, 24.0, Errors::USUAL, seed).record();
    spoil(&mut walk.sensors[1]);
    walk
}

fn positions(sensor: &mut SensorWalk, change: impl Fn(f64, Vector3<f64>) -> Vector3<f64>) {
    for frame in &mut sensor.frames {
        for body in &mut frame.bodies {
            for (_, joint) in body.joints.iter_mut() {
                let moved = change(frame.time.seconds(), joint.position.vector());
                joint.position = Position::from_vector(moved);
            }
        }
    }
}

fn exchange_labels(sensor: &mut SensorWalk) {
    for body in sensor.frames.iter_mut().flat_map(|frame| &mut frame.bodies) {
        let joints = body.joints.iter();
        body.joints = joints
            .map(|(joint, seen)| (joint.mirrored(), *seen))
            .collect();
    }
}

/// The solution, and its reasons that are more than a note, worst first.
fn judged(walk: &Walk) -> (Solution, Vec<String>) {
    let solution = solve(walk, &Options::default()).unwrap();
    let reasons = solution.report.reasons.iter();
    let reasons = reasons.filter(|reason| reason.severity > Verdict::Passed);
    let reasons = reasons
        .map(|r| format!("{}: {} -> {}", r.severity, r.what, r.remedy))
        .collect();
    (solution, reasons)
}

/// The cause, from an error or from the first reason.
fn told(walk: &Walk) -> String {
    match solve(walk, &Options::default()) {
        Err(error) => error.to_string(),
        Ok(_) => {
            let (solution, reasons) = judged(walk);
            assert!(solution.report.verdict > Verdict::Passed, "it passed");
            reasons[0].clone()
        }
    }
}

#[test]
fn a_mirrored_picture_is_called_by_its_name() {
    for exchanged in [false, true] {
        let told = told(&spoilt(31, |sensor| {
            positions(sensor, |_, p| Vector3::new(-p.x, p.y, p.z));
            if exchanged {
                exchange_labels(sensor);
            }
        }));
        assert!(
            told.contains("the picture of `s1` is mirrored") && told.contains("turn mirroring off"),
            "{told}"
        );
    }
}

#[test]
fn exchanged_labels_are_seen_in_who_comes_towards_the_sensor() {
    let (solution, reasons) = judged(&spoilt(32, exchange_labels));
    assert_eq!(solution.report.verdict, Verdict::Weak, "{reasons:?}");
    assert!(
        reasons[0].contains("`s1` exchanges left and right") && reasons.len() == 1,
        "{reasons:?}"
    );
}

#[test]
fn a_clock_that_is_seconds_off_is_told_with_its_side() {
    for (late_ns, side) in [(2_000_000_000, "ahead"), (-2_000_000_000, "behind")] {
        let told = told(&spoilt(33, |sensor| {
            for frame in &mut sensor.frames {
                frame.time = frame.time.plus_ns(late_ns);
            }
        }));
        assert!(
            told.contains(&format!("the clock of `s1` is 2.0 s {side}"))
                && told.contains("restart its agent"),
            "{told}"
        );
    }
}

#[test]
fn wrong_units_are_told_from_wrong_lenses() {
    for (factor, unit) in [
        (1000.0, "millimetres"),
        (39.37, "inches"),
        (3.281, "feet"),
        (0.0254, "larger"),
    ] {
        let error = solve(
            &spoilt(34, |s| positions(s, |_, p| p * factor)),
            &Options::default(),
        );
        let told = error.unwrap_err().to_string();
        assert!(
            told.contains("`s1` sees people") && told.contains(unit),
            "{told}"
        );
    }
    let (solution, reasons) = judged(&spoilt(34, |s| positions(s, |_, p| p * 1.0936)));
    assert!(solution.report.verdict > Verdict::Passed);
    assert!(
        reasons
            .iter()
            .any(|r| r.contains("`s1` sees the same way 1.09 times as long")),
        "{reasons:?}"
    );
}

#[test]
fn a_sensor_upside_down_is_solved_and_told() {
    let (solution, reasons) = judged(&spoilt(35, |sensor| {
        positions(sensor, |_, p| Vector3::new(-p.x, -p.y, p.z));
    }));
    assert_eq!(solution.report.verdict, Verdict::Weak, "{reasons:?}");
    assert!(reasons[0].contains("`s1` hangs upside down"), "{reasons:?}");
}

#[test]
fn a_small_bump_is_told_with_its_sensor_and_time() {
    let bumped = Isometry3::from_parts(
        Translation3::new(0.03, 0.0, 0.02),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 2.5_f64.to_radians(), 0.0)),
    );
    let walk = spoilt(36, |sensor| {
        positions(sensor, |t, p| {
            if t < 1012.0 {
                p
            } else {
                bumped.transform_point(&p.into()).coords
            }
        });
    });
    let (solution, reasons) = judged(&walk);
    assert!(solution.report.verdict > Verdict::Passed);
    let told = reasons
        .iter()
        .find(|r| r.contains("`s1` moved during the walk"))
        .unwrap_or_else(|| panic!("{reasons:?}"));
    let at = told.split("about ").nth(1).unwrap();
    let at: f64 = at.split(' ').next().unwrap().parse().unwrap();
    assert!((9.0..=15.0).contains(&at), "{told}");
    let (solution, reasons) = judged(&spoilt(36, |_| ()));
    assert_eq!(solution.report.verdict, Verdict::Passed, "{reasons:?}");
}

#[test]
fn sensors_that_follow_different_people_are_told_apart() {
    let scene = Scene {
        people: vec![eight, other_eight],
        ..Scene::ring(3, 24.0, Errors::USUAL, 37)
    };
    let (mut walk, _) = scene.record();
    for (index, sensor) in walk.sensors.iter_mut().enumerate() {
        for frame in &mut sensor.frames {
            frame.bodies.remove(usize::from(index != 1));
        }
    }
    let error = solve(&walk, &Options::default()).unwrap_err();
    let strangers = |error: &CalibrationError| match error {
        CalibrationError::Disconnected {
            cause: Cause::Strangers { sensors, .. },
            ..
        } => sensors.iter().any(|name| name == "s1"),
        _ => false,
    };
    assert!(strangers(&error), "{error}");
    assert!(
        error.to_string().contains("let one person walk alone"),
        "{error}"
    );
}

#[test]
fn several_people_are_used_and_noted() {
    let scene = Scene {
        people: vec![eight, other_eight],
        ..Scene::ring(3, 24.0, Errors::USUAL, 38)
    };
    let (solution, reasons) = judged(&scene.record().0);
    assert_eq!(solution.report.verdict, Verdict::Passed, "{reasons:?}");
    let notes = &solution.report.reasons;
    assert!(
        notes
            .iter()
            .any(|r| r.what.contains("more than one person")),
        "{notes:?}"
    );
}

#[test]
fn sparse_frames_and_sensors_that_left_are_told() {
    let mut random = Random(9);
    let (mut walk, _) = Scene::ring(2, 24.0, Errors::USUAL, 39).record();
    walk.sensors[1].frames.retain(|_| random.unit() < 0.03);
    let told = solve(&walk, &Options::default()).unwrap_err().to_string();
    assert!(
        told.contains("`s1` sends") && told.contains("frames a second"),
        "{told}"
    );

    let walk = spoilt(40, |sensor| {
        sensor.frames.retain(|frame| frame.time.seconds() < 1016.0);
    });
    let (solution, _) = judged(&walk);
    let notes = &solution.report.reasons;
    assert!(
        notes
            .iter()
            .any(|r| r.what.contains("`s1` sent nothing in the last 8 s") && r.sensors == ["s1"]),
        "{notes:?}"
    );
}

#[test]
fn a_take_without_a_walk_says_what_to_do() {
    let (mut walk, _) = Scene::ring(2, 3.0, Errors::USUAL, 41).record();
    for frame in walk
        .sensors
        .iter_mut()
        .flat_map(|sensor| &mut sensor.frames)
    {
        frame.bodies.clear();
    }
    let told = solve(&walk, &Options::default()).unwrap_err().to_string();
    assert!(
        told.contains("`s0`, `s1` saw nobody") && told.contains("point it at"),
        "{told}"
    );

    let (mut walk, _) = Scene::ring(2, 3.0, Errors::USUAL, 41).record();
    let joints = walk.sensors[0]
        .frames
        .iter_mut()
        .flat_map(|f| &mut f.bodies);
    for (_, joint) in joints.flat_map(|body| body.joints.iter_mut()) {
        joint.confidence = Confidence::NONE;
    }
    let told = solve(&walk, &Options::default()).unwrap_err().to_string();
    assert!(told.contains("`s0` saw nobody"), "{told}");
}
