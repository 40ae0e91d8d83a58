//! What has been counted of one or more runs. Tallies of runs with the same method can be pooled.

use posefuse_skeleton::JOINT_COUNT;

use crate::beside::Beside;
use crate::histogram::Histogram;

/// A sum and how many went into it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// The sum.
    pub sum: f64,
    /// How many.
    pub count: f64,
}

impl Mean {
    /// Takes in a value.
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1.0;
    }

    /// Takes in all of another's.
    pub fn merge(&mut self, other: &Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// The mean; `None` of nothing.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }
}

/// Counts and sums of one or more runs; [`crate::Metrics`] says what they mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Distance of the joints that a sensor truly sees, and of the others, from the truth.
    pub visible: Histogram,
    /// See `visible`.
    pub occluded: Histogram,
    /// The same from the truth as reported, without the bias of the body.
    pub own_visible: Histogram,
    /// See `own_visible`.
    pub own_occluded: Histogram,
    /// Distance from the truth as reported, by joint.
    pub by_joint: [Mean; JOINT_COUNT],
    /// Joints that people have, over all their frames, and those that were fused.
    pub joints: Mean,
    /// Shift in time, seconds, weighted by how much there was to tell it from.
    pub lag: Mean,
    /// Squared acceleration of the error.
    pub jitter: Mean,
    /// Standard deviation of a bone's length, metres, by person and bone.
    pub bone_sigma: Mean,
    /// Distance of the wrists, metres.
    pub wrist: Mean,
    /// Distance of the wrists from the nearest place that they truly were at about that time, metres.
    pub wrist_shortest: Mean,
    /// How many spikes.
    pub spikes: u64,
    /// How many deviations.
    pub deviations: u64,
    /// Seconds that people were followed, all together.
    pub person_seconds: f64,
    /// People who could be seen, over all frames.
    pub people_frames: u64,
    /// Those of them without a track.
    pub missed: u64,
    /// Tracks, over all frames.
    pub track_frames: u64,
    /// Those of them without a person.
    pub extra: u64,
    /// How often a person's track was another one than before.
    pub id_switches: u64,
    /// People of whom arms and legs, left and right, are where they belong, over all their frames.
    pub sides_right: Mean,
    /// Bodies that sensors reported of people, over all their frames, whose left and right the engine took as they are.
    pub swaps_right: Mean,
    /// Fused frames.
    pub frames: u64,
    /// How much newer the newest sample of a frame was, seconds.
    pub look_ahead: Mean,
    /// How long the engine worked, seconds.
    pub busy_s: f64,
    /// How long it would have had live, seconds.
    pub live_s: f64,
    /// Squares of the noise bounds of the runs, m^2.
    pub bound: Mean,
    /// Leave-one-sensor-out: distance of a sensor's trusted joints from what the others make of them.
    pub left_out: Histogram,
    /// The median of that for each sensor of each run, metres.
    pub left_out_medians: Vec<f64>,
    /// How often left and right of a left-out sensor's body and of the others' fused person agree.
    pub left_out_sides: Mean,
    /// What repair does to the joints of the same frames.
    pub repair: Beside,
}

impl Tally {
    /// Takes in all that another has counted.
    pub fn merge(&mut self, other: &Self) {
        for (mine, theirs) in [
            (&mut self.visible, &other.visible),
            (&mut self.occluded, &other.occluded),
            (&mut self.own_visible, &other.own_visible),
            (&mut self.own_occluded, &other.own_occluded),
            (&mut self.left_out, &other.left_out),
        ] {
            mine.merge(theirs);
        }
        for (mine, theirs) in [
            (&mut self.joints, &other.joints),
            (&mut self.lag, &other.lag),
            (&mut self.jitter, &other.jitter),
            (&mut self.bone_sigma, &other.bone_sigma),
            (&mut self.wrist, &other.wrist),
            (&mut self.wrist_shortest, &other.wrist_shortest),
            (&mut self.sides_right, &other.sides_right),
            (&mut self.swaps_right, &other.swaps_right),
            (&mut self.look_ahead, &other.look_ahead),
            (&mut self.bound, &other.bound),
            (&mut self.left_out_sides, &other.left_out_sides),
        ] {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.by_joint.iter_mut().zip(&other.by_joint) {
            mine.merge(theirs);
        }
        self.spikes += other.spikes;
        self.deviations += other.deviations;
        self.person_seconds += other.person_seconds;
        self.people_frames += other.people_frames;
        self.missed += other.missed;
        self.track_frames += other.track_frames;
        self.extra += other.extra;
        self.id_switches += other.id_switches;
        self.frames += other.frames;
        self.busy_s += other.busy_s;
        self.live_s += other.live_s;
        self.left_out_medians.extend(&other.left_out_medians);
        self.repair.merge(&other.repair);
    }
}
