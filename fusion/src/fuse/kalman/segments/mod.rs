//! Segments of the body that keep their shape: the trunk, a forearm with its hand, a shin with its foot.
//!
//! A tracker takes each joint for itself, so that its errors tear at the segment. What the other joints of a segment
//! say of a joint, by the shape that the segment is known to have, is evidence on it like a sensor's: for those that
//! are seen badly it is the better part, for those that nobody sees it is all there is.
//!
//! The shape is learned from what the sensors say of this person. How far each joint strays from it (a spine bends, a
//! wrist turns) is learned as well, so that what is not stiff binds little.

mod fit;

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint};
use serde::{Deserialize, Serialize};

use super::evidence::Evidence;
use crate::body::{Halves, pairs};
use fit::{Fit, Mark, Marks, marks};

/// The joints of each segment.
const SEGMENTS: [&[Joint]; 5] = {
    use Joint::*;
    [
        &[
            SpineBase,
            SpineMid,
            SpineShoulder,
            Neck,
            Head,
            ShoulderLeft,
            ShoulderRight,
            HipLeft,
            HipRight,
        ],
        &[ElbowLeft, WristLeft, HandLeft, HandTipLeft, ThumbLeft],
        &[ElbowRight, WristRight, HandRight, HandTipRight, ThumbRight],
        &[KneeLeft, AnkleLeft, FootLeft],
        &[KneeRight, AnkleRight, FootRight],
    ]
};
/// The number of the segment that each joint belongs to. All joints are in one, and none in two.
const SEGMENT_OF: [usize; JOINT_COUNT] = {
    let mut table = [0; JOINT_COUNT];
    let mut segment = 0;
    while segment < SEGMENTS.len() {
        let mut number = 0;
        while number < SEGMENTS[segment].len() {
            table[SEGMENTS[segment][number] as usize] = segment;
            number += 1;
        }
        segment += 1;
    }
    table
};
/// The segments that change sides with the arms, and with the legs.
const SIDES: Halves<(usize, usize)> = [(1, 2), (3, 4)];
/// Most joints of a segment, and the fewest that tell where it is.
const MOST_JOINTS: usize = 9;
const FEWEST_JOINTS: usize = 3;

/// A new segment is learned from as many trusted joints, or from all that it has.
const FIRST_JOINTS: usize = 7;
/// How far joints are taken to stray from the shape at first, and the least and the most that is ever believed, metres.
const FIRST_STRAY_M: f64 = 0.025;
const LEAST_STRAY_M: f64 = 0.006;
const MOST_STRAY_M: f64 = 0.06;
/// What is known of a spot after a first look, metres, and how many looks halve the square of that.
const FIRST_SPOT_M: f64 = 0.015;
const LOOKS: f64 = 30.0;
/// Looks that a shape remembers.
const MEMORY: f64 = 600.0;

/// A segment that was not heard for this long may have turned any way, seconds.
const LOST_S: f64 = 0.3;

/// Whether both joints belong to one segment.
pub(super) fn are_together(a: Joint, b: Joint) -> bool {
    SEGMENT_OF[a as usize] == SEGMENT_OF[b as usize]
}

/// All segments of one person.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Segments([Segment; SEGMENTS.len()]);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Segment {
    /// From the segment's axes to the room's.
    turn: Matrix3<f64>,
    /// Since the segment was last heard, seconds.
    silent_s: f64,
    /// In the order of the segment's joints; `None` for those not learned yet.
    spots: [Option<Spot>; MOST_JOINTS],
}

/// Where a joint belongs in its segment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Spot {
    /// The segment's axes, metres.
    at: Vector3<f64>,
    /// By how much the joint strays from there, m^2 per axis.
    stray: f64,
    /// How often it was looked at.
    looks: f64,
}

impl Default for Segment {
    fn default() -> Self {
        Self {
            turn: Matrix3::identity(),
            silent_s: 0.0,
            spots: [None; MOST_JOINTS],
        }
    }
}

impl Segments {
    /// Adds to the evidence on each joint what the others of its segment say, and learns the shapes. `elapsed_s` have
    /// passed since the last frame.
    pub(super) fn draw(&mut self, evidence: &mut [Option<Evidence>; JOINT_COUNT], elapsed_s: f64) {
        for (segment, joints) in self.0.iter_mut().zip(SEGMENTS) {
            segment.draw(joints, evidence, elapsed_s);
        }
    }

    /// Exchanges left and right in those halves of the body that are set.
    pub(super) fn mirror(&mut self, halves: Halves<bool>) {
        for ((left, right), chosen) in SIDES.into_iter().zip(halves) {
            if chosen {
                self.0.swap(left, right);
            }
        }
        let number = |joint: usize| SEGMENTS[0].iter().position(|j| *j as usize == joint);
        for (left, right) in pairs(halves) {
            if let (Some(left), Some(right)) = (number(left), number(right)) {
                self.0[0].spots.swap(left, right);
            }
        }
    }
}

impl Spot {
    fn new(at: Vector3<f64>) -> Self {
        Self {
            at,
            stray: FIRST_STRAY_M * FIRST_STRAY_M,
            looks: 1.0,
        }
    }

    /// How far the joint may be from where the spot is thought to be, m^2 per axis.
    fn variance(&self) -> f64 {
        self.stray + FIRST_SPOT_M * FIRST_SPOT_M * LOOKS / (LOOKS + self.looks)
    }

    /// The joint was `off` (segment's axes, metres), as far as that is known within `noise` (m^2 per axis); counted
    /// with `weight`.
    fn learn(&mut self, off: Vector3<f64>, noise: f64, weight: f64) {
        self.looks = (self.looks + weight).min(MEMORY);
        self.at += off * (weight / self.looks);
        let heard = (off.norm_squared() / 3.0 - noise).max(0.0);
        let stray = self.stray + weight / (self.looks + LOOKS) * (heard - self.stray);
        self.stray = stray.clamp(LEAST_STRAY_M * LEAST_STRAY_M, MOST_STRAY_M * MOST_STRAY_M);
    }
}

impl Segment {
    fn draw(
        &mut self,
        joints: &[Joint],
        evidence: &mut [Option<Evidence>; JOINT_COUNT],
        elapsed_s: f64,
    ) {
        let mut marks = marks(joints, evidence);
        let both = marks.iter().zip(&self.spots);
        let known = both.filter(|(m, s)| m.is_some() && s.is_some()).count();
        self.silent_s += elapsed_s;
        if known < FEWEST_JOINTS {
            self.begin(joints, &marks);
            return;
        }
        if self.silent_s > LOST_S {
            self.find(&marks);
        }
        let Some(fit) = self.fit(&mut marks) else {
            return;
        };
        self.silent_s = 0.0;
        for (number, joint) in joints.iter().enumerate() {
            let (spot, mark) = (self.spots[number], marks[number]);
            if let (Some(spot), Some(evidence)) = (spot, &mut evidence[*joint as usize]) {
                fit.tell(self.turn * spot.at, spot.variance(), mark, evidence);
            }
            if let Some(mark) = mark.filter(|mark| mark.trusted) {
                self.learn(number, &mark, &fit);
            }
        }
    }

    /// A new shape, where enough of it is seen.
    fn begin(&mut self, joints: &[Joint], marks: &Marks) {
        let trusted = || {
            marks
                .iter()
                .enumerate()
                .filter_map(|(n, m)| Some((n, m.filter(|m| m.trusted)?)))
        };
        let count = trusted().count();
        if count < joints.len().min(FIRST_JOINTS) {
            return;
        }
        let middle = trusted().map(|(_, mark)| mark.at).sum::<Vector3<f64>>() / count as f64;
        *self = Self::default();
        for (number, mark) in trusted() {
            self.spots[number] = Some(Spot::new(mark.at - middle));
        }
    }

    /// The turn, from marks alone (Kabsch, Acta Crystallographica A 32, 1976).
    fn find(&mut self, marks: &Marks) {
        let both = || {
            marks
                .iter()
                .zip(&self.spots)
                .filter_map(|(m, s)| Some(((*m)?, (*s)?)))
        };
        let count = both().count() as f64;
        let middle = both().map(|(mark, _)| mark.at).sum::<Vector3<f64>>() / count;
        let own_middle = both().map(|(_, spot)| spot.at).sum::<Vector3<f64>>() / count;
        let together: Matrix3<f64> = both()
            .map(|(mark, spot)| (mark.at - middle) * (spot.at - own_middle).transpose())
            .sum();
        let parts = together.svd(true, true);
        if let (Some(u), Some(v)) = (parts.u, parts.v_t) {
            let hand = (u * v).determinant().signum();
            self.turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, hand)) * v;
        }
    }

    fn learn(&mut self, number: usize, mark: &Mark, fit: &Fit) {
        let at = self.turn.tr_mul(&(mark.at - fit.place));
        match &mut self.spots[number] {
            Some(spot) => spot.learn(at - spot.at, mark.spread.trace() / 3.0, mark.weight),
            none => *none = Some(Spot::new(at)),
        }
    }
}

#[cfg(test)]
mod tests;
