//! How long to wait before the next attempt to connect.

use std::time::Duration;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// The first pause, at most.
const FIRST: Duration = Duration::from_millis(100);
/// The longest pause while the outage is young: with one second to connect, an agent is back within 2 s of its
/// server's return.
const LONGEST_AT_FIRST: Duration = Duration::from_millis(750);
/// The longest pause after [`PATIENCE`], and after a refusal.
const LONGEST: Duration = Duration::from_secs(5);
/// How long an outage counts as young.
const PATIENCE: Duration = Duration::from_secs(90);

/// Pauses that double from 0.1 s to 0.75 s, after 90 s of outage to 5 s, each shortened by up to half at random.
#[derive(Debug)]
pub(crate) struct Backoff {
    failures: u32,
    waited: Duration,
    random: StdRng,
}

impl Backoff {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            failures: 0,
            waited: Duration::ZERO,
            random: StdRng::seed_from_u64(seed),
        }
    }

    /// A connection stood: the next outage starts afresh.
    pub(crate) fn reset(&mut self) {
        self.failures = 0;
        self.waited = Duration::ZERO;
    }

    /// The pause after one more failure. `refused`: the server is there but does not want us, so there is no hurry.
    pub(crate) fn next(&mut self, refused: bool, attempt_took: Duration) -> Duration {
        let patient = refused || self.waited > PATIENCE;
        let longest = if patient { LONGEST } else { LONGEST_AT_FIRST };
        let full = FIRST
            .saturating_mul(1 << self.failures.min(16))
            .min(longest);
        self.failures = self.failures.saturating_add(1);
        let pause = full.mul_f64(1.0 - 0.5 * self.random.random::<f64>());
        self.waited += pause + attempt_took;
        pause
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_stay_bounded_and_differ_between_agents() {
        let pauses = |seed| {
            let mut backoff = Backoff::new(seed);
            (0..400)
                .map(|_| backoff.next(false, Duration::ZERO))
                .collect::<Vec<_>>()
        };
        let all = pauses(1);
        assert!(all[0] <= FIRST && all[0] >= FIRST / 2);
        let young: Vec<_> = all
            .iter()
            .scan(Duration::ZERO, |sum, p| {
                *sum += *p;
                Some((*sum, *p))
            })
            .collect();
        assert!(
            young
                .iter()
                .filter(|(sum, _)| *sum <= PATIENCE)
                .all(|(_, p)| *p <= LONGEST_AT_FIRST)
        );
        assert!(all[399] > LONGEST_AT_FIRST && all.iter().all(|p| *p <= LONGEST));
        assert_ne!(all, pauses(2));
    }
}
