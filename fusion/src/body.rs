//! A person's joints as plain arrays in the room frame: what the hot path works on.

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, Joint, SIDE_PAIRS};
use serde::{Deserialize, Serialize};

/// Joints in the room frame, metres. A joint whose bit in `mask` is 0 is missing and its entries mean nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Body {
    pub(crate) mask: u32,
    pub(crate) position: [Vector3<f64>; JOINT_COUNT],
    pub(crate) confidence: [f32; JOINT_COUNT],
    /// The probability that the left and the right hand is closed, where the tracker tells.
    pub(crate) hands_closed: [Option<f32>; 2],
}

impl Default for Body {
    fn default() -> Self {
        Self {
            mask: 0,
            position: [Vector3::zeros(); JOINT_COUNT],
            confidence: [0.0; JOINT_COUNT],
            hands_closed: [None; 2],
        }
    }
}

impl Body {
    /// Whether joint number `index` is there.
    pub(crate) fn has(&self, index: usize) -> bool {
        self.mask & (1 << index) != 0
    }

    /// Where `joint` is, if it is there.
    pub(crate) fn get(&self, joint: Joint) -> Option<Vector3<f64>> {
        let index = joint as usize;
        self.has(index).then(|| self.position[index])
    }

    /// How many joints are there.
    pub(crate) fn len(&self) -> usize {
        self.mask.count_ones() as usize
    }

    /// Puts a joint in.
    pub(crate) fn set(&mut self, index: usize, position: Vector3<f64>, confidence: f32) {
        self.mask |= 1 << index;
        self.position[index] = position;
        self.confidence[index] = confidence;
    }

    /// Exchanges left and right of those halves of the body that are set in `halves`.
    pub(crate) fn mirror(&mut self, halves: Halves<bool>) {
        for (left, right) in pairs(halves) {
            self.position.swap(left, right);
            self.confidence.swap(left, right);
            let (had_left, had_right) = (self.has(left), self.has(right));
            self.mask &= !(1 << left | 1 << right);
            self.mask |= u32::from(had_right) << left | u32::from(had_left) << right;
        }
        let [upper, _] = halves;
        if upper {
            self.hands_closed.swap(0, 1);
        }
    }
}

/// Something for the upper half of the body (arms and shoulders) and for the lower (legs and hips): trackers
/// exchange left and right of each alone, too.
pub(crate) type Halves<T> = [T; 2];

/// Left and right joints of the upper half and of the lower, in the order of [`Halves`].
pub(crate) const HALVES: Halves<&[(Joint, Joint)]> = {
    let (upper, lower) = SIDE_PAIRS.split_at(UPPER_PAIRS);
    [upper, lower]
};

/// How many of the pairs belong to the upper half.
const UPPER_PAIRS: usize = 6;

/// Numbers of the left and right joints of the halves that are set.
pub(crate) fn pairs(halves: Halves<bool>) -> impl Iterator<Item = (usize, usize)> {
    let chosen = HALVES.into_iter().zip(halves).filter(|(_, chosen)| *chosen);
    chosen
        .flat_map(|(pairs, _)| pairs)
        .map(|(left, right)| (*left as usize, *right as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arms_are_the_upper_half_and_legs_the_lower() {
        let first = |half: usize| HALVES[half][0].0;
        assert_eq!([first(0), first(1)], [Joint::ShoulderLeft, Joint::HipLeft]);
    }

    #[test]
    fn mirroring_moves_what_is_there_and_what_is_missing() {
        let mut body = Body::default();
        body.set(Joint::WristLeft as usize, Vector3::x(), 0.5);
        body.set(Joint::Head as usize, Vector3::z(), 1.0);
        body.hands_closed = [Some(0.9), None];
        let before = body.clone();
        body.mirror([true; 2]);
        assert_eq!(body.get(Joint::WristRight), Some(Vector3::x()));
        assert_eq!(body.get(Joint::WristLeft), None);
        assert_eq!(body.hands_closed, [None, Some(0.9)]);
        assert_eq!(body.get(Joint::Head), Some(Vector3::z()));
        body.mirror([true; 2]);
        assert_eq!(body.mask, before.mask);
        body.mirror([false, true]);
        assert_eq!(body.get(Joint::WristLeft), Some(Vector3::x()), "legs only");
        assert_eq!(body.hands_closed, [Some(0.9), None], "legs only");
    }
}
