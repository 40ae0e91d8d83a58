//! What is believed of one joint: place, velocity and acceleration in the room, and how sure that is.
//!
//! The three axes are coupled, because a depth sensor knows the ray's direction worse than those across it. Blocks
//! of 3 x 3 are kept apart; the covariance is symmetric, so that six of the nine are enough.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::motion::Motion;

/// Mean (m, m/s, m/s^2) and covariance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Belief {
    pub(crate) mean: [Vector3<f64>; 3],
    pub(super) cov: Blocks,
}

/// The upper blocks of a symmetric 9 x 9 matrix; p place, v velocity, a acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Blocks {
    pub(super) pp: Matrix3<f64>,
    pub(super) pv: Matrix3<f64>,
    pub(super) pa: Matrix3<f64>,
    pub(super) vv: Matrix3<f64>,
    pub(super) va: Matrix3<f64>,
    pub(super) aa: Matrix3<f64>,
}

/// A 9 x 3 matrix: rows for place, velocity and acceleration.
pub(super) type Column = [Matrix3<f64>; 3];

/// How one measurement of the place changed a belief: what the smoother needs to go back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Correction {
    /// The measurement is `h[0] p + h[1] v + h[2] a`.
    pub(super) h: [f64; 3],
    pub(super) gain: Column,
    /// Inverse covariance of the innovation, 1/m^2.
    pub(super) certainty: Matrix3<f64>,
    /// The same times the innovation, 1/m.
    pub(super) surprise: Vector3<f64>,
}

impl Blocks {
    pub(super) fn zero() -> Self {
        Self::diagonal([0.0; 3])
    }

    /// The same variance in every direction, for place, velocity and acceleration.
    pub(super) fn diagonal(variances: [f64; 3]) -> Self {
        let [pp, vv, aa] = variances.map(Matrix3::from_diagonal_element);
        let none = Matrix3::zeros();
        Self {
            pp,
            pv: none,
            pa: none,
            vv,
            va: none,
            aa,
        }
    }

    /// This matrix times a column of blocks `h[i] * 1`.
    pub(super) fn times(&self, h: [f64; 3]) -> Column {
        [
            self.pp * h[0] + self.pv * h[1] + self.pa * h[2],
            self.pv.transpose() * h[0] + self.vv * h[1] + self.va * h[2],
            self.pa.transpose() * h[0] + self.va.transpose() * h[1] + self.aa * h[2],
        ]
    }

    /// Takes `left * right'` away, which is symmetric.
    fn reduce(&mut self, left: &Column, right: &Column) {
        self.pp -= left[0] * right[0].transpose();
        self.pv -= left[0] * right[1].transpose();
        self.pa -= left[0] * right[2].transpose();
        self.vv -= left[1] * right[1].transpose();
        self.va -= left[1] * right[2].transpose();
        self.aa -= left[2] * right[2].transpose();
    }
}

impl Belief {
    /// At rest at `place`, which is known with `covariance`.
    pub(super) fn at_rest(
        place: Vector3<f64>,
        covariance: Matrix3<f64>,
        velocity_sigma: f64,
        acceleration_sigma: f64,
    ) -> Self {
        let squares = [0.0, velocity_sigma, acceleration_sigma].map(|sigma| sigma * sigma);
        let mut cov = Blocks::diagonal(squares);
        cov.pp = covariance;
        Self {
            mean: [place, Vector3::zeros(), Vector3::zeros()],
            cov,
        }
    }

    /// How uncertain the place is, m^2.
    pub(crate) fn place_covariance(&self) -> Matrix3<f64> {
        self.cov.pp
    }

    /// Where the joint is, `ahead_s` (mostly negative) from now.
    pub(crate) fn place_at(&self, ahead_s: f64) -> Vector3<f64> {
        let [p, v, a] = &self.mean;
        p + v * ahead_s + a * (0.5 * ahead_s * ahead_s)
    }

    /// On in time, by `motion`, in a frame that moves with `drift` (m/s).
    pub(super) fn predict(&mut self, motion: &Motion, drift: Vector3<f64>, elapsed_s: f64) {
        let [p, v, a] = self.mean;
        let own = v - drift;
        self.mean = [
            p + drift * elapsed_s + own * motion.pv + a * motion.pa,
            drift + own * motion.vv + a * motion.va,
            a * motion.aa,
        ];
        self.cov = motion.carry(&self.cov);
        let [pp, pv, pa, vv, va, aa] = motion.noise;
        for axis in 0..3 {
            self.cov.pp[(axis, axis)] += pp;
            self.cov.pv[(axis, axis)] += pv;
            self.cov.pa[(axis, axis)] += pa;
            self.cov.vv[(axis, axis)] += vv;
            self.cov.va[(axis, axis)] += va;
            self.cov.aa[(axis, axis)] += aa;
        }
    }

    /// Takes a measurement of the place `ahead_s` from now, with covariance `noise`, that lies `off` from what was
    /// expected. `None`, and nothing done, where the numbers allow no inverse.
    pub(super) fn correct(
        &mut self,
        off: Vector3<f64>,
        noise: &Matrix3<f64>,
        ahead_s: f64,
    ) -> Option<Correction> {
        let h = [1.0, ahead_s, 0.5 * ahead_s * ahead_s];
        let with = self.cov.times(h);
        let innovation = with[0] * h[0] + with[1] * h[1] + with[2] * h[2] + noise;
        let certainty = symmetric(&innovation).try_inverse()?;
        let gain = with.map(|block| block * certainty);
        for (mean, gain) in self.mean.iter_mut().zip(&gain) {
            *mean += gain * off;
        }
        self.cov.reduce(&gain, &with);
        for block in [&mut self.cov.pp, &mut self.cov.vv, &mut self.cov.aa] {
            *block = symmetric(block);
        }
        Some(Correction {
            h,
            gain,
            certainty,
            surprise: certainty * off,
        })
    }

    /// Whether every number can be used.
    pub(super) fn is_sound(&self) -> bool {
        let finite = self.mean.iter().flatten().all(|x| x.is_finite());
        let diagonals = [&self.cov.pp, &self.cov.vv, &self.cov.aa];
        finite
            && diagonals
                .iter()
                .all(|block| block.diagonal().iter().all(|x| *x > 0.0 && x.is_finite()))
    }
}

pub(super) fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    (matrix + matrix.transpose()) * 0.5
}
