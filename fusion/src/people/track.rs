//! One person followed over time: the present pose, and each sensor's latest samples of it.
//!
//! Room frame, metres; times in the server's clock.

use std::collections::VecDeque;

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Provenance, SensorId, SensorSet, Timestamp, TrackId};
use serde::{Deserialize, Serialize};

use super::swap::SwapOdds;
use crate::body::{Body, Halves, pairs};
use crate::fuse::kalman::PersonFilter;

/// Samples kept per sensor: so many, and up to so many while frames are held back and have not come to them.
const MIN_SAMPLES: usize = 6;
const MAX_SAMPLES: usize = 48;
/// Samples further apart than this are not interpolated, ns.
const MAX_BRIDGE_NS: i64 = 150_000_000;
/// A pose is carried on by its velocity for at most this long, seconds.
const MAX_CARRY_S: f64 = 0.3;
/// A joint unseen for this much longer than the person says nothing about where they are, ns.
const MAX_STALE_NS: i64 = 500_000_000;
/// Velocity left to itself dies away with this time constant, seconds.
pub(crate) const VELOCITY_DECAY_S: f64 = 0.15;

/// What is known of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct JointEstimate {
    pub(crate) position: Vector3<f64>,
    /// m/s.
    pub(crate) velocity: Vector3<f64>,
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) confidence: f64,
    pub(crate) provenance: Provenance,
    /// When a sensor last said anything about it.
    pub(crate) seen: Timestamp,
}

/// One sensor's body at one instant, left and right already put right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sample {
    pub(crate) time: Timestamp,
    pub(crate) body: Body,
}

/// One sensor's view of the person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Source {
    pub(crate) sensor: SensorId,
    /// The sensor's own id of the person.
    pub(crate) tracking_id: u64,
    /// Whether its left and right were exchanged in its latest sample.
    pub(crate) mirrored: Halves<bool>,
    /// How sure that is.
    pub(crate) swap: SwapOdds,
    /// How well its own labels agree with feet, knees, walk and view, -1..=1, latest sample.
    pub(crate) facing_cue: Halves<f64>,
    /// Oldest first.
    pub(crate) samples: VecDeque<Sample>,
    /// Time of the newest sample that went into the track's filter.
    pub(crate) taken: Option<Timestamp>,
}

/// A person, or what may become one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct TrackState {
    /// Internal number, counts all candidates.
    pub(crate) key: u64,
    /// Given at birth.
    pub(crate) id: Option<TrackId>,
    pub(crate) since: Timestamp,
    pub(crate) hits: u32,
    pub(crate) last_seen: Timestamp,
    /// The time `pose` belongs to.
    pub(crate) pose_time: Timestamp,
    pub(crate) pose: [Option<JointEstimate>; JOINT_COUNT],
    /// What lies behind `pose`, for the method that has a memory.
    pub(crate) filter: PersonFilter,
    /// In order of sensors, so that sums are.
    pub(crate) sources: Vec<Source>,
    /// Integrated evidence that left and right are right, seconds of full agreement.
    pub(crate) facing: Halves<f64>,
    /// The sensors that contributed to the present pose.
    pub(crate) sensors: SensorSet,
}

/// A sample of one sensor moved to an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    near: &'a Sample,
    next: Option<(&'a Sample, f64)>,
    /// Seconds from the sample to the instant.
    move_s: f64,
}

impl View<'_> {
    /// The probability that the left (0) or the right (1) hand is closed.
    pub(crate) fn hand_closed(&self, side: usize) -> Option<f32> {
        let of = |sample: &Sample| sample.body.hands_closed[side];
        match self.next {
            Some((next, share)) if share > 0.5 => of(next),
            _ => of(self.near),
        }
    }

    /// Joint number `index` at the instant: position, confidence, seconds it was moved.
    pub(crate) fn joint(
        &self,
        index: usize,
        velocity: Vector3<f64>,
    ) -> Option<(Vector3<f64>, f64, f64)> {
        let body = &self.near.body;
        if !body.has(index) {
            return None;
        }
        let confidence = f64::from(body.confidence[index]);
        match self.next {
            Some((next, share)) if next.body.has(index) => {
                let position = body.position[index].lerp(&next.body.position[index], share);
                let other = f64::from(next.body.confidence[index]);
                Some((position, confidence.min(other), 0.0))
            }
            _ => {
                let position = body.position[index] + velocity * self.move_s;
                Some((position, confidence, self.move_s.abs()))
            }
        }
    }
}

impl Source {
    /// The sensor's view at `time`: between two samples, or the nearest one if it is at most `max_age_ns` off.
    pub(crate) fn view(&self, time: Timestamp, max_age_ns: i64) -> Option<View<'_>> {
        // Nearly always among the newest.
        let before = self.samples.iter().rposition(|s| s.time < time);
        let after = before.map_or(0, |index| index + 1);
        let after = (after < self.samples.len()).then_some(after);
        if let (Some(a), Some(b)) = (before, after) {
            let (a, b) = (&self.samples[a], &self.samples[b]);
            let gap_ns = b.time.since_ns(a.time);
            if gap_ns <= MAX_BRIDGE_NS && b.time > time {
                let share = time.since_ns(a.time) as f64 / gap_ns as f64;
                return Some(View {
                    near: a,
                    next: Some((b, share)),
                    move_s: time.since_seconds(a.time),
                });
            }
        }
        [after, before]
            .into_iter()
            .flatten()
            .map(|index| &self.samples[index])
            .map(|near| (time.since_ns(near.time), near))
            .filter(|(age_ns, _)| age_ns.abs() <= max_age_ns)
            .min_by_key(|(age_ns, _)| age_ns.abs())
            .map(|(age_ns, near)| View {
                near,
                next: None,
                move_s: age_ns as f64 * 1e-9,
            })
    }

    /// Time of the newest sample.
    pub(crate) fn newest(&self) -> Option<Timestamp> {
        self.samples.back().map(|s| s.time)
    }

    /// Adds a sample; one that is not newer than the newest is dropped. The next frame comes after `fused`.
    pub(crate) fn push(&mut self, sample: Sample, fused: Timestamp) {
        if self.newest().is_some_and(|newest| sample.time <= newest) {
            return;
        }
        let passed = |second: &Sample| second.time <= fused;
        while self.samples.len() >= MAX_SAMPLES
            || self.samples.len() >= MIN_SAMPLES && self.samples.get(1).is_some_and(passed)
        {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }
}

impl TrackState {
    /// A candidate made of one body.
    pub(crate) fn spawn(key: u64, time: Timestamp) -> Self {
        Self {
            key,
            id: None,
            since: time,
            hits: 0,
            last_seen: time,
            pose_time: time,
            pose: [None; JOINT_COUNT],
            filter: PersonFilter::default(),
            sources: Vec::new(),
            facing: [0.0; 2],
            sensors: SensorSet::EMPTY,
        }
    }

    /// Whether no joint has a place.
    pub(crate) fn is_nowhere(&self) -> bool {
        self.pose.iter().all(Option::is_none)
    }

    /// The pose carried to `time` by its velocity, without joints that the sensors lost long before the person.
    pub(crate) fn predicted(&self, time: Timestamp, into: &mut Body) {
        let elapsed_s = time
            .since_seconds(self.pose_time)
            .clamp(-MAX_CARRY_S, MAX_CARRY_S);
        let carry_s = VELOCITY_DECAY_S * (elapsed_s / VELOCITY_DECAY_S).tanh();
        into.mask = 0;
        for (index, joint) in self.pose.iter().enumerate() {
            if let Some(joint) = joint
                && self.last_seen.since_ns(joint.seen) <= MAX_STALE_NS
            {
                into.set(
                    index,
                    joint.position + joint.velocity * carry_s,
                    joint.confidence as f32,
                );
            }
        }
    }

    /// The source of `sensor`, if it ever saw the person.
    pub(crate) fn source(&self, sensor: SensorId) -> Option<&Source> {
        let index = self
            .sources
            .binary_search_by_key(&sensor, |s| s.sensor)
            .ok()?;
        Some(&self.sources[index])
    }

    /// The source of `sensor`, made if need be.
    pub(crate) fn source_mut(&mut self, sensor: SensorId, tracking_id: u64) -> &mut Source {
        let index = match self.sources.binary_search_by_key(&sensor, |s| s.sensor) {
            Ok(index) => index,
            Err(index) => {
                self.sources.insert(
                    index,
                    Source {
                        sensor,
                        tracking_id,
                        mirrored: [false; 2],
                        swap: SwapOdds::default(),
                        facing_cue: [0.0; 2],
                        samples: VecDeque::with_capacity(MIN_SAMPLES),
                        taken: None,
                    },
                );
                index
            }
        };
        &mut self.sources[index]
    }

    /// Sensors with a sample not older than `since`.
    pub(crate) fn sensors_since(&self, since: Timestamp) -> SensorSet {
        self.sources
            .iter()
            .filter(|s| s.newest().is_some_and(|newest| newest >= since))
            .map(|s| s.sensor)
            .collect()
    }

    /// Exchanges left and right of all that is known, in those halves of the body that are set.
    pub(crate) fn mirror(&mut self, halves: Halves<bool>) {
        for (left, right) in pairs(halves) {
            self.pose.swap(left, right);
        }
        self.filter.mirror(halves);
        for source in &mut self.sources {
            source.swap.flip(halves);
            for sample in &mut source.samples {
                sample.body.mirror(halves);
            }
        }
        for (half, _) in halves.into_iter().enumerate().filter(|(_, set)| *set) {
            self.facing[half] = -self.facing[half];
            for source in &mut self.sources {
                source.mirrored[half] = !source.mirrored[half];
            }
        }
    }

    /// Forgets where the person is, but not who: for when the sensors were moved.
    pub(crate) fn uproot(&mut self) {
        self.pose = [None; JOINT_COUNT];
        self.filter = PersonFilter::default();
        self.sensors = SensorSet::EMPTY;
        for source in &mut self.sources {
            source.samples.clear();
        }
    }
}
