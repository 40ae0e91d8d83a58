//! When a replay begins, and how its times become the agent's.

use crate::Clock;

/// The next multiple of `seconds` in civil time, as a reading of the monotonic clock; now, if that is zero.
///
/// Processes on one machine (or with synchronised civil clocks) that start within the same interval begin together.
pub(crate) fn aligned_start(clock: &dyn Clock, seconds: f64) -> i64 {
    let (monotonic, unix) = (clock.monotonic_ns(), clock.unix_ns());
    let step = (seconds * 1e9).round() as i64;
    if step <= 0 {
        return monotonic;
    }
    monotonic + (step - unix.rem_euclid(step))
}

/// The civil instant `unix_ns` as a reading of the monotonic clock.
pub(crate) fn monotonic_of(clock: &dyn Clock, unix_ns: i64) -> i64 {
    let (monotonic, unix) = (clock.monotonic_ns(), clock.unix_ns());
    monotonic.saturating_add(unix_ns.saturating_sub(unix))
}

/// Times of a recording -> times of its replay.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// The monotonic clock when the recording's `origin_ns` is due in round 0.
    pub(crate) start_ns: i64,
    /// The recording's beginning, in its delivery clock.
    pub(crate) origin_ns: i64,
    /// How many times faster than recorded.
    pub(crate) speed: f64,
    /// How long one round lasts, recorded time.
    pub(crate) round_ns: i64,
}

impl Pace {
    /// Recorded time since `origin_ns`, counted through the rounds, as replayed time.
    pub(crate) fn replayed(&self, recorded_ns: i64, round: u32) -> i64 {
        let recorded = (recorded_ns - self.origin_ns) + i64::from(round) * self.round_ns;
        self.start_ns
            .saturating_add((recorded as f64 / self.speed).round() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fixed(i64, i64);

    impl Clock for Fixed {
        fn monotonic_ns(&self) -> i64 {
            self.0
        }
        fn unix_ns(&self) -> i64 {
            self.1
        }
    }

    #[test]
    fn processes_with_different_monotonic_clocks_start_at_the_same_civil_instant() {
        let civil = |clock: Fixed| clock.1 + aligned_start(&clock, 5.0) - clock.0;
        assert_eq!(civil(Fixed(100, 1_000_000_000)), 5_000_000_000);
        assert_eq!(civil(Fixed(7_777_777, 4_200_000_000)), 5_000_000_000);
        assert_eq!(aligned_start(&Fixed(42, 99), 0.0), 42);
        assert_eq!(monotonic_of(&Fixed(1_000, 50_000), 51_500), 2_500);
    }
}
