//! What only bodies have: joint angles, limbs that turn over, feet that skate.
//!
//! - *Angle error*: of elbows and knees how much the bend is off; of shoulders and hips the angle between where the limb's
//!   upper bone points in the trunk's axes and where it truly does. Root mean square, degrees.
//! - *Flip*: the axis about which an elbow or knee bends turns by more than a right angle from one frame to the next, and
//!   truly does not. Of people as fused that axis is square to the limb's two bones.
//! - *Skate*: how far ankles and feet that truly stand move over the floor, per second of standing, millimetres.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_kinematics::{Rig, RigPose};
use posefuse_skeleton::{Joint, JointMap, Position, Room, Timestamp, TrackId, trunk_axes};
use serde::Serialize;

use crate::measure::LONGEST_STEP_S;
use crate::tally::Mean;

type Joints = JointMap<Position<Room>>;

/// The joints of each limb: where it hangs, where it bends, where it ends; left and right arm, left and right leg.
const LIMBS: [[Joint; 3]; 4] = {
    use Joint::*;
    [
        [ShoulderLeft, ElbowLeft, WristLeft],
        [ShoulderRight, ElbowRight, WristRight],
        [HipLeft, KneeLeft, AnkleLeft],
        [HipRight, KneeRight, AnkleRight],
    ]
};

/// About which room axis each limb bends; `None` where that is not known.
pub(super) type Bends = [Option<Vector3<f64>>; LIMBS.len()];

/// One person in one frame.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) track: TrackId,
    pub(super) time: Timestamp,
    /// Whether the left and the right foot truly stand.
    pub(super) stands: Option<[bool; 2]>,
    pub(super) bends: Bends,
    pub(super) true_bends: Bends,
    pub(super) joints: Joints,
    pub(super) truth: Joints,
}

/// Counts and sums; [`BodyFigures`] says what they mean.
#[derive(Clone, Debug, Default)]
pub struct BodyTally {
    /// Squared error of the angles at elbows, knees, shoulders and hips, degrees^2.
    angles: [Mean; 4],
    flips: u64,
    person_s: f64,
    skated_m: f64,
    stood_s: f64,
    /// Seconds in the solver, and frames of a person that it solved.
    pub(super) busy_s: f64,
    pub(super) solved: u64,
    before: BTreeMap<u64, Sample>,
}

/// What only bodies have. `None` where nothing was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BodyFigures {
    /// Root mean square error of the elbows' bend, degrees.
    pub elbow_deg: Option<f64>,
    /// Of the knees'.
    pub knee_deg: Option<f64>,
    /// Of where upper arms point in the trunk's axes.
    pub shoulder_deg: Option<f64>,
    /// Of where upper legs do.
    pub hip_deg: Option<f64>,
    /// Elbows and knees that turn over, per minute and person.
    pub flips_per_min: Option<f64>,
    /// How far feet that stand move, mm per second of standing.
    pub skate_mm_per_s: Option<f64>,
    /// What solving took, microseconds per person and frame.
    pub us_per_person_frame: Option<f64>,
}

impl BodyTally {
    pub(super) fn add(&mut self, person: u64, sample: Sample) {
        self.add_angles(&sample);
        if let Some(before) = self.before.get(&person) {
            let step = sample.time.since_seconds(before.time);
            if step > 0.0 && step <= LONGEST_STEP_S && before.track == sample.track {
                self.person_s += step;
                self.flips += flips(before, &sample);
                let (skated_m, stood_s) = skate(before, &sample, step);
                self.skated_m += skated_m;
                self.stood_s += stood_s;
            }
        }
        self.before.insert(person, sample);
    }

    /// Nobody goes on from here.
    pub(super) fn end(&mut self) {
        self.before.clear();
    }

    /// Takes in another's.
    pub fn merge(&mut self, other: &Self) {
        for (mean, other) in self.angles.iter_mut().zip(&other.angles) {
            mean.merge(other);
        }
        self.flips += other.flips;
        self.person_s += other.person_s;
        self.skated_m += other.skated_m;
        self.stood_s += other.stood_s;
        self.busy_s += other.busy_s;
        self.solved += other.solved;
    }

    /// The figures.
    pub fn figures(&self) -> BodyFigures {
        let rms = |index: usize| self.angles[index].mean().map(f64::sqrt);
        let per = |sum: f64, whole: f64| (whole > 0.0).then(|| sum / whole);
        BodyFigures {
            elbow_deg: rms(0),
            knee_deg: rms(1),
            shoulder_deg: rms(2),
            hip_deg: rms(3),
            flips_per_min: per(60.0 * self.flips as f64, self.person_s),
            skate_mm_per_s: per(1e3 * self.skated_m, self.stood_s),
            us_per_person_frame: per(1e6 * self.busy_s, self.solved as f64),
        }
    }

    fn add_angles(&mut self, sample: &Sample) {
        for (index, limb) in LIMBS.into_iter().enumerate() {
            let kind = index / 2;
            if let (Some(made), Some(truth)) =
                (bend(&sample.joints, limb), bend(&sample.truth, limb))
            {
                self.angles[kind].add((made - truth).to_degrees().powi(2));
            }
            let directions = (
                direction(&sample.joints, limb),
                direction(&sample.truth, limb),
            );
            if let (Some(made), Some(truth)) = directions {
                self.angles[2 + kind].add(made.angle(&truth).to_degrees().powi(2));
            }
        }
    }
}

fn line(joints: &Joints, from: Joint, to: Joint) -> Option<Vector3<f64>> {
    (joints[to]?.vector() - joints[from]?.vector()).try_normalize(1e-6)
}

/// How far a limb is bent, radians.
fn bend(joints: &Joints, [a, b, c]: [Joint; 3]) -> Option<f64> {
    Some(line(joints, a, b)?.angle(&line(joints, b, c)?))
}

/// Where a limb's upper bone points in the trunk's axes.
fn direction(joints: &Joints, [a, b, _]: [Joint; 3]) -> Option<Vector3<f64>> {
    Some(trunk_axes(joints)?.transpose() * line(joints, a, b)?)
}

/// The axes square to each limb's two bones.
pub(super) fn bends(joints: &Joints) -> Bends {
    LIMBS.map(|[a, b, c]| {
        line(joints, a, b)?
            .cross(&line(joints, b, c)?)
            .try_normalize(1e-9)
    })
}

/// The axes about which the bones of a pose bend.
pub(super) fn hinges(rig: &Rig, pose: &RigPose) -> Bends {
    let placed = rig.place(pose);
    let axis = |joint: Joint, axis: Vector3<f64>| {
        let bone = rig
            .bones
            .iter()
            .position(|bone| bone.joint == Some(joint))?;
        // The hinge belongs to the bone above.
        let (_, axes) = placed[rig.bones[bone].parent?];
        Some(axes * axis)
    };
    [
        axis(Joint::ElbowLeft, -Vector3::z()),
        axis(Joint::ElbowRight, Vector3::z()),
        axis(Joint::KneeLeft, Vector3::y()),
        axis(Joint::KneeRight, Vector3::y()),
    ]
}

fn flips(before: &Sample, now: &Sample) -> u64 {
    let turned = |a: Option<Vector3<f64>>, b: Option<Vector3<f64>>| Some(a?.dot(&b?) < 0.0);
    let limbs = 0..LIMBS.len();
    let flipped = limbs.filter(|&limb| {
        turned(before.bends[limb], now.bends[limb]) == Some(true)
            && turned(before.true_bends[limb], now.true_bends[limb]) == Some(false)
    });
    flipped.count() as u64
}

/// Metres that standing feet moved over the floor (mean of ankle and foot), and seconds of standing.
fn skate(before: &Sample, now: &Sample, step: f64) -> (f64, f64) {
    use Joint::*;
    let (Some(stood), Some(stands)) = (before.stands, now.stands) else {
        return (0.0, 0.0);
    };
    let (mut metres, mut seconds) = (0.0, 0.0);
    for (side, points) in [[AnkleLeft, FootLeft], [AnkleRight, FootRight]]
        .into_iter()
        .enumerate()
    {
        for joint in points {
            if let (true, true, Some(a), Some(b)) = (
                stood[side],
                stands[side],
                before.joints[joint],
                now.joints[joint],
            ) {
                metres += (b.vector() - a.vector()).xy().norm();
                seconds += step;
            }
        }
    }
    (metres, seconds)
}
