//! Recorded poses on other bodies.
//!
//! Recordings name points as joints that differ from each other (the pelvis' middle 10 cm over the hips, or between them).
//! Taking only the directions from them and the lengths from a [`BodyShape`] gives poses whose joints mean the same for all,
//! on bodies of any size.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_skeleton::{ARMS, Joint, JointMap, Position, Room};

use crate::motion::BodyShape;

/// The pose on a body with these bones, standing as high over the floor as the recorded feet do; `None` if joints of trunk
/// or limbs are missing, or lie upon each other.
pub fn retargeted(
    pose: &JointMap<Position<Room>>,
    shape: &BodyShape,
) -> Option<JointMap<Position<Room>>> {
    use Joint::*;
    let from = |joint: Joint| pose[joint].map(|p| p.vector());
    let way = |a: Joint, b: Joint| (from(b)? - from(a)?).try_normalize(1e-6);
    let mut joints = JointMap::empty();
    let mut put = |joint: Joint, at: Vector3<f64>| {
        joints[joint] = Some(Position::from_vector(at));
        at
    };
    // The spine from the hips' middle: where recordings put its base differs most.
    let hips = (from(HipLeft)? + from(HipRight)?) * 0.5;
    let spine = (from(SpineMid)? - hips).try_normalize(1e-6)?;
    let pelvis = axes(from(HipLeft)? - from(HipRight)?, spine)?;
    let base = put(SpineBase, hips + pelvis * Vector3::z() * shape.hip_drop);
    let mid = put(SpineMid, base + spine * shape.lower_spine);
    let top = put(
        SpineShoulder,
        mid + way(SpineMid, SpineShoulder)? * shape.upper_spine,
    );
    let chest = axes(
        from(ShoulderLeft)? - from(ShoulderRight)?,
        way(SpineMid, SpineShoulder)?,
    )?;
    let neck = put(Neck, top + way(SpineShoulder, Neck)? * shape.neck);
    put(Head, neck + way(Neck, Head)? * shape.head);
    for (side, [shoulder, elbow, wrist, hand, tip, thumb]) in [1.0, -1.0].into_iter().zip(ARMS) {
        let rest = Vector3::new(0.0, side * shape.shoulder_half, -0.015 * shape.height);
        let at = put(
            shoulder,
            top + shrugged(chest * rest, from(shoulder)? - from(SpineShoulder)?),
        );
        let at = put(elbow, at + way(shoulder, elbow)? * shape.upper_arm);
        let at = put(wrist, at + way(elbow, wrist)? * shape.forearm);
        let along = way(wrist, hand)?;
        put(thumb, at + way(wrist, thumb).unwrap_or(along) * shape.thumb);
        let at = put(hand, at + along * shape.hand);
        put(tip, at + way(hand, tip).unwrap_or(along) * shape.hand_tip);
    }
    for (side, [hip, knee, ankle, foot]) in [
        (1.0, [HipLeft, KneeLeft, AnkleLeft, FootLeft]),
        (-1.0, [HipRight, KneeRight, AnkleRight, FootRight]),
    ] {
        let rest = Vector3::new(0.0, side * shape.hip_half, -shape.hip_drop);
        let at = put(hip, base + pelvis * rest);
        let at = put(knee, at + way(hip, knee)? * shape.thigh);
        let at = put(ankle, at + way(knee, ankle)? * shape.shin);
        put(
            foot,
            at + way(ankle, foot)? * shape.foot_forward.hypot(shape.foot_down),
        );
    }
    let lowest = |pose: &JointMap<Position<Room>>| {
        let heights = pose.iter().map(|(_, p)| p.vector().z);
        heights.fold(f64::INFINITY, f64::min)
    };
    let lift = lowest(pose) - lowest(&joints);
    Some(joints.map(|_, p| p.moved(Vector3::z() * lift)))
}

/// From a body's axes (x forward, y left, z up) to the room's: exactly `up`, nearly `left`.
fn axes(left: Vector3<f64>, up: Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    let left = (left - up * left.dot(&up)).try_normalize(1e-6)?;
    let matrix = Matrix3::from_columns(&[left.cross(&up), left, up]);
    Some(UnitQuaternion::from_rotation_matrix(
        &Rotation3::from_matrix_unchecked(matrix),
    ))
}

/// The shoulder's place at rest, half turned to where the recording has it: raised arms raise shoulders.
fn shrugged(rest: Vector3<f64>, recorded: Vector3<f64>) -> Vector3<f64> {
    let length = rest.norm();
    let towards = rest / length + recorded.try_normalize(1e-6).unwrap_or_default();
    towards.try_normalize(1e-6).unwrap_or_default() * length
}
