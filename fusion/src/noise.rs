//! How far a depth sensor's joint may be off, by distance and direction.
//!
//! Lateral 1.5 px * 0.8 * z/585 m, axial 0.0012 + 0.0019 (z - 0.4)^2 m (Nguyen, Izadi and Lovell 2012),
//! neither below 1 cm; a joint of low confidence is off by some 12 cm whatever the distance.

use nalgebra::{Matrix3, Vector3};

/// No joint is taken to be better than this, metres.
const FLOOR_M: f64 = 0.01;
/// Standard deviation of a joint that the tracker only guesses, metres.
const GUESSED_M: f64 = 0.12;
/// Standard deviation of a joint without any confidence, metres.
const UNTRUSTED_M: f64 = 0.25;
/// How fast an old sample loses worth, metres per second of age (what velocity does not explain).
const AGEING_MPS: f64 = 0.4;

/// The noise of one joint as one sensor sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Along the line of sight, unit vector.
    ray: Vector3<f64>,
    lateral: f64,
    axial: f64,
}

impl Noise {
    /// For a joint at `position` seen from `origin` (room frame, metres) with `confidence`; at least
    /// `trusted` means no guess. The sample was `age_s` old when used.
    pub(crate) fn of(
        position: Vector3<f64>,
        origin: Vector3<f64>,
        confidence: f64,
        trusted: f64,
        age_s: f64,
    ) -> Self {
        let image = Self::of_image(position, origin);
        let guess = guess_sigma(confidence, trusted);
        let ageing = AGEING_MPS * age_s;
        let extra = guess * guess + ageing * ageing;
        let floor = FLOOR_M * FLOOR_M;
        Self {
            ray: image.ray,
            lateral: image.lateral.max(floor) + extra,
            axial: image.axial.max(floor) + extra,
        }
    }

    /// `times` the variance in every direction.
    pub(crate) fn louder(self, times: f64) -> Self {
        Self {
            lateral: self.lateral * times,
            axial: self.axial * times,
            ..self
        }
    }

    /// What the depth image alone lets a joint at `position`, seen from `origin`, be off.
    pub(crate) fn of_image(position: Vector3<f64>, origin: Vector3<f64>) -> Self {
        let line = position - origin;
        let z = line.norm();
        let ray = if z > 1e-6 { line / z } else { Vector3::z() };
        let lateral = 1.5 * 0.8 / 585.0 * z;
        let axial = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
        Self {
            ray,
            lateral: lateral * lateral,
            axial: axial * axial,
        }
    }

    /// By how much the variance of a guess grows where confidence falls below that of a usual guess; `trusted` is what
    /// makes it none.
    pub(crate) fn of_guess(confidence: f64, trusted: f64) -> f64 {
        let sigma_m = guess_sigma(confidence, trusted);
        f64::max(1.0, sigma_m * sigma_m / (GUESSED_M * GUESSED_M))
    }

    /// With `variance` (m^2) more in every direction.
    pub(crate) fn plus(self, variance: f64) -> Self {
        Self {
            lateral: self.lateral + variance,
            axial: self.axial + variance,
            ..self
        }
    }

    /// Mean over the axes, m^2.
    pub(crate) fn mean_variance(&self) -> f64 {
        (2.0 * self.lateral + self.axial) / 3.0
    }

    /// Covariance, m^2, room frame.
    pub(crate) fn covariance(&self) -> Matrix3<f64> {
        spread(self.ray, self.lateral, self.axial)
    }

    /// Inverse of the covariance, 1/m^2.
    pub(crate) fn information(&self) -> Matrix3<f64> {
        spread(self.ray, 1.0 / self.lateral, 1.0 / self.axial)
    }
}

/// `across` in every direction but `ray`, `along` in that one.
fn spread(ray: Vector3<f64>, across: f64, along: f64) -> Matrix3<f64> {
    let mut matrix = (ray * (along - across)) * ray.transpose();
    for i in 0..3 {
        matrix[(i, i)] += across;
    }
    matrix
}

/// 0 from `trusted` on, then up over a guess to no trust at all; metres.
fn guess_sigma(confidence: f64, trusted: f64) -> f64 {
    if confidence >= trusted {
        return 0.0;
    }
    let share = (confidence / (0.5 * trusted)).clamp(0.0, 1.0);
    UNTRUSTED_M + (GUESSED_M - UNTRUSTED_M) * share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn information_is_the_inverse_and_depth_is_the_worst_direction() {
        let noise = Noise::of(
            Vector3::new(3.0, 1.0, 0.5),
            Vector3::new(-1.0, 0.0, 1.5),
            1.0,
            0.75,
            0.02,
        );
        let identity = noise.covariance() * noise.information();
        assert!((identity - Matrix3::identity()).norm() < 1e-9);
        let along = (noise.ray.transpose() * noise.covariance() * noise.ray)[0];
        assert!((along - noise.axial).abs() < 1e-12 && noise.axial > noise.lateral);
    }

    #[test]
    fn less_confidence_never_means_less_noise() {
        let sigmas: Vec<f64> = (0..=20)
            .map(|i| guess_sigma(f64::from(i) * 0.05, 0.75))
            .collect();
        assert!(sigmas.windows(2).all(|w| w[1] <= w[0]), "{sigmas:?}");
        assert_eq!(sigmas[20], 0.0);
    }
}
