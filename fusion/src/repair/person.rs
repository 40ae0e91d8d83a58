//! One person: what was measured of them, and how what is made up goes into a frame.
//!
//! A fill and what the filter still knows of the joint are combined by their covariances, so a joint that was seen a
//! moment ago, or is seen badly, is drawn by the model only as far as it is unknown. What is measured with trust is never
//! touched, but for a joint that comes back from a place where it was not expected.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{
    Confidence, JOINT_COUNT, Joint, JointMap, JointState, Position, Provenance, Room, Skeleton,
    Timestamp,
};
use serde::{Deserialize, Serialize};

use super::blend::{Blend, Source};
use super::bones::Lengths;
use super::history::History;
use super::trust::{Standing, Trust};
use super::{Fill, RepairConfig};

/// A joint that counts as measured this far is left alone.
const GOOD_WEIGHT: f64 = 0.8;
/// A model that has less of a say than this is not asked.
const LEAST_SHARE: f64 = 0.05;
/// Blending is never faster than in this share of its time.
const LEAST_BLEND: f64 = 0.25;
/// What a model may say of its own uncertainty, metres.
const LEAST_SIGMA_M: f64 = 0.005;
const MOST_SIGMA_M: f64 = 2.0;
/// Confidence of a joint made up without any doubt, and the doubt at which it is half of that, metres.
const MADE_UP_CONFIDENCE: f64 = 0.5;
const HALF_SIGMA_M: f64 = 0.1;
/// Bits of joints, by their numbers.
pub(crate) type Joints = u32;

/// One person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Person {
    pub(super) history: History,
    lengths: Lengths,
    blends: [Blend; JOINT_COUNT],
    /// When the first frame was.
    first: Timestamp,
    /// Of the frames that have come.
    come: Trust,
    /// Of those that have left.
    left: Trust,
}

impl Person {
    pub(super) fn new(first: Timestamp) -> Self {
        Self {
            history: History::default(),
            lengths: Lengths::default(),
            blends: [Blend::default(); JOINT_COUNT],
            first,
            come: Trust::none(),
            left: Trust::none(),
        }
    }

    /// Left and right were exchanged, or the sensors moved: where the joints were says nothing any more.
    pub(super) fn restart(&mut self) {
        self.history = History::default();
        self.blends = [Blend::default(); JOINT_COUNT];
    }

    /// Takes the next frame's pose in, and says which of the joints `known` to the sensors it lacks.
    pub(super) fn learn(
        &mut self,
        time: Timestamp,
        skeleton: &Skeleton<Room>,
        known: Joints,
        config: &RepairConfig,
    ) -> Joints {
        let standing = self.come.note(time, skeleton);
        let weights = standing.map(|joint| joint.weight);
        self.history.push(time, skeleton, &weights);
        self.lengths.learn(skeleton);
        let mut gaps = 0;
        for (index, joint) in standing.iter().enumerate() {
            let since = joint.measured.unwrap_or(self.first);
            let may = known & 1 << index != 0 && time.since_ns(since) <= config.max_ns();
            if may && joint.weight < GOOD_WEIGHT {
                gaps |= 1 << index;
            }
        }
        gaps
    }

    /// Puts `fills`, which `source` made, into the `gaps` of a frame, and blends. Says how many joints it changed.
    pub(super) fn finish(
        &mut self,
        time: Timestamp,
        skeleton: &mut Skeleton<Room>,
        gaps: Joints,
        made: Option<(&JointMap<Fill>, Source)>,
        blend_s: f64,
    ) -> u64 {
        let mut filled = 0;
        let standing = self.left.note(time, skeleton);
        if let Some((fills, _)) = made {
            for (index, joint) in Joint::ALL.into_iter().enumerate() {
                if gaps & 1 << index != 0
                    && let Some(fill) = fills[joint].filter(is_usable)
                    && let Some(state) =
                        combine(skeleton[joint].as_ref(), time, &standing[index], &fill)
                {
                    skeleton[joint] = Some(state);
                    filled |= 1 << index;
                }
            }
            if filled != 0 {
                self.keep_lengths(skeleton, filled);
            }
        }
        let source = made.map_or(Source::Sensors, |(_, source)| source);
        for (index, joint) in Joint::ALL.into_iter().enumerate() {
            let blend = &mut self.blends[index];
            let Some(state) = &mut skeleton[joint] else {
                blend.end();
                continue;
            };
            let source = match filled & 1 << index {
                0 => Source::Sensors,
                _ => source.with(standing[index].trusted_s.is_some()),
            };
            // Doubt about a joint that came back has taken its part of the time.
            let back_s = standing[index].trusted_s.unwrap_or(0.0);
            let left_s = (blend_s - back_s).max(blend_s * LEAST_BLEND);
            let offset = blend.step(time, state.position.vector(), source, left_s);
            if let Some(offset) = offset {
                shift(state, offset);
                filled |= 1 << index;
            }
        }
        u64::from(filled.count_ones())
    }

    fn keep_lengths(&self, skeleton: &mut Skeleton<Room>, filled: Joints) {
        let mut places =
            Joint::ALL.map(|joint| skeleton.position(joint).map(|place| place.vector()));
        let free = std::array::from_fn(|index| match &skeleton[Joint::ALL[index]] {
            Some(state) if filled & 1 << index != 0 => state.covariance.trace(),
            _ => 0.0,
        });
        self.lengths.keep(&mut places, &free);
        for (index, joint) in Joint::ALL.into_iter().enumerate() {
            if filled & 1 << index != 0
                && let (Some(state), Some(place)) = (&mut skeleton[joint], places[index])
            {
                state.position = Position::from_vector(place);
            }
        }
    }
}

fn is_usable(fill: &Fill) -> bool {
    fill.position.iter().all(|x| x.is_finite()) && fill.sigma_m.is_finite() && fill.sigma_m >= 0.0
}

/// The joint by what is `known` of it at `time`, and what is to be thought of that, and the model's `fill`; `None` where that has next to no say.
fn combine(
    known: Option<&JointState<Room>>,
    time: Timestamp,
    standing: &Standing,
    fill: &Fill,
) -> Option<JointState<Room>> {
    let sigma_m = fill.sigma_m.clamp(LEAST_SIGMA_M, MOST_SIGMA_M);
    let made = Matrix3::from_diagonal_element(sigma_m * sigma_m);
    let worth = standing.worth(time);
    let Some(known) = known.filter(|_| worth > 0.0) else {
        return Some(made_up(fill.position, made));
    };
    let unsaid = Matrix3::from_diagonal_element(standing.unsaid_m * standing.unsaid_m);
    let doubt = (known.covariance + unsaid) / worth;
    let gain = doubt * (doubt + made).try_inverse()?;
    if gain.trace() / 3.0 < LEAST_SHARE {
        return None;
    }
    let from = known.position.vector();
    let covariance = made * gain.transpose();
    Some(made_up(
        from + gain * (fill.position - from),
        (covariance + covariance.transpose()) * 0.5,
    ))
}

fn made_up(place: Vector3<f64>, covariance: Matrix3<f64>) -> JointState<Room> {
    JointState {
        position: Position::from_vector(place),
        covariance,
        confidence: confidence(&covariance),
        provenance: Provenance::Repaired,
    }
}

fn confidence(covariance: &Matrix3<f64>) -> Confidence {
    let odd = covariance.trace() / 3.0 / (HALF_SIGMA_M * HALF_SIGMA_M);
    Confidence::saturating((MADE_UP_CONFIDENCE / (1.0 + odd)) as f32)
}

/// Moves a joint by what it is still off, which is as much as it may be wrong by.
fn shift(state: &mut JointState<Room>, offset: Vector3<f64>) {
    state.position = state.position.moved(offset);
    state.covariance += offset * offset.transpose();
    state.provenance = Provenance::Repaired;
    let less = confidence(&state.covariance);
    if less < state.confidence {
        state.confidence = less;
    }
}
