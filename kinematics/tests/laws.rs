//! What must hold whatever people do: constant lengths, no flips, limits, no dependence on where the room's axes point.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod support;

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_kinematics::{Body, Config, RigPose, Solved, Solver, Start};
use posefuse_skeleton::{BONES, Joint, JointMap, Position, Room, Transform};
use support::{RATE_HZ, at, body, exact, is_finite, mean_error, noise, noisy, performance};

/// The configurations that every law is held against.
fn configs() -> Vec<Config> {
    let mut bones = Config::default();
    bones.fit.enabled = false;
    let mut skeleton = Config::default();
    skeleton.fit.start = Start::Skeleton;
    let mut bare = Config::default();
    bare.limits.enabled = false;
    bare.feet.enabled = false;
    bare.hold.enabled = false;
    bare.extra.spine = false;
    bare.extra.clavicles = false;
    bare.extra.fingers = false;
    bare.extra.toes = false;
    let mut gazing = Config::default();
    gazing.look.at = posefuse_kinematics::LookAt::Auto;
    vec![Config::default(), bones, skeleton, bare, gazing]
}

fn length(joints: &JointMap<Position<Room>>, a: Joint, b: Joint) -> f64 {
    joints[a].unwrap().distance(joints[b].unwrap())
}

#[test]
fn bones_have_one_length_and_joints_are_where_the_rig_places_them() {
    let person = performance(1);
    let body = body(&person);
    for config in configs() {
        let mut solver = Solver::new(&body, config);
        let mut shake = noise(0.02, 7);
        let mut lengths: Option<Vec<f64>> = None;
        for frame in 0..200 {
            let truth = person.pose(0, frame as f64 / RATE_HZ);
            let solved = solver
                .step(&noisy(&truth, 0.02, &mut shake), at(frame))
                .unwrap();
            let now: Vec<f64> = BONES
                .iter()
                .map(|bone| length(&solved.joints, bone.parent, bone.child))
                .collect();
            let before = lengths.get_or_insert_with(|| now.clone());
            for (a, b) in before.iter().zip(&now) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
            let placed = solver.rig().place(&solved.pose);
            for (bone, (origin, _)) in solver.rig().bones.iter().zip(placed) {
                if let Some(joint) = bone.joint {
                    let told = solved.joints[joint].unwrap();
                    assert!(told.distance(origin) < 1e-9, "{joint}");
                }
            }
        }
    }
}

/// A pose somewhere within everybody's range.
fn some_pose(body: &Body) -> RigPose {
    let rig = body.rig();
    let mut pose = rig.rest_pose(Position::new(0.4, -0.3, body.rest_height() - 0.1));
    let mut turn = |name: &str, axis: Vector3<f64>, degrees: f64| {
        let bone = rig.bones.iter().position(|bone| bone.name == name).unwrap();
        let turn = UnitQuaternion::from_scaled_axis(axis * f64::to_radians(degrees));
        pose.rotations[bone] *= turn;
    };
    turn("Hips", Vector3::z(), 130.0);
    turn("Chest", Vector3::y(), 15.0);
    turn("LeftUpperArm", Vector3::x(), -70.0);
    turn("LeftLowerArm", Vector3::z(), -80.0);
    turn("RightUpperArm", Vector3::x(), 60.0);
    turn("RightLowerArm", Vector3::z(), 40.0);
    turn("LeftUpperLeg", Vector3::y(), -40.0);
    turn("LeftLowerLeg", Vector3::y(), 60.0);
    turn("RightLowerLeg", Vector3::y(), 15.0);
    pose
}

#[test]
fn the_positions_of_a_pose_are_recovered() {
    let body = Body::of_height(1.8);
    let rig = body.rig();
    let joints: JointMap<Position<Room>> = rig
        .place(&some_pose(&body))
        .into_iter()
        .zip(&rig.bones)
        .filter_map(|((at, _), bone)| Some((bone.joint?, at)))
        .collect();
    let mut config = Config::default();
    config.feet.enabled = false;
    config.fit.floor_mm = 0.1;
    for (start, enabled) in [
        (Start::Previous, true),
        (Start::Skeleton, true),
        (Start::Skeleton, false),
    ] {
        config.fit.start = start;
        config.fit.enabled = enabled;
        let mut solver = Solver::new(&body, config.clone());
        let solved: Vec<Solved> = (0..5)
            .map(|frame| solver.step(&exact(&joints), at(frame)).unwrap())
            .collect();
        for joint in Joint::ALL {
            let off = solved[4].joints[joint]
                .unwrap()
                .distance(joints[joint].unwrap());
            assert!(off < 1e-3, "{start:?} {enabled} {joint}: {off}");
        }
        assert!(mean_error(&solved[4].joints, &joints) < 2e-4);
    }
}

#[test]
fn turning_the_room_turns_the_body_with_it() {
    let person = performance(2);
    let body = body(&person);
    // About the vertical: floors stay floors.
    let turned: Transform<Room, Room> = Transform::from_parts(
        Vector3::new(3.0, -1.0, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.3),
    );
    for config in configs() {
        let mut here = Solver::new(&body, config.clone());
        let mut there = Solver::new(&body, config);
        for frame in 0..120 {
            let truth = person.pose(0, frame as f64 / RATE_HZ);
            let a = here.step(&exact(&truth), at(frame)).unwrap();
            let truth = truth.map(|_, position| turned.apply(*position));
            let b = there.step(&exact(&truth), at(frame)).unwrap();
            for joint in Joint::ALL {
                let expected = turned.apply(a.joints[joint].unwrap());
                let off = expected.distance(b.joints[joint].unwrap());
                assert!(off < 1e-4, "frame {frame}, {joint}: {off}");
            }
            assert_eq!(a.contacts, b.contacts);
        }
    }
}

/// The axis about which the left elbow bends, room.
fn hinge(solver: &Solver, solved: &Solved) -> Vector3<f64> {
    let rig = solver.rig();
    let bone = rig
        .bones
        .iter()
        .position(|bone| bone.name == "LeftUpperArm")
        .unwrap();
    rig.place(&solved.pose)[bone].1 * -Vector3::z()
}

#[test]
fn a_straight_arm_that_moves_does_not_turn_over() {
    let body = Body::of_height(1.75);
    let rig = body.rig();
    let bone = |name: &str| rig.bones.iter().position(|bone| bone.name == name).unwrap();
    let (upper, lower) = (bone("LeftUpperArm"), bone("LeftLowerArm"));
    for config in configs().into_iter().filter(|config| config.hold.enabled) {
        let mut solver = Solver::new(&body, config);
        let mut shake = noise(0.012, 11);
        let mut before: Option<Vector3<f64>> = None;
        for frame in 0..300 {
            let time = frame as f64 / RATE_HZ;
            let mut pose = rig.rest_pose(Position::new(0.0, 0.0, body.rest_height()));
            // Down to the side, up and forwards, over and over, all but straight.
            let swing =
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -0.9 + 0.6 * time.sin())
                    * UnitQuaternion::from_axis_angle(
                        &Vector3::z_axis(),
                        -0.5 + 0.5 * (0.7 * time).sin(),
                    );
            pose.rotations[upper] = swing;
            pose.rotations[lower] = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.05);
            let joints = rig
                .place(&pose)
                .into_iter()
                .zip(&rig.bones)
                .filter_map(|((at, _), bone)| Some((bone.joint?, at)))
                .collect();
            let solved = solver
                .step(&noisy(&joints, 0.012, &mut shake), at(frame))
                .unwrap();
            let now = hinge(&solver, &solved);
            if let Some(before) = before {
                assert!(now.dot(&before) > 0.5, "frame {frame}: {before} {now}");
            }
            before = Some(now);
        }
    }
}

#[test]
fn limits_hold_against_what_nobody_can_do() {
    let body = Body::of_height(1.75);
    let rig = body.rig();
    let bone = |name: &str| rig.bones.iter().position(|bone| bone.name == name).unwrap();
    let mut pose = rig.rest_pose(Position::new(0.0, 0.0, body.rest_height()));
    let turn = |axis: Vector3<f64>, degrees: f64| {
        UnitQuaternion::from_scaled_axis(axis * f64::to_radians(degrees))
    };
    // An elbow and a knee bent backwards, a neck bent back to the shoulders.
    pose.rotations[bone("LeftLowerArm")] = turn(Vector3::z(), 50.0);
    pose.rotations[bone("RightLowerLeg")] = turn(Vector3::y(), -40.0);
    pose.rotations[bone("Neck")] = turn(Vector3::y(), -90.0);
    let joints: JointMap<Position<Room>> = rig
        .place(&pose)
        .into_iter()
        .zip(&rig.bones)
        .filter_map(|((at, _), bone)| Some((bone.joint?, at)))
        .collect();
    for config in configs() {
        let kept = config.limits.enabled;
        let mut solver = Solver::new(&body, config);
        for frame in 0..10 {
            solver
                .step(&noisy(&joints, 0.01, || 0.0), at(frame))
                .unwrap();
        }
        let worst = solver
            .angles()
            .into_iter()
            .map(|a| (a.low - a.degrees).max(a.degrees - a.high))
            .fold(f64::MIN, f64::max);
        assert_eq!(worst < 3.0, kept, "{worst} degrees beyond");
    }
}

#[test]
fn joints_that_are_missing_stay_with_the_body_and_nothing_is_nan() {
    let person = performance(3);
    let body = body(&person);
    for config in configs() {
        let mut solver = Solver::new(&body, config);
        assert!(
            solver.step(&exact(&JointMap::empty()), at(0)).is_none(),
            "nobody seen yet"
        );
        let mut worst: f64 = 0.0;
        for frame in 1..400 {
            let truth = person.pose(0, frame as f64 / RATE_HZ);
            // Half a second of every two without the left forearm, and every third frame one more joint is missing.
            let forearm = frame % 60 > 45;
            let seen = truth.filter_map(|joint, position| {
                use Joint::*;
                let hidden =
                    forearm && matches!(joint, WristLeft | HandLeft | HandTipLeft | ThumbLeft);
                let other = frame % 3 == 0 && joint as usize == frame % 25;
                (!hidden && !other).then_some(*position)
            });
            let solved = solver.step(&exact(&seen), at(frame)).unwrap();
            assert!(is_finite(&solved) && solved.joints.len() == Joint::ALL.len());
            worst = worst.max(mean_error(&solved.joints, &truth));
        }
        assert!(worst < 0.08, "{worst}");
        let held = solver.step(&exact(&JointMap::empty()), at(400)).unwrap();
        assert!(is_finite(&held) && held.residual_m.is_none());
    }
}

#[test]
fn numbers_that_are_none_are_left_out() {
    let person = performance(3);
    let mut solver = Solver::new(&body(&person), Config::default());
    for frame in 0..20 {
        let truth = person.pose(0, frame as f64 / RATE_HZ);
        let mut track = exact(&truth);
        if let Some(state) = &mut track.skeleton[Joint::KneeLeft] {
            state.position = Position::new(f64::NAN, 0.0, 0.0);
        }
        if let Some(state) = &mut track.skeleton[Joint::Head] {
            state.covariance[(1, 1)] = f64::INFINITY;
        }
        if let Some(state) = &mut track.skeleton[Joint::HandLeft] {
            state.covariance *= 0.0;
        }
        // Also a clock that stands still or goes back.
        let solved = solver.step(&track, at(frame - frame % 4)).unwrap();
        assert!(is_finite(&solved));
        assert!(mean_error(&solved.joints, &truth) < 0.05);
    }
}

#[test]
fn the_same_tracks_give_the_same_bits() {
    let person = performance(4);
    let body = body(&person);
    let run = || {
        let mut solver = Solver::new(&body, Config::default());
        let mut shake = noise(0.015, 5);
        (0..100)
            .map(|frame| {
                let truth = person.pose(0, frame as f64 / RATE_HZ);
                solver
                    .step(&noisy(&truth, 0.015, &mut shake), at(frame))
                    .unwrap()
            })
            .collect::<Vec<Solved>>()
    };
    assert_eq!(run(), run());
}
