//! A small motion of a sensor, and the sums from which it is estimated.
//!
//! A motion is a turn about the sensor's origin (radians) and a shift of it (metres), room axes: six numbers, the turn first.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

/// What is believed of a motion before anything is seen, standard deviations: when a stand is bumped it turns by some degrees
/// or is shifted by some centimetres. Where data cannot tell a turn from a shift, this shares it out.
const TURN_RAD: f64 = 0.035;
const SHIFT_M: f64 = 0.05;
/// Keeps sums invertible where nothing at all is seen: 30 degrees, 1 m.
const VAGUE: [f64; 2] = [0.5, 1.0];

/// A small motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Motion(pub(super) Vector6<f64>);

impl Motion {
    /// How far it moves a point at `arm` from the sensor, metres.
    pub(super) fn at(&self, arm: Vector3<f64>) -> Vector3<f64> {
        self.turn().cross(&arm) + self.shift()
    }

    pub(super) fn turn(&self) -> Vector3<f64> {
        self.0.fixed_rows::<3>(0).into()
    }

    pub(super) fn shift(&self) -> Vector3<f64> {
        self.0.fixed_rows::<3>(3).into()
    }
}

/// Normal equations of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Stats {
    /// Information.
    pub(super) h: Matrix6<f64>,
    /// Information times motion.
    pub(super) g: Vector6<f64>,
}

impl Default for Stats {
    fn default() -> Self {
        Self {
            h: Matrix6::zeros(),
            g: Vector6::zeros(),
        }
    }
}

impl Stats {
    /// Takes in a point at `arm` from the sensor that must be moved by `apart` to be where the others see it.
    pub(super) fn add(&mut self, arm: Vector3<f64>, apart: Vector3<f64>, weight: f64) {
        let mut by = Matrix3x6::zeros();
        by.fixed_columns_mut::<3>(0).copy_from(&-arm.cross_matrix());
        by.fixed_columns_mut::<3>(3).copy_from(&Matrix3::identity());
        self.h += by.transpose() * by * weight;
        self.g += by.transpose() * apart * weight;
    }

    pub(super) fn join(&mut self, other: &Self, share: f64) {
        self.h += other.h * share;
        self.g += other.g * share;
    }

    /// Information on a common shift, 1/m^2.
    pub(super) fn weight(&self) -> f64 {
        self.h.fixed_view::<3, 3>(3, 3).trace() / 3.0
    }

    /// The same sums, had every point been moved by `motion` and then by `shift` before.
    pub(super) fn after(&self, motion: &Motion, shift: &Vector3<f64>) -> Self {
        Self {
            h: self.h,
            g: self.g - self.h * motion.0 - self.h.fixed_columns::<3>(3) * shift,
        }
    }

    /// The mean shift, metres.
    pub(super) fn mean(&self) -> Vector3<f64> {
        let g: Vector3<f64> = self.g.fixed_rows::<3>(3).into();
        g / self.weight().max(f64::MIN_POSITIVE)
    }
}

/// An estimated motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub(super) motion: Motion,
    pub(super) covariance: Matrix6<f64>,
    /// Squared distance from no motion in standard deviations, six degrees of freedom.
    pub(super) chi2: f64,
}

impl Estimate {
    /// The turn in standard deviations.
    pub(super) fn turned(&self) -> f64 {
        let turn = self.motion.turn();
        let covariance: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(0, 0).into();
        let information = covariance.try_inverse().unwrap_or_default();
        turn.dot(&(information * turn)).max(0.0).sqrt()
    }
}

/// The motion behind `stats`, seen against a baseline known only to `baseline`.
pub(super) fn estimate(stats: &Stats, baseline: &Matrix6<f64>) -> Option<Estimate> {
    let h = stats.h + vague();
    let own = h.try_inverse()?;
    let found = own * stats.g;
    let information = (own + baseline).try_inverse()?;
    let covariance = (information + believed()).try_inverse()?;
    Some(Estimate {
        motion: Motion(covariance * information * found),
        covariance,
        chi2: found.dot(&(information * found)),
    })
}

/// Root of the trace of a covariance's half: of the turn (radians), of the shift (metres).
pub(super) fn sigmas(covariance: &Matrix6<f64>) -> [f64; 2] {
    [0, 3].map(|at| {
        covariance
            .fixed_view::<3, 3>(at, at)
            .trace()
            .max(0.0)
            .sqrt()
    })
}

fn vague() -> Matrix6<f64> {
    diagonal(VAGUE[0], VAGUE[1])
}

fn believed() -> Matrix6<f64> {
    diagonal(TURN_RAD, SHIFT_M)
}

/// The information of these standard deviations: turn, shift.
pub(super) fn diagonal(turn_rad: f64, shift_m: f64) -> Matrix6<f64> {
    let (turn, shift) = (turn_rad.powi(-2), shift_m.powi(-2));
    Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift))
}
