use posefuse_skeleton::{Confidence, JointState, Position, SensorId};

use super::*;

fn body(joints: &[(Joint, [f64; 3])]) -> Body {
    let sensor = SensorId::new(0).unwrap();
    let state = |p: &[f64; 3]| {
        JointState::measured(
            Position::new(p[0], p[1], p[2]),
            0.01,
            Confidence::FULL,
            sensor,
        )
    };
    Body {
        tracking_id: 1,
        skeleton: joints.iter().map(|(joint, p)| (*joint, state(p))).collect(),
        orientations: None,
        hands_closed: [None; 2],
    }
}

fn pass(
    gate: &mut Gate,
    joints: &[(Joint, [f64; 3])],
    ms: i64,
) -> (Option<Skeleton<Sensor>>, Vec<RejectionReason>) {
    let mut body = body(joints);
    let mut reasons = Vec::new();
    let time = Timestamp::from_ns(1_000_000_000 + ms * 1_000_000);
    let passed = gate.pass(&mut body, time, &GateConfig::default(), |reason, _| {
        reasons.push(reason)
    });
    (passed.then_some(body.skeleton), reasons)
}

#[test]
fn what_is_no_number_goes_whatever_it_is() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -101.0] {
        for axis in 0..3 {
            let mut position = [0.0, 0.0, 2.0];
            position[axis] = bad;
            let mut skeleton =
                body(&[(Joint::Head, position), (Joint::Neck, [0.0, 0.0, 2.0])]).skeleton;
            let mut dropped = Vec::new();
            sanitise(&mut skeleton, |_, joint| dropped.push(joint));
            assert_eq!(dropped, [Joint::Head], "{bad}");
            assert_eq!(skeleton.len(), 1);
        }
    }
}

#[test]
fn behind_the_lens_and_out_of_range_is_absurd() {
    let mut gate = Gate::default();
    let (left, reasons) = pass(
        &mut gate,
        &[
            (Joint::Head, [0.0, 0.0, -1.0]),
            (Joint::Neck, [0.0, 0.0, 30.0]),
            (Joint::SpineBase, [0.0, 0.0, 2.0]),
        ],
        0,
    );
    assert_eq!(left.unwrap().len(), 1);
    assert_eq!(reasons, [RejectionReason::Absurd; 2]);
}

#[test]
fn a_jump_is_refused_until_it_is_confirmed() {
    let mut gate = Gate::default();
    let at = |x: f64| [(Joint::WristLeft, [x, 0.0, 2.0])];
    assert_eq!(pass(&mut gate, &at(0.0), 0).1, []);
    assert_eq!(pass(&mut gate, &at(1.50), 33).1, [RejectionReason::Jumped]);
    // Back again: nothing happened.
    assert_eq!(pass(&mut gate, &at(0.01), 66).1, []);
    assert_eq!(pass(&mut gate, &at(1.51), 100).1, [RejectionReason::Jumped]);
    assert_eq!(pass(&mut gate, &at(1.52), 133).1, [RejectionReason::Jumped]);
    assert_eq!(
        pass(&mut gate, &at(1.53), 166).1,
        [],
        "the third of a kind is believed"
    );
    assert_eq!(pass(&mut gate, &at(1.54), 200).1, []);
}

#[test]
fn a_joint_that_jumps_about_is_never_locked_out_for_good() {
    let mut gate = Gate::default();
    let mut accepted = 0;
    for frame in 0..60 {
        let x = if frame < 10 { 0.0 } else { 1.7 } + f64::from(frame) * 1e-4;
        accepted += usize::from(
            pass(
                &mut gate,
                &[(Joint::Head, [x, 0.0, 2.0])],
                i64::from(frame) * 33,
            )
            .1
            .is_empty(),
        );
    }
    assert_eq!(accepted, 58);
}

#[test]
fn a_pose_given_again_is_a_repeat_whatever_its_rounding() {
    let mut gate = Gate::default();
    let joints = [
        (Joint::Head, [0.1, 0.2, 2.0]),
        (Joint::Neck, [0.1, 0.4, 2.0]),
    ];
    assert!(pass(&mut gate, &joints, 0).0.is_some());
    let (left, reasons) = pass(&mut gate, &joints, 33);
    assert!(left.is_none());
    assert_eq!(reasons, [RejectionReason::Repeated]);
    let moved = [(Joint::Head, [0.1, 0.2, 2.0005]), joints[1]];
    assert!(pass(&mut gate, &moved, 66).0.is_some());
    // An older one again, through a text file of five digits, under a new time.
    let rounded = [(Joint::Head, [0.10001, 0.2, 1.99999]), joints[1]];
    assert_eq!(
        pass(&mut gate, &rounded, 100).1,
        [RejectionReason::Repeated]
    );
    let fewer = [joints[0]];
    assert!(pass(&mut gate, &fewer, 133).0.is_some());
}

#[test]
fn what_is_remembered_is_bounded() {
    let mut gate = Gate::default();
    for tracking_id in 0..1000 {
        let mut body = body(&[(Joint::Head, [0.0, 0.0, 2.0])]);
        body.tracking_id = tracking_id;
        let time = Timestamp::from_ns(tracking_id as i64);
        assert!(gate.pass(&mut body, time, &GateConfig::default(), |_, _| {}));
    }
    assert_eq!(gate.bodies.len(), MAX_BODIES);
}
