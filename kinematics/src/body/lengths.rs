//! A length that never changes, from many noisy pairs of points.

use posefuse_skeleton::{JointState, Room};

/// So many samples are kept of one length: every second one is dropped where there are more, then every fourth ...
const MOST_SAMPLES: usize = 2048;
/// Fewer say nothing.
const FEWEST_SAMPLES: usize = 10;
/// Samples further off than this many of their own standard deviations count less (Huber 1964).
const HUBER: f64 = 1.5;
const ROUNDS: usize = 8;
/// A tracker is off by a little that no covariance tells, metres.
const LEAST_SIGMA_M: f64 = 0.004;

/// Samples of one number, each with a variance.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    kept: Vec<(f64, f64)>,
    /// Of what comes, one in so many is kept (a power of two).
    every: usize,
    seen: usize,
}

/// The result: value and standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub(super) value: f64,
    pub(super) sigma: f64,
}

impl Samples {
    pub(super) fn add(&mut self, value: f64, variance: f64) {
        if !(value.is_finite() && variance.is_finite() && variance > 0.0) {
            return;
        }
        let every = self.every.max(1);
        if self.seen.is_multiple_of(every) {
            self.kept.push((value, variance));
        }
        self.seen += 1;
        if self.kept.len() > MOST_SAMPLES {
            let mut index = 0;
            self.kept.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.every = 2 * every;
        }
    }

    /// The distance of two points. Noise across the line makes distances longer: by its variance over twice the distance,
    /// which is taken off.
    pub(super) fn add_distance(&mut self, a: &JointState<Room>, b: &JointState<Room>) {
        let line = b.position.vector() - a.position.vector();
        let distance = line.norm();
        let Some(along) = line.try_normalize(1e-6) else {
            return;
        };
        let covariance = a.covariance + b.covariance;
        let variance_along = along.dot(&(covariance * along)).max(0.0);
        let across = (covariance.trace() - variance_along).max(0.0);
        // Beyond a third of the length the correction is no longer a small one.
        let longer = (across / (2.0 * distance)).min(distance / 3.0);
        self.add(
            distance - longer,
            variance_along + LEAST_SIGMA_M * LEAST_SIGMA_M,
        );
    }

    /// Weighted median, then a weighted mean in which far samples count less. `None` where there are too few.
    pub(super) fn estimate(&self) -> Option<Estimate> {
        if self.kept.len() < FEWEST_SAMPLES {
            return None;
        }
        let mut value = self.quantile(0.5)?;
        let mut sigma = 0.0;
        for _ in 0..ROUNDS {
            let (mut sum, mut weights) = (0.0, 0.0);
            for (sample, variance) in &self.kept {
                let off = (sample - value).abs() / variance.sqrt();
                let weight = (HUBER / off.max(HUBER)) / variance;
                sum += weight * sample;
                weights += weight;
            }
            value = sum / weights;
            sigma = (1.0 / weights).sqrt();
        }
        Some(Estimate { value, sigma })
    }

    /// The weighted quantile.
    pub(super) fn quantile(&self, share: f64) -> Option<f64> {
        let mut sorted = self.kept.clone();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = sorted.iter().map(|(_, variance)| 1.0 / variance).sum();
        let mut sum = 0.0;
        for (value, variance) in &sorted {
            sum += 1.0 / variance;
            if sum >= share * all {
                return Some(*value);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_samples_do_not_pull_and_few_say_nothing() {
        let mut samples = Samples::default();
        for index in 0..9 {
            samples.add(0.3 + 0.001 * f64::from(index % 3 - 1), 1e-4);
        }
        assert_eq!(samples.estimate(), None);
        samples.add(3.0, 1e-4);
        let estimate = samples.estimate().unwrap();
        assert!((estimate.value - 0.3).abs() < 0.004, "{estimate:?}");
    }

    #[test]
    fn memory_is_bounded_and_all_the_time_is_kept() {
        let mut samples = Samples::default();
        let count = 10 * MOST_SAMPLES;
        for index in 0..count {
            samples.add(index as f64, 1.0);
        }
        assert!(samples.kept.len() <= MOST_SAMPLES);
        let middle = samples.quantile(0.5).unwrap() / count as f64;
        assert!((middle - 0.5).abs() < 0.01, "{middle}");
    }
}
