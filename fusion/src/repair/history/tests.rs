use posefuse_skeleton::{Confidence, Position, SensorId, SensorSet};

use super::*;

const FRAME_NS: i64 = 40_000_000;

fn sensor() -> SensorId {
    SensorId::new(0).unwrap()
}

fn state(x: f64, provenance: Provenance, sigma_m: f64) -> JointState<Room> {
    let place = Position::new(x, 0.0, 1.0);
    let mut state = JointState::measured(place, sigma_m, Confidence::FULL, sensor());
    state.provenance = provenance;
    state
}

fn measured(x: f64) -> JointState<Room> {
    state(x, Provenance::Measured(SensorSet::only(sensor())), 0.01)
}

fn at(frame: i64) -> Timestamp {
    Timestamp::from_ns(1_000_000_000 + frame * FRAME_NS)
}

/// The head walks 1 m/s, the neck is gone from frame 5 on.
fn walk() -> History {
    let mut history = History::default();
    for frame in 0..10 {
        let x = frame as f64 * 0.04;
        let mut pose = Skeleton::empty();
        pose[Joint::Head] = Some(measured(x));
        pose[Joint::Neck] = (frame < 5).then(|| measured(x));
        let weights = Joint::ALL.map(|j| pose[j].as_ref().map_or(0.0, |s| weight_of(s, 0.0)));
        history.push(at(frame), &pose, &weights);
    }
    history
}

fn needs(before: usize, after: usize) -> Needs {
    Needs {
        before,
        after,
        rate_hz: 50.0,
    }
}

#[test]
fn a_window_is_even_and_knows_since_when_a_joint_is_gone() {
    let window = walk().window(at(9), &needs(4, 0));
    let heads: Vec<f64> = window
        .poses
        .iter()
        .map(|pose| pose[Joint::Head as usize].position.x)
        .collect();
    for (found, expected) in heads.iter().zip([0.28, 0.30, 0.32, 0.34, 0.36]) {
        assert!((found - expected).abs() < 1e-9, "{heads:?}");
    }
    let neck = window.poses[4][Joint::Neck as usize];
    assert_eq!((neck.weight, neck.confidence), (0.0, 0.0));
    assert!((f64::from(neck.age_s) - 0.2).abs() < 1e-6);
    assert!((neck.position.x - 0.16).abs() < 1e-9);
    // Never measured: in the middle of the others, and told so.
    let hand = window.poses[4][Joint::HandLeft as usize];
    assert_eq!(hand.age_s, MAX_AGE_S);
    assert!((hand.position.x - 0.26).abs() < 1e-9);
}

#[test]
fn before_the_first_pose_it_is_repeated_and_after_the_last_nothing_is_measured() {
    let window = walk().window(at(0), &needs(2, 0));
    let first = window.poses[0][Joint::Head as usize];
    assert_eq!(
        (first.position.x, first.weight, first.age_s),
        (0.0, 0.0, MAX_AGE_S)
    );
    let window = walk().window(at(9), &needs(0, 5));
    let last = window.poses[5][Joint::Head as usize];
    assert_eq!((last.position.x, last.weight), (0.36, 0.0));
    assert!((f64::from(last.age_s) - 0.1).abs() < 1e-6);
}

#[test]
fn what_is_forgotten_is_still_known_to_have_been() {
    let mut history = walk();
    history.forget_before(at(8));
    let neck = history.window(at(9), &needs(0, 0)).poses[0][Joint::Neck as usize];
    assert!((neck.position.x - 0.16).abs() < 1e-9);
    assert!((f64::from(neck.age_s) - 0.2).abs() < 1e-6);
}

#[test]
fn weights_tell_how_weak_a_measurement_is() {
    assert_eq!(weight_of(&measured(0.0), 0.0), 1.0);
    let weak = Provenance::Predicted(SensorSet::only(sensor()));
    for sigma_m in [0.02, 0.05, 0.15] {
        let weight = weight_of(&state(0.0, weak, sigma_m), 0.0);
        assert!((sigma_of(weight as f32) - sigma_m).abs() < 1e-6, "{weight}");
    }
    assert_eq!(weight_of(&state(0.0, weak, 1.0), 0.0), 0.0);
    let coasting = Provenance::Predicted(SensorSet::EMPTY);
    assert_eq!(weight_of(&state(0.0, coasting, 0.01), 0.0), 0.0);
}
