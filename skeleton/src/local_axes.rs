//! The axes of a joint: directions that move with the body part it belongs to.
//!
//! Trackers mean different points by the same joint name (Kinect v2's `Neck` is not Azure's). Such a difference is constant
//! in the body, not in the room, so it is kept in these axes. Trunk joints (spine, neck, head, shoulders, hips): X forward,
//! Y to the person's left, Z up the spine. Limb joints: Z along the bone from the parent joint to the joint, X the trunk's
//! forward made square to it, Y completes a right-handed frame.

use nalgebra::{Matrix3, Vector3};

use crate::{Frame, Joint, JointMap, Position};

/// A bone that points along the trunk's forward leaves no X: below this sine of the angle, the trunk's up serves instead.
const LEAST_SINE: f64 = 0.2;

/// The axes of `joint` in a body whose joints stand at `joints`, as the columns X, Y, Z of a rotation matrix: they take
/// offsets of the joint (metres) to the frame `F`. `None` where hips, spine or the limb's bone were not seen.
///
/// ```
/// use posefuse_skeleton::{Joint, JointMap, Position, Room, local_axes};
///
/// let mut joints = JointMap::<Position<Room>>::empty();
/// joints[Joint::HipLeft] = Some(Position::new(0.0, 0.1, 1.0));
/// joints[Joint::HipRight] = Some(Position::new(0.0, -0.1, 1.0));
/// joints[Joint::SpineShoulder] = Some(Position::new(0.0, 0.0, 1.5));
/// let axes = local_axes(Joint::Neck, &joints).unwrap();
/// assert!((axes.column(0)[0] - 1.0).abs() < 1e-9, "somebody upright who faces X");
/// ```
pub fn local_axes<F: Frame>(joint: Joint, joints: &JointMap<Position<F>>) -> Option<Matrix3<f64>> {
    let trunk = trunk_axes(joints)?;
    local_axes_within(joint, joints, &trunk)
}

/// The same for a body whose [`trunk_axes`] are known: for all joints of a body the trunk need be found once only.
pub fn local_axes_within<F: Frame>(
    joint: Joint,
    joints: &JointMap<Position<F>>,
    trunk: &Matrix3<f64>,
) -> Option<Matrix3<f64>> {
    if is_trunk(joint) {
        return Some(*trunk);
    }
    let at = |joint: Joint| joints[joint].map(|p| p.vector());
    let z = (at(joint)? - at(joint.parent()?)?).try_normalize(1e-6)?;
    let square_to_z = |v: Vector3<f64>| (v - z * v.dot(&z)).try_normalize(LEAST_SINE);
    let x = square_to_z(trunk.column(0).into()).or_else(|| square_to_z(trunk.column(2).into()))?;
    Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

/// The trunk's axes (X forward, Y left, Z up the spine) as columns; `None` where they were not seen.
///
/// Left is the mean of the lines across the hips and the shoulders, as far as they were seen; up goes from the hips (or
/// `SpineBase`) to the shoulders (or the upper spine).
pub fn trunk_axes<F: Frame>(joints: &JointMap<Position<F>>) -> Option<Matrix3<f64>> {
    use Joint::*;
    let at = |joint: Joint| joints[joint].map(|p| p.vector());
    let across =
        |left: Joint, right: Joint| Some((at(left)? - at(right)?, (at(left)? + at(right)?) / 2.0));
    let (hips, shoulders) = (
        across(HipLeft, HipRight),
        across(ShoulderLeft, ShoulderRight),
    );
    let line = |pair: Option<(Vector3<f64>, Vector3<f64>)>| {
        pair.and_then(|(line, _)| line.try_normalize(1e-6))
    };
    let left = match (line(hips), line(shoulders)) {
        (Some(a), Some(b)) => a + b,
        (a, b) => a.or(b)?,
    };
    let bottom = hips.map(|(_, middle)| middle).or_else(|| at(SpineBase))?;
    let top = at(SpineShoulder)
        .or_else(|| shoulders.map(|(_, middle)| middle))
        .or_else(|| at(Neck))
        .or_else(|| at(SpineMid))?;
    let up = (top - bottom).try_normalize(1e-6)?;
    let left = (left - up * left.dot(&up)).try_normalize(1e-3)?;
    Some(Matrix3::from_columns(&[left.cross(&up), left, up]))
}

fn is_trunk(joint: Joint) -> bool {
    use Joint::*;
    matches!(
        joint,
        SpineBase
            | SpineMid
            | SpineShoulder
            | Neck
            | Head
            | ShoulderLeft
            | ShoulderRight
            | HipLeft
            | HipRight
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Translation3, UnitQuaternion};

    use super::*;
    use crate::{Room, Sensor, Transform};

    fn standing() -> JointMap<Position<Room>> {
        use Joint::*;
        [
            (SpineBase, [0.0, 0.0, 1.0]),
            (SpineShoulder, [0.0, 0.0, 1.5]),
            (Neck, [0.0, 0.0, 1.55]),
            (ShoulderLeft, [0.0, 0.2, 1.45]),
            (ShoulderRight, [0.0, -0.2, 1.45]),
            (ElbowLeft, [0.0, 0.2, 1.15]),
            (WristLeft, [0.25, 0.2, 1.15]),
            (HipLeft, [0.0, 0.1, 1.0]),
            (HipRight, [0.0, -0.1, 1.0]),
        ]
        .into_iter()
        .map(|(joint, at)| (joint, Position::new(at[0], at[1], at[2])))
        .collect()
    }

    #[test]
    fn an_upright_body_has_the_rooms_axes_and_bones_theirs() {
        let joints = standing();
        let trunk = local_axes(Joint::Neck, &joints).unwrap();
        assert!((trunk - Matrix3::identity()).norm() < 1e-9, "{trunk}");
        let elbow = local_axes(Joint::ElbowLeft, &joints).unwrap();
        assert!(
            (elbow.column(2) + Vector3::z()).norm() < 1e-9,
            "down the arm: {elbow}"
        );
        assert!((elbow.column(0) - Vector3::x()).norm() < 1e-9);
        // The lower arm points forward, where X of the trunk says nothing.
        let wrist = local_axes(Joint::WristLeft, &joints).unwrap();
        assert!((wrist.column(2) - Vector3::x()).norm() < 1e-9);
        assert!((wrist.column(0) - Vector3::z()).norm() < 1e-9);
    }

    #[test]
    fn axes_turn_with_the_body_and_are_rotations() {
        let joints = standing();
        let sensor_from_room = Transform::<Sensor, Room>::from_parts(
            Translation3::new(1.0, -2.0, 3.0).vector,
            UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0),
        );
        let turned = joints.map(|_, p| sensor_from_room.apply(*p));
        let rotation: Rotation3<f64> = sensor_from_room.rotation().to_rotation_matrix();
        for (joint, _) in joints.iter() {
            let here = local_axes(joint, &joints).unwrap();
            let there = local_axes(joint, &turned).unwrap();
            assert!((rotation.matrix() * here - there).norm() < 1e-9, "{joint}");
            assert!((here.determinant() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn what_was_not_seen_has_no_axes() {
        let mut joints = standing();
        assert!(local_axes(Joint::KneeLeft, &joints).is_none());
        joints[Joint::HipLeft] = None;
        assert!(
            local_axes(Joint::Neck, &joints).is_some(),
            "shoulders serve"
        );
        joints[Joint::ShoulderRight] = None;
        assert!(local_axes(Joint::Neck, &joints).is_none());
        assert!(local_axes(Joint::Neck, &JointMap::<Position<Room>>::empty()).is_none());
    }
}
