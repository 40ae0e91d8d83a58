//! The slow part of a sensor's errors, learned: calibration, the tracker's own idea of a joint, drift.
//!
//! What one sensor says of a joint differs from what all say together by an amount that changes slowly. It is
//! followed as a first-order process per sensor, person and joint, and taken off the sensor's words. So a joint does
//! not leap when a sensor loses or finds it, and one sensor alone goes on as all together would.
//!
//! A sensor that is off as a whole is remembered for long: where nobody but it and one other sees the person, nothing
//! else tells which of the two is wrong.

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, SensorId};
use serde::{Deserialize, Serialize};

/// Standard deviation per axis, metres, and time constant, seconds, of what a tracker sees.
const SIGMA_M: f64 = 0.011;
const TAU_S: f64 = 1.2;
/// The same of what it guesses, because it does not see the joint.
const GUESS_SIGMA_M: f64 = 0.14;
const GUESS_TAU_S: f64 = 0.35;
/// Neither is ever known better than this, metres.
const FLOOR_M: f64 = 0.006;
const GUESS_FLOOR_M: f64 = 0.03;
/// Loudness is followed with this time constant, seconds, within these limits.
const LOUDNESS_S: f64 = 2.0;
const FIRST_LOUDNESS: f64 = 1.0;
const LEAST_LOUDNESS: f64 = 0.5;
const MOST_LOUDNESS: f64 = 400.0;
/// How far a whole sensor is off is found with the first time constant and forgotten with the second, seconds.
const FAULT_S: f64 = 2.0;
const FAULT_MEMORY_S: f64 = 60.0;
/// Up to this it is what the best sensors are, metres; more than this does not count.
const FAULTLESS_M: f64 = 0.04;
const MOST_FAULT_M: f64 = 0.5;

/// One sensor's slow errors of one person's joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SlowErrors {
    pub(super) sensor: SensorId,
    seen: [Slow; JOINT_COUNT],
    guessed: [Slow; JOINT_COUNT],
    /// By how much the variance of the quick errors is larger than a good sensor's.
    loudness: f64,
    /// How far all its joints are off together, squared, m^2.
    fault: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Slow {
    mean: Vector3<f64>,
    /// Per axis, m^2.
    variance: f64,
}

impl Slow {
    fn unknown(sigma_m: f64) -> Self {
        Self {
            mean: Vector3::zeros(),
            variance: sigma_m * sigma_m,
        }
    }

    fn relax(&mut self, kept: f64, sigma_m: f64) {
        self.mean *= kept;
        self.variance = self.variance * (kept * kept) + sigma_m * sigma_m * (1.0 - kept * kept);
    }
}

impl SlowErrors {
    pub(super) fn new(sensor: SensorId) -> Self {
        Self {
            sensor,
            seen: [Slow::unknown(SIGMA_M); JOINT_COUNT],
            guessed: [Slow::unknown(GUESS_SIGMA_M); JOINT_COUNT],
            loudness: FIRST_LOUDNESS,
            fault: 0.0,
        }
    }

    /// On in time.
    pub(super) fn relax(&mut self, elapsed_s: f64) {
        self.fault *= (-elapsed_s / FAULT_MEMORY_S).exp();
        let kept = (-elapsed_s / TAU_S).exp();
        let guesses_kept = (-elapsed_s / GUESS_TAU_S).exp();
        for (seen, guessed) in self.seen.iter_mut().zip(&mut self.guessed) {
            seen.relax(kept, SIGMA_M);
            guessed.relax(guesses_kept, GUESS_SIGMA_M);
        }
    }

    /// Mean (metres) and variance (m^2) of the error of joint number `index` when it is seen (`sure`) or guessed.
    pub(super) fn of(&self, index: usize, sure: bool) -> (Vector3<f64>, f64) {
        let slow = if sure { &self.seen } else { &self.guessed };
        (slow[index].mean, slow[index].variance)
    }

    /// A sample of joint number `index`, its known slow error taken off, turned out to be `off` from the truth with
    /// variance `noise` (m^2), and counted with `weight`.
    pub(super) fn learn(
        &mut self,
        index: usize,
        sure: bool,
        off: Vector3<f64>,
        noise: f64,
        weight: f64,
    ) {
        let (slow, floor_m) = if sure {
            (&mut self.seen[index], FLOOR_M)
        } else {
            (&mut self.guessed[index], GUESS_FLOOR_M)
        };
        let gain = slow.variance / (slow.variance + noise / weight.max(1e-3));
        slow.mean += off * gain;
        slow.variance = (slow.variance * (1.0 - gain)).max(floor_m * floor_m);
    }

    /// By how much the variance of the sensor's quick errors is larger than a good sensor's.
    pub(super) fn loudness(&self) -> f64 {
        self.loudness
    }

    /// The variance of what a tracker sees and has not been learned at all, m^2.
    pub(super) fn usual(&self) -> f64 {
        SIGMA_M * SIGMA_M
    }

    /// One frame's joints were this much louder than expected, in the middle.
    pub(super) fn listen(&mut self, loudness: f64, elapsed_s: f64) {
        let share = (elapsed_s / LOUDNESS_S).min(0.2);
        let heard = loudness.clamp(LEAST_LOUDNESS, MOST_LOUDNESS);
        self.loudness += share * (heard - self.loudness);
    }

    /// How much variance a sensor as faulty as this has in every direction, m^2; none for a good one.
    pub(super) fn fault(&self) -> f64 {
        (self.fault - FAULTLESS_M * FAULTLESS_M).max(0.0)
    }

    /// In one frame the sensor's joints were off by the square root of `squared` (m^2), in the middle.
    pub(super) fn blame(&mut self, squared: f64, elapsed_s: f64) {
        let share = (elapsed_s / FAULT_S).min(0.2);
        let heard = squared.clamp(0.0, MOST_FAULT_M * MOST_FAULT_M);
        self.fault += share * (heard - self.fault);
    }

    /// Exchanges two joints.
    pub(super) fn swap(&mut self, left: usize, right: usize) {
        self.seen.swap(left, right);
        self.guessed.swap(left, right);
    }
}
