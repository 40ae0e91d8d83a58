//! Soft bones: a person's bones keep their lengths, and so each end of a bone says something of the other. Of bones
//! within a segment the segment says more; what is left are upper arms and thighs.

use posefuse_skeleton::{BONES, JOINT_COUNT};
use serde::{Deserialize, Serialize};

use super::evidence::Evidence;
use super::segments::are_together;
use crate::length::Length;

/// Standard deviation of a bone's length, metres.
const SIGMA_M: f64 = 0.02;

/// A bone that looks shorter has no direction, metres.
const SHORTEST_M: f64 = 0.02;

/// One person's bone lengths, in the order of [`BONES`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Bones([Length; BONES.len()]);

impl Bones {
    /// Adds to the evidence on each end of a bone what the other end says of it.
    pub(super) fn draw(&self, evidence: &mut [Option<Evidence>; JOINT_COUNT]) {
        let before = *evidence;
        for (bone, length) in BONES
            .iter()
            .zip(&self.0)
            .filter(|(bone, _)| !are_together(bone.parent, bone.child))
        {
            let ends = [bone.parent as usize, bone.child as usize];
            let (Some(length_m), Some(parent), Some(child)) =
                (length.known(), &before[ends[0]], &before[ends[1]])
            else {
                continue;
            };
            let at = [parent, child].map(|end| end.expected + end.middle);
            let along = at[1] - at[0];
            let found_m = along.norm();
            if found_m < SHORTEST_M {
                continue;
            }
            let direction = along / found_m;
            for (end, other, sign) in [(0, child, -1.0), (1, parent, 1.0)] {
                let (Some(joint), Some(covariance)) = (&mut evidence[ends[end]], other.covariance)
                else {
                    continue;
                };
                let unsure = direction.dot(&(covariance * direction));
                let information = 1.0 / (SIGMA_M * SIGMA_M / length.settled() + unsure);
                // Where the other end puts this one along the bone, relative to the expectation.
                let wanted = at[1 - end] + direction * (sign * length_m) - joint.expected;
                joint.information += direction * direction.transpose() * information;
                joint.pull += direction * (information * direction.dot(&wanted));
            }
        }
    }

    /// Learns from what the sensors alone say, before any bone was drawn: what is drawn to a length teaches nothing of
    /// it. Measured along the bone as it was expected, because noise across a bone makes it look longer.
    pub(super) fn learn(&mut self, evidence: &[Option<Evidence>; JOINT_COUNT]) {
        let off = |evidence: &Evidence| {
            let spread = evidence.information.try_inverse()?;
            evidence.trusted.then(|| spread * evidence.pull)
        };
        let bones = BONES.iter().zip(&mut self.0);
        for (bone, length) in bones.filter(|(bone, _)| !are_together(bone.parent, bone.child)) {
            let ends = [bone.parent as usize, bone.child as usize];
            let [Some(parent), Some(child)] = ends.map(|end| evidence[end].as_ref()) else {
                continue;
            };
            let along = child.expected - parent.expected;
            if let (Some(a), Some(b), Some(direction)) =
                (off(parent), off(child), along.try_normalize(SHORTEST_M))
            {
                length.learn(direction.dot(&(along + b - a)).abs());
            }
        }
    }
}
