//! The sensor stage `gate`: joints that cannot be true are dropped, each with a reason.
//!
//! Sensor frame, metres. Never finite-by-luck: [`sanitise`] runs whether or not the stage is on, so that nothing
//! behind it ever meets a NaN, an infinity or a number whose square overflows.

use nalgebra::Vector3;
use posefuse_skeleton::{Body, JOINT_COUNT, Joint, Observation, Sensor, Skeleton, Timestamp};
use serde::{Deserialize, Serialize};

use crate::RejectionReason;
use crate::config_check::Checker;

/// Beyond this no room reaches, metres.
const SANE_M: f64 = 100.0;
/// Bodies of one sensor that are remembered; the one not seen for longest makes room.
const MAX_BODIES: usize = Observation::MAX_BODIES;
/// A body not seen for this long starts afresh, ns.
const FORGET_NS: i64 = 1_000_000_000;
/// Poses of a body that are remembered to know a repeat by.
const POSES: usize = 4;
/// No joint of a repeat is further than this from the pose it repeats, metres: rounding on the way. The noise of any
/// sensor is much larger.
const REPEAT_M: f64 = 2e-5;
/// What noise alone may move a joint between two frames, metres.
const NOISE_M: f64 = 0.08;

/// `kind = "gate"`: drops joints no sensor can see or no person can do, and bodies that repeat an earlier pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GateConfig {
    /// Whether it runs.
    pub enabled: bool,
    /// Nearest distance from the lens, metres.
    pub min_range_m: f64,
    /// Furthest distance from the lens, metres.
    pub max_range_m: f64,
    /// Fastest a joint can move, m/s.
    pub max_speed_mps: f64,
    /// After so many frames that agree with each other a jumped joint is believed.
    pub reaccept_frames: u32,
}

impl Default for GateConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            min_range_m: 0.2,
            max_range_m: 12.0,
            max_speed_mps: 12.0,
            reaccept_frames: 3,
        }
    }
}

impl GateConfig {
    pub(crate) fn check(&self, at: &str, check: &mut Checker) {
        check.within(&format!("{at}.min_range_m"), self.min_range_m, 0.0, SANE_M);
        check.within(&format!("{at}.max_range_m"), self.max_range_m, 0.1, SANE_M);
        check.within(
            &format!("{at}.max_speed_mps"),
            self.max_speed_mps,
            0.5,
            1000.0,
        );
        check.within(
            &format!("{at}.reaccept_frames"),
            f64::from(self.reaccept_frames),
            1.0,
            1000.0,
        );
    }
}

/// Drops joints that are no numbers at all, or further away than any room.
pub(crate) fn sanitise(
    skeleton: &mut Skeleton<Sensor>,
    mut reject: impl FnMut(RejectionReason, Joint),
) {
    for joint in Joint::ALL {
        let Some(state) = &skeleton[joint] else {
            continue;
        };
        let reason = if !state.position.is_finite() {
            RejectionReason::NonFinite
        } else if state.position.vector().amax() > SANE_M {
            RejectionReason::Absurd
        } else {
            continue;
        };
        skeleton[joint] = None;
        reject(reason, joint);
    }
}

/// What the gate remembers of one sensor's bodies.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Gate {
    bodies: Vec<Known>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Known {
    tracking_id: u64,
    seen: Timestamp,
    /// Its latest poses, oldest first.
    poses: Vec<Pose>,
    joints: [Option<Accepted>; JOINT_COUNT],
}

/// The joint's last accepted place, and the place it claims to have jumped to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Accepted {
    at: Timestamp,
    position: Vector3<f64>,
    claim: Option<Claim>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Claim {
    at: Timestamp,
    position: Vector3<f64>,
    frames: u32,
}

impl Gate {
    /// Drops joints from `body`; false if the body as a whole repeats its last frame and is to be dropped.
    pub(crate) fn pass(
        &mut self,
        body: &mut Body,
        time: Timestamp,
        config: &GateConfig,
        mut reject: impl FnMut(RejectionReason, Option<Joint>),
    ) -> bool {
        let pose = Pose::of(&body.skeleton);
        let known = self.known(body.tracking_id, time);
        known.seen = time;
        if !body.skeleton.is_empty() && known.poses.iter().any(|p| p.is_repeated_by(&pose)) {
            reject(RejectionReason::Repeated, None);
            return false;
        }
        if known.poses.len() == POSES {
            known.poses.remove(0);
        }
        known.poses.push(pose);
        for (index, joint) in Joint::ALL.into_iter().enumerate() {
            let Some(state) = &body.skeleton[joint] else {
                continue;
            };
            let position = state.position.vector();
            let range = position.norm();
            let visible =
                position.z > 0.0 && (config.min_range_m..=config.max_range_m).contains(&range);
            let reason = if !visible {
                RejectionReason::Absurd
            } else if !reachable(&mut known.joints[index], position, time, config) {
                RejectionReason::Jumped
            } else {
                continue;
            };
            body.skeleton[joint] = None;
            reject(reason, Some(joint));
        }
        true
    }

    /// What is remembered of this body; fresh if that is nothing or too old.
    fn known(&mut self, tracking_id: u64, time: Timestamp) -> &mut Known {
        self.bodies.retain(|known| {
            let old = time.since_ns(known.seen);
            (0..=FORGET_NS).contains(&old)
        });
        let index = self
            .bodies
            .iter()
            .position(|known| known.tracking_id == tracking_id);
        let index = index.unwrap_or_else(|| {
            if self.bodies.len() == MAX_BODIES {
                let oldest = (0..MAX_BODIES)
                    .min_by_key(|i| self.bodies[*i].seen)
                    .unwrap_or(0);
                self.bodies.remove(oldest);
            }
            self.bodies.push(Known {
                tracking_id,
                seen: time,
                poses: Vec::new(),
                joints: [None; JOINT_COUNT],
            });
            self.bodies.len() - 1
        });
        &mut self.bodies[index]
    }
}

/// Whether a person can have moved the joint to `position`; remembers the place or the claim.
fn reachable(
    known: &mut Option<Accepted>,
    position: Vector3<f64>,
    time: Timestamp,
    config: &GateConfig,
) -> bool {
    let reach = |from: Vector3<f64>, at: Timestamp| {
        let limit = config.max_speed_mps * time.since_seconds(at).max(0.0) + NOISE_M;
        (position - from).norm() <= limit
    };
    let accepted = Some(Accepted {
        at: time,
        position,
        claim: None,
    });
    let Some(last) = known else {
        *known = accepted;
        return true;
    };
    if reach(last.position, last.at) {
        *known = accepted;
        return true;
    }
    let frames = match &last.claim {
        Some(claim) if reach(claim.position, claim.at) => claim.frames + 1,
        _ => 1,
    };
    if frames >= config.reaccept_frames {
        *known = accepted;
        return true;
    }
    last.claim = Some(Claim {
        at: time,
        position,
        frames,
    });
    false
}

/// Where a body's joints were, sensor frame, metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Pose(Vec<(Joint, Vector3<f64>)>);

impl Pose {
    fn of(skeleton: &Skeleton<Sensor>) -> Self {
        let place = |(joint, state): (Joint, &posefuse_skeleton::JointState<Sensor>)| {
            (joint, state.position.vector())
        };
        Self(skeleton.iter().map(place).collect())
    }

    /// Whether `other` has the same joints at the same places.
    fn is_repeated_by(&self, other: &Self) -> bool {
        let mut pairs = self.0.iter().zip(&other.0);
        self.0.len() == other.0.len()
            && pairs.all(|(a, b)| a.0 == b.0 && (a.1 - b.1).amax() <= REPEAT_M)
    }
}

#[cfg(test)]
mod tests;
