//! One joint's filter: on in time, and what is new taken in.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{Joint, Timestamp};
use serde::{Deserialize, Serialize};

use super::Moment;
use super::evidence::Evidence;
use super::motion::{Motion, liveliness};
use super::state::{Belief, Correction};

/// Standard deviation of the velocity and acceleration of a joint seen for the first time, m/s and m/s^2.
const FIRST_VELOCITY: f64 = 1.0;
const FIRST_ACCELERATION: f64 = 5.0;
/// A joint that nobody has seen for this long begins anew when it is seen again, ns.
const FORGET_NS: i64 = 1_000_000_000;
/// A joint without a trusted word for this long coasts with the joint it hangs on, ns.
const COAST_AFTER_NS: i64 = 100_000_000;
/// Confidence of an unseen joint dies away with this time constant, seconds.
const COAST_CONFIDENCE_S: f64 = 0.3;
/// What is known of a place that nothing but bones hold, at least, 1/m^2.
const LEAST_INFORMATION: f64 = 1.0;
/// How fast a joint is found to be livelier, or calmer, than usual: time constant, seconds.
const STIR_S: f64 = 0.15;
/// No surprise counts for more than this, in units of what is expected.
const MOST_SURPRISE: f64 = 4.0;
/// By how much the variance of the acceleration may differ from what is usual, either way.
const LEAST_STIR: f64 = 0.1;
const MOST_STIR: f64 = 10.0;

/// The filter and its state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct JointFilter {
    pub(super) belief: Belief,
    /// When it was last seen by anyone, and when with trust.
    pub(super) seen: Timestamp,
    pub(super) trusted: Timestamp,
    pub(super) confidence: f64,
    /// By how much the variance of its acceleration is larger than usual.
    stir: f64,
}

impl JointFilter {
    /// A joint that nobody has believed in before; `None` where the evidence says too little.
    pub(super) fn begin(time: Timestamp, evidence: &Evidence) -> Option<Self> {
        Some(Self {
            belief: Belief::at_rest(
                evidence.expected + evidence.middle,
                evidence.covariance?,
                FIRST_VELOCITY,
                FIRST_ACCELERATION,
            ),
            seen: time,
            trusted: time,
            confidence: evidence.confidence?,
            stir: 1.0,
        })
    }

    /// Whether it has not been seen for so long that it is better begun anew.
    pub(super) fn is_lost(&self, time: Timestamp) -> bool {
        time.since_ns(self.seen) > FORGET_NS
    }

    /// Goes on to `moment`; once it coasts, with `drift`, the velocity of the joint it hangs on.
    pub(super) fn predict(&mut self, joint: Joint, moment: &Moment, drift: Vector3<f64>) -> Motion {
        let variance = liveliness(joint).powi(2) * self.stir;
        let unseen_ns = moment.time.since_ns(self.trusted) - COAST_AFTER_NS;
        let coast_s = (unseen_ns as f64 * 1e-9).clamp(0.0, moment.elapsed_s);
        let known_s = moment.elapsed_s - coast_s;
        let known = Motion::new(known_s, variance, true);
        self.belief.predict(&known, Vector3::zeros(), known_s);
        if coast_s == 0.0 {
            return known;
        }
        let coasting = Motion::new(coast_s, variance, false);
        self.belief.predict(&coasting, drift, coast_s);
        known.then(&coasting)
    }

    /// Takes the sum of what was said in.
    pub(super) fn take_in(&mut self, moment: &Moment, evidence: &Evidence) -> Option<Correction> {
        match evidence.confidence {
            Some(confidence) => {
                self.seen = moment.time;
                self.confidence = confidence;
            }
            None => self.confidence *= (-moment.elapsed_s / COAST_CONFIDENCE_S).exp(),
        }
        if evidence.trusted {
            self.trusted = moment.time;
        }
        if evidence.information == Matrix3::zeros() {
            return None;
        }
        let least = Matrix3::from_diagonal_element(LEAST_INFORMATION);
        let noise = (evidence.information + least).try_inverse()?;
        let off = noise * evidence.pull;
        let correction = self.belief.correct(off, &noise, -evidence.age_s)?;
        if evidence.trusted {
            let surprise = correction.surprise.dot(&off) / 3.0;
            let share = moment.elapsed_s.min(STIR_S) / STIR_S;
            let stir = self.stir * (share * (surprise.min(MOST_SURPRISE) - 1.0)).exp();
            self.stir = stir.clamp(LEAST_STIR, MOST_STIR);
        }
        Some(correction)
    }
}
