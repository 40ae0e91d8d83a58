//! Weights that do not jump.
//!
//! A body of fixed lengths agrees with no set of fused joints to the millimetre: trackers are off, each in its own way.
//! What it settles on depends on how much each joint counts. Where sensors come and go, covariances jump from one frame to
//! the next though the joints hardly move; so weights follow them gradually, and a joint that was missing comes in gradually.
//!
//! Gradually upwards: the weight itself is drawn towards the new one. Downwards the covariance is, which is much quicker
//! where a joint is lost: what is no longer seen must not hold a limb.

use nalgebra::Matrix3;
use posefuse_skeleton::JOINT_COUNT;

/// A joint that comes back begins with this standard deviation, metres.
const UNKNOWN_M: f64 = 0.3;
/// What is known worse than this is not known, metres: with such numbers there is nothing to reckon.
const WORST_M: f64 = 1.0;

/// How much each joint counts.
#[derive(Clone, Debug)]
pub(crate) struct Weights {
    /// Covariances, m^2.
    kept: [Option<Matrix3<f64>>; JOINT_COUNT],
    /// Share of what is new in this frame.
    gain: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            kept: [None; JOINT_COUNT],
            gain: 1.0,
        }
    }
}

impl Weights {
    /// The next frame comes `elapsed` seconds after the last; `None`: it is the first, or a new beginning.
    pub(crate) fn step(&mut self, elapsed: Option<f64>, steady_s: f64) {
        self.gain = match elapsed {
            Some(elapsed) if steady_s > 0.0 => 1.0 - (-elapsed / steady_s).exp(),
            _ => 1.0,
        };
    }

    /// The weight of joint number `index` in this frame, 1/m^2, whose covariance is `now`; `None` where it is missing or as good
    /// as.
    pub(crate) fn of(&mut self, index: usize, now: Option<Matrix3<f64>>) -> Option<Matrix3<f64>> {
        let kept = &mut self.kept[index];
        let known = now.filter(|now| now.trace() < WORST_M * WORST_M);
        let Some((now, weight)) = known.and_then(|now| Some((now, inverse(&now)?))) else {
            *kept = None;
            return None;
        };
        let gain = self.gain;
        let unknown = Matrix3::from_diagonal_element(UNKNOWN_M * UNKNOWN_M);
        let before = kept.unwrap_or(unknown);
        let (covariance, weight) = if now.trace() < before.trace() {
            let before = inverse(&before)?;
            let weight = before + (weight - before) * gain;
            (inverse(&weight)?, weight)
        } else {
            let covariance = before + (now - before) * gain;
            (covariance, inverse(&covariance)?)
        };
        *kept = Some(covariance);
        Some(weight)
    }
}

/// The inverse of a symmetric matrix; `None` unless it is positive definite.
fn inverse(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    Some(matrix.cholesky()?.inverse())
}
