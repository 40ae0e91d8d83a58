//! `kalman`: one filter per joint and person, fed with each sensor's sample at the sample's own time.
//!
//! At every frame a joint's belief goes on to the frame's time (`motion`). Each sample that has come since is compared
//! with where the belief says the joint was when the sample was taken, so that samples need not come together, in
//! order, or on time. `hidden` finds what the person's own body hides, `evidence` weighs the sensors against each
//! other, `slow` takes off what each is known to be off, `segments` and `bones` let neighbours say what they know,
//! `joint` takes the sum in, `learn` finds out what the sensors are like, and `smooth` goes back for frames that wait.

mod bones;
mod evidence;
mod hidden;
mod joint;
mod learn;
mod motion;
mod segments;
mod slow;
mod smooth;
mod state;
mod words;

use std::collections::VecDeque;
use std::ops::{Range, RangeInclusive};

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint, SensorId, Timestamp};
use serde::{Deserialize, Serialize};

use super::Fused;
use crate::body::{Halves, pairs};
use bones::Bones;
pub(crate) use evidence::Reading;
use evidence::{Evidence, Word, weigh};
use hidden::Flesh;
use joint::JointFilter;
use motion::Motion;
use segments::Segments;
use slow::SlowErrors;
use smooth::{Hindsight, Step};
use words::{Trust, tell_parts, word};

/// No joint moves faster, m/s.
const MAX_SPEED_MPS: f64 = 12.0;

/// One person's filter: all joints, and what is known of the sensors' errors with this person.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct PersonFilter {
    joints: [Option<JointFilter>; JOINT_COUNT],
    bones: Bones,
    segments: Segments,
    /// In order of sensors.
    slow: Vec<SlowErrors>,
    /// Frames that may still be looked back at, oldest first; the newest is the present.
    past: VecDeque<Past>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Past {
    time: Timestamp,
    joints: [Option<Step>; JOINT_COUNT],
}

/// What the filter says of a joint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) fused: Fused,
    /// m/s.
    pub(crate) velocity: Vector3<f64>,
    /// When a sensor last said anything about it.
    pub(crate) seen: Timestamp,
}

/// One sensor's part in one joint of one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) sensor: SensorId,
    pub(crate) joint: usize,
    /// Share of all sensors' weights, 0..=1.
    pub(crate) share: f64,
    /// Consensus all but ignored it though the sensor was sure; `None` where it was not.
    pub(crate) rejected: Option<bool>,
    /// Distance from what the prediction and the other sensors say, metres.
    pub(crate) apart_m: Option<f64>,
}

/// Memory kept between calls; carries nothing from one to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    words: Vec<Word>,
    squares: Vec<f64>,
    /// By reading, bits of the joints that the person's own body hides.
    hidden: Vec<u32>,
}

/// When the filter goes on, and by which rules.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub(crate) time: Timestamp,
    /// Since the last frame, seconds.
    pub(crate) elapsed_s: f64,
    /// Confidence from which on a joint counts as measured with trust.
    pub(crate) trusted: f64,
    /// Frames to be kept before the present.
    pub(crate) keep: usize,
}

impl PersonFilter {
    /// Goes on to `moment` and takes `readings` in. `give` gets every joint that is known, `part` what each sensor had
    /// in it.
    pub(crate) fn advance(
        &mut self,
        moment: &Moment,
        readings: &[Reading],
        scratch: &mut Scratch,
        mut give: impl FnMut(usize, Estimate),
        part: &mut dyn FnMut(Part),
    ) {
        self.meet(readings);
        for slow in &mut self.slow {
            slow.relax(moment.elapsed_s);
        }
        let motion = self.predict(moment);
        let least_fault = self.least_fault(readings);
        self.find_hidden(readings, &mut scratch.hidden);
        scratch.words.clear();
        let mut said: [Range<usize>; JOINT_COUNT] = std::array::from_fn(|_| 0..0);
        let mut evidence: [Option<Evidence>; JOINT_COUNT] = [None; JOINT_COUNT];
        for index in 0..JOINT_COUNT {
            let start = scratch.words.len();
            evidence[index] = self.listen(index, moment, readings, least_fault, scratch);
            said[index] = start..scratch.words.len();
            tell_parts(index, &scratch.words[start..], readings, part);
        }
        self.bones.learn(&evidence);
        self.segments.draw(&mut evidence, moment.elapsed_s);
        self.bones.draw(&mut evidence);
        let mut steps = [None; JOINT_COUNT];
        for (index, evidence) in evidence.iter().enumerate() {
            let words = &scratch.words[said[index].clone()];
            let Some(evidence) = evidence else {
                continue;
            };
            steps[index] = self.take_in(index, moment, motion[index], evidence);
            self.learn_slow(index, words, readings, evidence);
            if let Some(known) = &self.joints[index] {
                give(index, known.estimate(evidence));
            }
        }
        self.learn_faults(moment, readings, scratch, &said);
        self.learn_loudness(moment, readings, scratch);
        self.remember(moment, steps);
    }

    /// Makes room for the slow errors of sensors not met before.
    fn meet(&mut self, readings: &[Reading]) {
        for reading in readings {
            let known = self
                .slow
                .binary_search_by_key(&reading.sensor, |s| s.sensor);
            if let Err(index) = known {
                self.slow.insert(index, SlowErrors::new(reading.sensor));
            }
        }
    }

    /// All joints to the time of `moment`.
    fn predict(&mut self, moment: &Moment) -> [Option<Motion>; JOINT_COUNT] {
        let drift: [Vector3<f64>; JOINT_COUNT] = std::array::from_fn(|index| {
            let parent = Joint::ALL[index].parent();
            let parent = parent.and_then(|parent| self.joints[parent as usize].as_ref());
            parent.map_or_else(Vector3::zeros, |parent| parent.belief.mean[1])
        });
        std::array::from_fn(|index| {
            let slot = &mut self.joints[index];
            if slot.is_some_and(|known| known.is_lost(moment.time)) {
                *slot = None;
            }
            let known = slot.as_mut()?;
            Some(known.predict(Joint::ALL[index], moment, drift[index]))
        })
    }

    /// What every reading says of joint number `index`, behind the other words, and all of it together; `None` where neither
    /// the past nor a sensor knows of the joint. A sensor is as faulty as it is more so than `least_fault` (m^2).
    fn listen(
        &self,
        index: usize,
        moment: &Moment,
        readings: &[Reading],
        least_fault: f64,
        scratch: &mut Scratch,
    ) -> Option<Evidence> {
        let Scratch { words, hidden, .. } = scratch;
        let known = self.joints[index].as_ref();
        // Without a belief the first word is as good an origin as any.
        let first = readings.iter().find(|r| r.body.has(index));
        let expected = match known {
            Some(known) => known.belief.mean[0],
            None => first?.body.position[index],
        };
        let start = words.len();
        for (number, reading) in readings.iter().enumerate() {
            let Some(slow) = self.slow_of(reading.sensor) else {
                continue;
            };
            if !reading.body.has(index) {
                continue;
            }
            let there = known.map_or(expected, |k| k.belief.place_at(-reading.age_s));
            let trust = Trust {
                hidden: hidden[number] & 1 << index != 0,
                fault: slow.fault() - least_fault,
            };
            words.push(Word {
                unsure: known.map(|known| known.belief.place_covariance().trace() / 3.0),
                ..word(number, reading, index, moment, slow, trust, there)
            });
        }
        let soft = Matrix3::from_diagonal_element(PRIOR_M * PRIOR_M);
        let covariance = known.map(|known| known.belief.place_covariance() + soft);
        let prior = covariance.and_then(|covariance| covariance.try_inverse());
        let prior = prior.unwrap_or_else(Matrix3::zeros);
        Some(weigh(&mut words[start..], readings, &prior, expected))
    }

    /// Which joints the person's own body hides from each reading's sensor.
    fn find_hidden(&self, readings: &[Reading], hidden: &mut Vec<u32>) {
        let places = std::array::from_fn(|index| {
            let known = self.joints[index].as_ref()?;
            Some(known.belief.mean[0])
        });
        let flesh = Flesh::new(&places);
        hidden.clear();
        hidden.extend(readings.iter().map(|r| flesh.hides(r.origin, &places)));
    }

    fn slow_of(&self, sensor: SensorId) -> Option<&SlowErrors> {
        let found = self.slow.binary_search_by_key(&sensor, |slow| slow.sensor);
        Some(&self.slow[found.ok()?])
    }

    /// Joint number `index` with what is new of it.
    fn take_in(
        &mut self,
        index: usize,
        moment: &Moment,
        motion: Option<Motion>,
        evidence: &Evidence,
    ) -> Option<Step> {
        let slot = &mut self.joints[index];
        let correction = match slot {
            Some(known) => known.take_in(moment, evidence),
            None => {
                *slot = JointFilter::begin(moment.time, evidence);
                None
            }
        };
        if slot.is_some_and(|known| !known.belief.is_sound()) {
            *slot = None;
        }
        slot.as_ref().map(|known| Step {
            motion,
            correction,
            belief: known.belief,
        })
    }

    fn remember(&mut self, moment: &Moment, joints: [Option<Step>; JOINT_COUNT]) {
        if moment.keep == 0 {
            return;
        }
        while self.past.len() > moment.keep {
            self.past.pop_front();
        }
        let time = moment.time;
        self.past.push_back(Past { time, joints });
    }

    /// Every joint's place (metres) and covariance (m^2) at the times of the earlier frames in `span`, as they look
    /// now.
    pub(crate) fn look_back(
        &self,
        span: &RangeInclusive<Timestamp>,
        mut give: impl FnMut(Timestamp, Joint, Vector3<f64>, Matrix3<f64>),
    ) {
        for joint in Joint::ALL {
            let mut hindsight = Hindsight::none();
            for past in self.past.iter().rev() {
                if past.time < *span.start() {
                    break;
                }
                let Some(step) = &past.joints[joint as usize] else {
                    hindsight = Hindsight::none();
                    continue;
                };
                if past.time <= *span.end() {
                    let (place, covariance) = hindsight.place(step);
                    if place.iter().chain(covariance.iter()).all(|x| x.is_finite()) {
                        give(past.time, joint, place, covariance);
                    }
                }
                hindsight.back(step);
            }
        }
    }

    /// Exchanges left and right in those halves of the body that are set.
    pub(crate) fn mirror(&mut self, halves: Halves<bool>) {
        self.segments.mirror(halves);
        for (left, right) in pairs(halves) {
            self.joints.swap(left, right);
            for past in &mut self.past {
                past.joints.swap(left, right);
            }
            for slow in &mut self.slow {
                slow.swap(left, right);
            }
        }
    }

    /// Forgets what `sensor` was like.
    pub(crate) fn forget_sensor(&mut self, sensor: SensorId) {
        self.slow.retain(|slow| slow.sensor != sensor);
    }
}

/// Among the sensors the prediction counts as no better than this, metres: else it could deny them all.
const PRIOR_M: f64 = 0.01;

impl JointFilter {
    fn estimate(&self, evidence: &Evidence) -> Estimate {
        Estimate {
            fused: Fused {
                position: self.belief.mean[0],
                covariance: self.belief.place_covariance(),
                confidence: self.confidence,
                provenance: evidence.provenance,
            },
            velocity: self.belief.mean[1].cap_magnitude(MAX_SPEED_MPS),
            seen: self.seen,
        }
    }
}

#[cfg(test)]
mod tests;
