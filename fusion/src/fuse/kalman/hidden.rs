//! Which joints a person's own trunk, head and thighs hide from a sensor. Trackers guess such joints, and some of them
//! say that they do not.
//!
//! The body is where the prediction has it, off by a few centimetres. So the flesh is taken thinner than it is: a
//! joint wrongly taken for hidden costs more than a hidden one that is believed a little.

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, Joint};

/// Bones with flesh about them, and its radius, metres.
const FLESH: [(Joint, Joint, f64); 5] = [
    (Joint::SpineBase, Joint::SpineMid, 0.1),
    (Joint::SpineMid, Joint::SpineShoulder, 0.1),
    (Joint::Neck, Joint::Head, 0.07),
    (Joint::HipLeft, Joint::KneeLeft, 0.055),
    (Joint::HipRight, Joint::KneeRight, 0.055),
];
/// What is this close in front of a joint is its own flesh, metres.
const OWN_M: f64 = 0.06;
/// Closer than this, sensors see nothing, metres.
const NEAREST_M: f64 = 0.3;

/// Where each joint is expected, room metres; `None` where that is not known.
pub(super) type Places = [Option<Vector3<f64>>; JOINT_COUNT];

/// The flesh about one bone.
#[derive(Clone, Copy, Debug)]
struct Limb {
    /// Bits of the joints that are part of it.
    joints: u32,
    middle: Vector3<f64>,
    /// From the middle to one end.
    half: Vector3<f64>,
    radius: f64,
}

/// A person's flesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flesh([Option<Limb>; FLESH.len()]);

impl Flesh {
    pub(super) fn new(places: &Places) -> Self {
        Self(FLESH.map(|(a, b, radius)| {
            let (from, to) = (places[a as usize]?, places[b as usize]?);
            let half = (to - from) * 0.5;
            let neck = if b == Joint::SpineShoulder {
                1 << Joint::Neck as u32
            } else {
                0
            };
            Some(Limb {
                joints: 1 << a as u32 | 1 << b as u32 | neck,
                middle: from + half,
                half,
                radius,
            })
        }))
    }

    /// Bits of the joints that it hides from a sensor at `origin`.
    pub(super) fn hides(&self, origin: Vector3<f64>, places: &Places) -> u32 {
        let mut hidden = 0;
        for (index, place) in places.iter().enumerate() {
            let Some(way) = place.map(|place| place - origin) else {
                continue;
            };
            let depth_m = way.norm();
            if depth_m < NEAREST_M {
                continue;
            }
            let ahead = way / depth_m;
            let others = self
                .0
                .iter()
                .flatten()
                .filter(|l| l.joints & 1 << index == 0);
            let blocked = others
                .into_iter()
                .any(|limb| limb.is_hit(origin, ahead, depth_m - OWN_M));
            hidden |= u32::from(blocked) << index;
        }
        hidden
    }
}

impl Limb {
    /// Whether the way from `origin` along `ahead` (unit vector) for `end_m` goes through it.
    fn is_hit(&self, origin: Vector3<f64>, ahead: Vector3<f64>, end_m: f64) -> bool {
        let (middle, half) = (self.middle - origin, self.half);
        let along = middle.dot(&ahead);
        let square = half.norm_squared();
        // Most bones are nowhere near.
        let reach = square.sqrt() + self.radius;
        let aside = middle.norm_squared() - along * along;
        if along - reach > end_m || along + reach < 0.0 || aside > reach * reach {
            return false;
        }
        // The nearest points of two segments: on the bone beside the whole line, on the way beside that, and once more.
        let slant = ahead.dot(&half);
        let apart = square - slant * slant;
        let on_bone = if apart > 1e-9 {
            ((slant * along - half.dot(&middle)) / apart).clamp(-1.0, 1.0)
        } else {
            0.0
        };
        let on_way = |on_bone: f64| (along + on_bone * slant).clamp(0.0, end_m);
        let beside = on_way(on_bone) * slant - half.dot(&middle);
        let on_bone = (beside / square.max(1e-9)).clamp(-1.0, 1.0);
        let nearest = ahead * on_way(on_bone) - middle - half * on_bone;
        nearest.norm_squared() < self.radius * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trunk_hides_what_is_behind_it_and_nothing_of_itself() {
        let mut places: Places = [None; JOINT_COUNT];
        let mut put = |joint: Joint, x: f64, y: f64, z: f64| {
            places[joint as usize] = Some(Vector3::new(x, y, z));
        };
        put(Joint::SpineBase, 0.0, 0.0, 1.0);
        put(Joint::SpineMid, 0.0, 0.0, 1.2);
        put(Joint::SpineShoulder, 0.0, 0.0, 1.45);
        put(Joint::Neck, 0.0, 0.0, 1.52);
        put(Joint::WristLeft, -0.25, 0.03, 1.25);
        put(Joint::WristRight, 0.25, -0.03, 1.25);
        put(Joint::ElbowLeft, -0.2, 0.25, 1.25);
        let flesh = Flesh::new(&places);
        let from = |x: f64| flesh.hides(Vector3::new(x, 0.0, 1.3), &places);
        assert_eq!(from(3.0), 1 << Joint::WristLeft as u32);
        assert_eq!(from(-3.0), 1 << Joint::WristRight as u32);
        let mut unknown = places;
        unknown[Joint::SpineMid as usize] = None;
        assert_eq!(
            Flesh::new(&unknown).hides(Vector3::new(3.0, 0.0, 1.3), &unknown),
            0
        );
    }
}
