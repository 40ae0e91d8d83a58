//! Where a person's surface is expected: capsules around the bones.

use posefuse_skeleton::{JOINT_COUNT, Joint};

use crate::floor::Level;
use crate::lens::V3;

/// Bones and how thick the flesh around them is, metres.
const FLESH: [(Joint, Joint, f32); 16] = {
    use Joint::*;
    [
        (SpineBase, SpineShoulder, 0.16),
        (SpineShoulder, Head, 0.11),
        (ShoulderLeft, ShoulderRight, 0.09),
        (HipLeft, HipRight, 0.13),
        (ShoulderLeft, ElbowLeft, 0.07),
        (ElbowLeft, WristLeft, 0.06),
        (WristLeft, HandTipLeft, 0.07),
        (ShoulderRight, ElbowRight, 0.07),
        (ElbowRight, WristRight, 0.06),
        (WristRight, HandTipRight, 0.07),
        (HipLeft, KneeLeft, 0.10),
        (KneeLeft, AnkleLeft, 0.07),
        (AnkleLeft, FootLeft, 0.07),
        (HipRight, KneeRight, 0.10),
        (KneeRight, AnkleRight, 0.07),
        (AnkleRight, FootRight, 0.07),
    ]
};
/// A person of whom no joints are known yet, around the upright axis.
const THICK_M: f32 = 0.25;

/// A person's joints, sensor metres, in the order of [`Joint::ALL`].
pub(crate) type Joints = [V3; JOINT_COUNT];

/// All points within a distance of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Capsule {
    from: V3,
    along: V3,
    /// One over the square of the length.
    inverse: f32,
    radius: f32,
}

impl Capsule {
    fn new(from: V3, to: V3, radius: f32) -> Self {
        let along = to - from;
        Self {
            from,
            along,
            inverse: 1.0 / along.norm_squared().max(1e-6),
            radius,
        }
    }

    /// How far outside of its surface, metres; below 0 inside.
    fn distance(&self, point: &V3) -> f32 {
        let off = point - self.from;
        let share = (off.dot(&self.along) * self.inverse).clamp(0.0, 1.0);
        (off - self.along * share).norm() - self.radius
    }
}

/// A person's shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Flesh(Vec<Capsule>);

impl Flesh {
    /// Around joints that have all moved by `by`.
    pub(crate) fn around(&mut self, joints: &Joints, by: &V3) {
        let bone = |&(from, to, radius): &(Joint, Joint, f32)| {
            Capsule::new(joints[from as usize] + by, joints[to as usize] + by, radius)
        };
        self.0.clear();
        self.0.extend(FLESH.iter().map(bone));
    }

    /// Around the upright axis through `middle`, from `low` to `high` metres above it.
    pub(crate) fn upright(&mut self, level: &Level, middle: V3, [low, high]: [f32; 2]) {
        let end = |height: f32| middle + level.up * height;
        let (low, high) = (low + THICK_M.min(high - low), high - 0.1);
        self.0.clear();
        self.0
            .push(Capsule::new(end(low.min(high)), end(high), THICK_M));
    }

    /// How far a point is outside of it, metres.
    pub(crate) fn distance(&self, point: &V3) -> f32 {
        let distances = self.0.iter().map(|capsule| capsule.distance(point));
        distances.fold(f32::INFINITY, f32::min)
    }
}
