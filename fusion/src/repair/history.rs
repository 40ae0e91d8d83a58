//! One person's recent poses as they were measured, and windows of them at even steps.

use std::collections::VecDeque;

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, Joint, JointState, Provenance, Room, Skeleton, Timestamp};
use serde::{Deserialize, Serialize};

use super::{MAX_AGE_S, Needs, Window, WindowJoint};
use crate::config::seconds_to_ns;

/// Standard deviation of a measurement that counts half, metres.
const WEAK_SIGMA_M: f64 = 0.05;
/// A weight below this is none.
const LEAST_WEIGHT: f64 = 0.05;
/// Poses further apart than this have nothing known between them, ns.
const MAX_BRIDGE_NS: i64 = 100_000_000;

/// How far a joint counts as measured: 1 with trust and without doubt, 0 when only carried on from the past, between them by
/// its uncertainty, which is `unsaid_m` more than it says. [`sigma_of`] goes back.
pub(super) fn weight_of(state: &JointState<Room>, unsaid_m: f64) -> f64 {
    match state.provenance {
        Provenance::Measured(_) if unsaid_m == 0.0 => 1.0,
        Provenance::Predicted(by) | Provenance::Measured(by) if !by.is_empty() => {
            let odd = state.sigma_m().hypot(unsaid_m) / WEAK_SIGMA_M;
            let weight = 1.0 / (1.0 + odd * odd);
            if weight < LEAST_WEIGHT { 0.0 } else { weight }
        }
        Provenance::Measured(_) | Provenance::Predicted(_) | Provenance::Repaired => 0.0,
    }
}

/// The standard deviation behind a weight above 0, metres: 0 for 1.
pub(super) fn sigma_of(weight: f32) -> f64 {
    let weight = f64::from(weight).clamp(LEAST_WEIGHT, 1.0);
    WEAK_SIGMA_M * (1.0 / weight - 1.0).sqrt()
}

/// One joint as it was measured; weight 0 where it was not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Sample {
    position: Vector3<f64>,
    weight: f32,
    confidence: f32,
}

impl Sample {
    const NONE: Self = Self {
        position: Vector3::new(0.0, 0.0, 0.0),
        weight: 0.0,
        confidence: 0.0,
    };

    fn of(state: Option<&JointState<Room>>, weight: f64) -> Self {
        match state.filter(|_| weight > 0.0) {
            Some(state) => Self {
                position: state.position.vector(),
                weight: weight as f32,
                confidence: state.confidence.get(),
            },
            None => Self::NONE,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Pose {
    time: Timestamp,
    joints: [Sample; JOINT_COUNT],
}

/// When and where each joint was last measured.
type LastSeen = [Option<(Timestamp, Vector3<f64>)>; JOINT_COUNT];

/// One person's poses, oldest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct History {
    poses: VecDeque<Pose>,
    /// Where each joint was last measured before the oldest pose, and when.
    before: LastSeen,
}

impl History {
    /// Adds the pose of a frame newer than all before, its joints measured as far as `weights` say.
    pub(super) fn push(
        &mut self,
        time: Timestamp,
        skeleton: &Skeleton<Room>,
        weights: &[f64; JOINT_COUNT],
    ) {
        let joints = std::array::from_fn(|index| {
            Sample::of(skeleton[Joint::ALL[index]].as_ref(), weights[index])
        });
        self.poses.push_back(Pose { time, joints });
    }

    /// Forgets poses older than `oldest`, but for where joints were last measured.
    pub(super) fn forget_before(&mut self, oldest: Timestamp) {
        while self.poses.front().is_some_and(|pose| pose.time < oldest) {
            let Some(pose) = self.poses.pop_front() else {
                return;
            };
            remember(&mut self.before, pose.time, &pose.joints);
        }
    }

    /// The window around `time`. Where no pose is known, later or earlier, nothing was measured.
    pub(super) fn window(&self, time: Timestamp, needs: &Needs) -> Window {
        let step_s = 1.0 / needs.rate_hz;
        let count = needs.poses();
        let at = |k: usize| {
            let steps = k as f64 - needs.before as f64;
            time.plus_ns(seconds_to_ns(steps * step_s))
        };
        let mut known = self.before;
        let mut next = 0;
        let mut poses = Vec::with_capacity(count);
        for k in 0..count {
            let now = at(k);
            while let Some(pose) = self.poses.get(next).filter(|pose| pose.time <= now) {
                remember(&mut known, pose.time, &pose.joints);
                next += 1;
            }
            let measured = self.measured_at(now, next);
            poses.push(self.pose(now, &measured, &mut known));
        }
        Window { step_s, poses }
    }

    /// What was measured at `now`, of which the pose number `next` is the first later one.
    fn measured_at(&self, now: Timestamp, next: usize) -> [Sample; JOINT_COUNT] {
        let none = [Sample::NONE; JOINT_COUNT];
        let earlier = next.checked_sub(1).and_then(|index| self.poses.get(index));
        let Some(a) = earlier else {
            return none;
        };
        if a.time == now {
            return a.joints;
        }
        let Some(b) = self.poses.get(next) else {
            return none;
        };
        let gap_ns = b.time.since_ns(a.time);
        if gap_ns > MAX_BRIDGE_NS {
            return none;
        }
        let share = now.since_ns(a.time) as f64 / gap_ns as f64;
        std::array::from_fn(|joint| between(&a.joints[joint], &b.joints[joint], share))
    }

    fn pose(
        &self,
        now: Timestamp,
        measured: &[Sample; JOINT_COUNT],
        known: &mut LastSeen,
    ) -> [WindowJoint; JOINT_COUNT] {
        remember(known, now, measured);
        let middle = middle(known.iter().flatten().map(|(_, position)| *position));
        let first = self.poses.front();
        std::array::from_fn(|index| {
            let sample = &measured[index];
            if sample.weight > 0.0 {
                return WindowJoint {
                    position: sample.position,
                    weight: sample.weight,
                    confidence: sample.confidence,
                    age_s: 0.0,
                };
            }
            let (position, age_s) = match (&known[index], middle, first) {
                (Some((seen, position)), _, _) => (*position, now.since_seconds(*seen)),
                (None, Some(middle), _) => (middle, f64::INFINITY),
                (None, None, Some(first)) => (first_place(first, index), f64::INFINITY),
                (None, None, None) => (Vector3::zeros(), f64::INFINITY),
            };
            WindowJoint {
                position,
                weight: 0.0,
                confidence: 0.0,
                age_s: age_s.clamp(0.0, f64::from(MAX_AGE_S)) as f32,
            }
        })
    }
}

fn remember(known: &mut LastSeen, time: Timestamp, joints: &[Sample; JOINT_COUNT]) {
    for (known, sample) in known.iter_mut().zip(joints) {
        if sample.weight > 0.0 {
            *known = Some((time, sample.position));
        }
    }
}

/// A joint between two poses; where only one of them has it, as it was in the nearer.
fn between(a: &Sample, b: &Sample, share: f64) -> Sample {
    if a.weight > 0.0 && b.weight > 0.0 {
        Sample {
            position: a.position.lerp(&b.position, share),
            weight: a.weight.min(b.weight),
            confidence: a.confidence.min(b.confidence),
        }
    } else if share < 0.5 {
        *a
    } else {
        *b
    }
}

fn middle(places: impl Iterator<Item = Vector3<f64>>) -> Option<Vector3<f64>> {
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for place in places {
        sum += place;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// Where joint number `index` is said to have been before the person came: where the first pose has it.
fn first_place(first: &Pose, index: usize) -> Vector3<f64> {
    let measured = || first.joints.iter().filter(|sample| sample.weight > 0.0);
    let own = &first.joints[index];
    if own.weight > 0.0 {
        return own.position;
    }
    middle(measured().map(|sample| sample.position)).unwrap_or_else(Vector3::zeros)
}

#[cfg(test)]
mod tests;
