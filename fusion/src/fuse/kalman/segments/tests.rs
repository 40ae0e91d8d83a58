use nalgebra::{Matrix3, Rotation3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint, Provenance, SensorSet};

use super::super::evidence::Evidence;
use super::{SEGMENTS, Segments};

const SIGMA_M: f64 = 0.02;

/// The trunk's joints in its own axes, metres.
fn shape() -> [Vector3<f64>; 9] {
    [
        [0.0, 0.0, 1.0],
        [0.02, 0.0, 1.25],
        [0.0, 0.0, 1.5],
        [0.0, 0.01, 1.58],
        [0.05, 0.0, 1.75],
        [0.0, 0.2, 1.45],
        [0.0, -0.2, 1.45],
        [0.0, 0.1, 0.95],
        [0.0, -0.1, 0.95],
    ]
    .map(Vector3::from)
}

/// What the sensors say of a joint `at` so many metres; `None` for nothing.
fn said(at: Option<Vector3<f64>>) -> Option<Evidence> {
    let information = Matrix3::from_diagonal_element(at.map_or(0.0, |_| SIGMA_M.powi(-2)));
    Some(Evidence {
        expected: Vector3::zeros(),
        information,
        pull: information * at.unwrap_or_default(),
        age_s: 0.0,
        middle: Vector3::zeros(),
        covariance: None,
        confidence: None,
        trusted: at.is_some(),
        provenance: Provenance::Predicted(SensorSet::EMPTY),
    })
}

/// The evidence after the segments have spoken, on a trunk that is turned and moved; `hidden` is not seen.
fn drawn(
    segments: &mut Segments,
    turn: &Rotation3<f64>,
    moved: Vector3<f64>,
    hidden: Option<Joint>,
    noise: impl Fn(usize) -> Vector3<f64>,
) -> [Option<Evidence>; JOINT_COUNT] {
    let mut evidence = [None; JOINT_COUNT];
    for (number, (joint, at)) in SEGMENTS[0].iter().zip(shape()).enumerate() {
        let seen = (Some(*joint) != hidden).then(|| turn * at + moved + noise(number));
        evidence[*joint as usize] = said(seen);
    }
    segments.draw(&mut evidence, 0.033);
    evidence
}

fn place(evidence: &Option<Evidence>) -> Vector3<f64> {
    let evidence = evidence.as_ref().unwrap();
    evidence.expected + evidence.information.try_inverse().unwrap() * evidence.pull
}

fn about_z(angle: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), angle)
}

/// Segments that have watched the trunk turn for three seconds.
fn learned() -> Segments {
    let mut segments = Segments::default();
    for frame in 0..100 {
        let moved = Vector3::x() * (0.01 * f64::from(frame));
        drawn(
            &mut segments,
            &about_z(0.03 * f64::from(frame)),
            moved,
            None,
            |_| Vector3::zeros(),
        );
    }
    segments
}

#[test]
fn a_joint_that_nobody_sees_is_where_the_others_leave_room_for_it() {
    let mut segments = learned();
    let (turn, moved) = (about_z(3.05), Vector3::new(1.0, 0.1, 0.02));
    let hidden = Joint::ShoulderRight;
    let evidence = drawn(&mut segments, &turn, moved, Some(hidden), |_| {
        Vector3::zeros()
    });
    let off = place(&evidence[hidden as usize]) - (turn * shape()[6] + moved);
    assert!(off.norm() < 0.005, "{off}");
}

#[test]
fn what_tears_at_the_shape_is_halved_and_a_turned_room_turns_all_of_it() {
    let noise = |number: usize| {
        let phase = number as f64 * 2.4;
        Vector3::new(phase.sin(), phase.cos(), (1.7 * phase).sin()) * 0.02
    };
    let room = Rotation3::from_euler_angles(0.3, -0.5, 2.0);
    let run = |room: Rotation3<f64>| {
        let mut segments = Segments::default();
        for frame in 0..60 {
            let turn = room * about_z(0.02 * f64::from(frame));
            drawn(&mut segments, &turn, Vector3::zeros(), None, |_| {
                Vector3::zeros()
            });
        }
        let turn = room * about_z(1.2);
        let evidence = drawn(&mut segments, &turn, Vector3::zeros(), None, |n| {
            room * noise(n)
        });
        SEGMENTS[0]
            .iter()
            .map(|joint| place(&evidence[*joint as usize]))
            .collect::<Vec<_>>()
    };
    let (here, turned) = (run(Rotation3::identity()), run(room));
    let (mut before, mut after) = (0.0, 0.0);
    for (number, (a, b)) in here.iter().zip(&turned).enumerate() {
        assert!((room * a - b).norm() < 1e-9, "{number}");
        before += noise(number).norm_squared();
        after += (a - about_z(1.2) * shape()[number]).norm_squared();
    }
    assert!(after < 0.5 * before, "{after} of {before} m^2");
}

#[test]
fn who_has_turned_round_unseen_is_found_again() {
    let mut segments = learned();
    let mut nothing = [None; JOINT_COUNT];
    for _ in 0..20 {
        segments.draw(&mut nothing, 0.033);
    }
    let (turn, hidden) = (about_z(6.1), Joint::HipLeft);
    let evidence = drawn(&mut segments, &turn, Vector3::zeros(), Some(hidden), |_| {
        Vector3::zeros()
    });
    let off = place(&evidence[hidden as usize]) - turn * shape()[7];
    assert!(off.norm() < 0.01, "{off}");
}
