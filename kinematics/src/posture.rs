//! A pose as the joints' own angles, and where it places the bones.
//!
//! Hips, upper arms and upper legs turn freely ([`Turn::Ball`]); every other bone turns about one or two of its own axes
//! in turn ([`Turn::Hinges`]), spine and chest about three. Positive is the anatomical sense on both sides: hinges about X
//! and Z are mirrored.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_skeleton::Position;

use crate::bones::{ARMS, BONE_COUNT, BONES, CHEST, HEAD, HIPS, LEGS, NECK, SPINE};
use crate::rig::{Rig, RigPose};

/// A turn about one of a bone's own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hinge {
    /// X, Y or Z.
    pub(crate) axis: usize,
    /// +1 or -1: which sense is positive.
    pub(crate) sign: f64,
}

/// How a bone turns against the bone that carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Turn {
    /// It does not.
    Fixed,
    /// About each of these, the first one first carried by the parent.
    Hinges(&'static [Hinge]),
    /// Freely.
    Ball,
}

const fn hinge(axis: usize, sign: f64) -> Hinge {
    Hinge { axis, sign }
}

const X: usize = 0;
const Y: usize = 1;
const Z: usize = 2;

const SPINE_HINGES: [Hinge; 3] = [hinge(Z, 1.0), hinge(Y, 1.0), hinge(X, 1.0)];
const NECK_HINGES: [Hinge; 2] = [hinge(Y, 1.0), hinge(X, 1.0)];
/// Forwards, up.
const CLAVICLE_HINGES: [[Hinge; 2]; 2] = [
    [hinge(Z, -1.0), hinge(X, 1.0)],
    [hinge(Z, 1.0), hinge(X, -1.0)],
];
/// Elbow bend, turn of the forearm.
const LOWER_ARM_HINGES: [[Hinge; 2]; 2] = [
    [hinge(Z, -1.0), hinge(Y, 1.0)],
    [hinge(Z, 1.0), hinge(Y, 1.0)],
];
/// Towards the palm, towards the thumb.
const HAND_HINGES: [[Hinge; 2]; 2] = [
    [hinge(X, -1.0), hinge(Z, -1.0)],
    [hinge(X, 1.0), hinge(Z, 1.0)],
];
/// Towards the palm.
const FINGER_HINGES: [[Hinge; 1]; 2] = [[hinge(X, -1.0)], [hinge(X, 1.0)]];
/// Knee bend.
const LOWER_LEG_HINGES: [Hinge; 1] = [hinge(Y, 1.0)];
/// Toes outwards, toes down.
const FOOT_HINGES: [[Hinge; 2]; 2] = [
    [hinge(Z, 1.0), hinge(Y, 1.0)],
    [hinge(Z, -1.0), hinge(Y, 1.0)],
];
/// Toes down.
const TOE_HINGES: [Hinge; 1] = [hinge(Y, 1.0)];

/// How each bone turns.
pub(crate) const TURNS: [Turn; BONE_COUNT] = {
    let mut turns = [Turn::Fixed; BONE_COUNT];
    turns[HIPS] = Turn::Ball;
    turns[SPINE] = Turn::Hinges(&SPINE_HINGES);
    turns[CHEST] = Turn::Hinges(&SPINE_HINGES);
    turns[NECK] = Turn::Hinges(&NECK_HINGES);
    turns[HEAD] = Turn::Hinges(&NECK_HINGES);
    let mut side = 0;
    while side < 2 {
        let (arm, leg) = (ARMS[side], LEGS[side]);
        turns[arm.clavicle] = Turn::Hinges(&CLAVICLE_HINGES[side]);
        turns[arm.upper] = Turn::Ball;
        turns[arm.lower] = Turn::Hinges(&LOWER_ARM_HINGES[side]);
        turns[arm.hand] = Turn::Hinges(&HAND_HINGES[side]);
        turns[arm.fingers] = Turn::Hinges(&FINGER_HINGES[side]);
        turns[leg.upper] = Turn::Ball;
        turns[leg.lower] = Turn::Hinges(&LOWER_LEG_HINGES);
        turns[leg.foot] = Turn::Hinges(&FOOT_HINGES[side]);
        turns[leg.toes] = Turn::Hinges(&TOE_HINGES);
        side += 1;
    }
    turns
};

/// A pose: where the root is, and the angles of every joint.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Posture {
    /// Room metres.
    pub(crate) root: Vector3<f64>,
    /// `parent_from_bone` of the bones that turn freely.
    pub(crate) balls: [UnitQuaternion<f64>; BONE_COUNT],
    /// Radians about each of a bone's hinges, in their order.
    pub(crate) angles: [[f64; 3]; BONE_COUNT],
}

impl Posture {
    /// The rest pose with the root here.
    pub(crate) fn rest(root: Vector3<f64>) -> Self {
        Self {
            root,
            balls: [UnitQuaternion::identity(); BONE_COUNT],
            angles: [[0.0; 3]; BONE_COUNT],
        }
    }

    /// `parent_from_bone`.
    pub(crate) fn rotation(&self, bone: usize) -> UnitQuaternion<f64> {
        match TURNS[bone] {
            Turn::Fixed => UnitQuaternion::identity(),
            Turn::Ball => self.balls[bone],
            Turn::Hinges(hinges) => hinges.iter().zip(self.angles[bone]).fold(
                UnitQuaternion::identity(),
                |turned, (hinge, angle)| {
                    let axis = Vector3::ith_axis(hinge.axis);
                    turned * UnitQuaternion::from_axis_angle(&axis, hinge.sign * angle)
                },
            ),
        }
    }

    /// The same as rotations.
    pub(crate) fn to_pose(&self) -> RigPose {
        RigPose {
            root: Position::from_vector(self.root),
            rotations: (0..BONE_COUNT).map(|bone| self.rotation(bone)).collect(),
        }
    }

    /// Whether every number is finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.root.iter().all(|v| v.is_finite())
            && self
                .balls
                .iter()
                .all(|q| q.coords.iter().all(|v| v.is_finite()))
            && self.angles.iter().flatten().all(|v| v.is_finite())
    }
}

/// From each bone's parent to its origin in the rest pose, metres; of the root nothing.
pub(crate) type Offsets = [Vector3<f64>; BONE_COUNT];

/// The offsets of the canonical rig.
pub(crate) fn offsets(rig: &Rig) -> Offsets {
    std::array::from_fn(|bone| match bone {
        HIPS => Vector3::zeros(),
        _ => rig.bones[bone].offset,
    })
}

/// Where a posture places the bones: origins (room metres) and axes (`room_from_bone`).
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub(crate) origins: [Vector3<f64>; BONE_COUNT],
    pub(crate) axes: [Matrix3<f64>; BONE_COUNT],
}

impl Placed {
    /// Everything at the root, unturned.
    pub(crate) fn new() -> Self {
        Self {
            origins: [Vector3::zeros(); BONE_COUNT],
            axes: [Matrix3::identity(); BONE_COUNT],
        }
    }

    /// Places all bones. `each_hinge` is told the room axis of every turn: bone, number of its turn, axis (for a ball its
    /// own three).
    pub(crate) fn place(
        &mut self,
        offsets: &Offsets,
        posture: &Posture,
        mut each_axis: impl FnMut(usize, usize, Vector3<f64>),
    ) {
        for bone in 0..BONE_COUNT {
            let mut axes = if bone == HIPS {
                self.origins[bone] = posture.root;
                Matrix3::identity()
            } else {
                let parent = BONES[bone].parent;
                self.origins[bone] = self.origins[parent] + self.axes[parent] * offsets[bone];
                self.axes[parent]
            };
            match TURNS[bone] {
                Turn::Fixed => {}
                Turn::Ball => {
                    axes *= posture.balls[bone].to_rotation_matrix().matrix();
                    for axis in 0..3 {
                        each_axis(bone, axis, axes.column(axis).into());
                    }
                }
                Turn::Hinges(hinges) => {
                    for (index, (hinge, angle)) in
                        hinges.iter().zip(posture.angles[bone]).enumerate()
                    {
                        let axis: Vector3<f64> = axes.column(hinge.axis).into();
                        each_axis(bone, index, axis * hinge.sign);
                        turn_columns(&mut axes, hinge.axis, hinge.sign * angle);
                    }
                }
            }
            self.axes[bone] = axes;
        }
    }

    /// The same without the axes of turns.
    pub(crate) fn of(offsets: &Offsets, posture: &Posture) -> Self {
        let mut placed = Self::new();
        placed.place(offsets, posture, |_, _, _| {});
        placed
    }
}

/// `axes` times a turn about one of its own axes.
fn turn_columns(axes: &mut Matrix3<f64>, axis: usize, angle: f64) {
    if angle == 0.0 {
        return;
    }
    let (sin, cos) = angle.sin_cos();
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    let first: Vector3<f64> = axes.column(b).into();
    let second: Vector3<f64> = axes.column(c).into();
    axes.set_column(b, &(first * cos + second * sin));
    axes.set_column(c, &(second * cos - first * sin));
}

/// A rotation from a matrix whose columns are orthonormal.
pub(crate) fn quaternion(axes: &Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*axes))
}
