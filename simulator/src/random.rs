//! Seeded random streams, addressed by what they are for.
//!
//! A stream is named by a seed and a few tags (which sensor, which frame, which error source). Two streams with
//! different names are independent, and drawing from one never moves another: switching an error source off, or
//! running one sensor without the others, leaves every other number as it was.

use nalgebra::Vector3;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// What a stream is drawn for: the first tag of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(crate) enum Purpose {
    Shape = 1,
    Script,
    Idle,
    Layout,
    Clock,
    Arrival,
    Drop,
    WhiteNoise,
    CorrelatedNoise,
    BodyBias,
    RayBias,
    SensorBias,
    Hidden,
    Overconfident,
    Spike,
    Swap,
    SwapWobble,
    Stale,
    Interference,
    Burst,
    Gap,
    Reorder,
    Furniture,
    FurnitureSeen,
    Definitions,
    Build,
    Grip,
    DepthRoom,
}

/// A stream of random numbers.
pub(crate) struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream called `purpose`, `tags` under `seed`.
    pub(crate) fn new(seed: u64, purpose: Purpose, tags: &[u64]) -> Self {
        let mut state = scrambled(seed ^ 0x706f_7365_6675_7365);
        state = scrambled(state ^ purpose as u64);
        for &tag in tags {
            state = scrambled(state.rotate_left(17) ^ tag);
        }
        Self(ChaCha8Rng::seed_from_u64(state))
    }

    /// Uniform in 0..1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0.random()
    }

    /// Uniform between `low` and `high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Uniform in `0..count`; 0 for a count of 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count.max(1) as u64) as usize
    }

    /// True with this probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// Normal with mean 0 and standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    /// Three independent [`Stream::normal`]s.
    pub(crate) fn normal3(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        let up = self.between(-1.0, 1.0);
        let around = self.between(0.0, std::f64::consts::TAU);
        let flat = (1.0 - up * up).sqrt();
        Vector3::new(flat * around.cos(), flat * around.sin(), up)
    }
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): a bijection whose output bits each depend on all input bits.
pub(crate) fn scrambled(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_with_different_names_differ_and_the_same_name_repeats() {
        let draw = |tags: &[u64]| Stream::new(7, Purpose::Swap, tags).uniform();
        assert_eq!(draw(&[1, 2]), draw(&[1, 2]));
        assert_ne!(draw(&[1, 2]), draw(&[2, 1]));
        assert_ne!(draw(&[1]), Stream::new(7, Purpose::Stale, &[1]).uniform());
        assert_ne!(draw(&[1]), Stream::new(8, Purpose::Swap, &[1]).uniform());
    }

    #[test]
    fn directions_favour_no_side() {
        let mut stream = Stream::new(1, Purpose::Idle, &[]);
        let sum: Vector3<f64> = (0..20_000).map(|_| stream.direction()).sum();
        assert!((sum / 20_000.0).norm() < 0.02, "{sum:?}");
    }
}
