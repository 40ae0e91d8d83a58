//! Which of a sensor's latest frames the engine refused, and why most of them.

use std::collections::VecDeque;

use posefuse_fusion::RejectionReason;
use posefuse_skeleton::Timestamp;

use super::meters::{MAX_TIMES, WINDOW_NS};

/// Refusals are worth a word once they have gone on for so long ...
const LASTING_NS: i64 = 1_000_000_000;
/// ... and concern this share of the frames.
const WORTH_A_WORD: f64 = 0.1;

/// Why frames of a sensor are not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unused {
    pub(crate) reason: RejectionReason,
    /// The share of the frames of the last two seconds, 0 to 1.
    pub(crate) share: f64,
}

/// The refused frames of the last two seconds.
#[derive(Debug, Default)]
pub(super) struct Refusals(VecDeque<(Timestamp, RejectionReason)>);

impl Refusals {
    /// A frame that came at `time`, or a body of it, was refused.
    pub(super) fn add(&mut self, time: Timestamp, reason: RejectionReason) {
        // Several bodies of a frame may be refused, each for itself; it stays one frame.
        if self.0.back() == Some(&(time, reason)) {
            return;
        }
        if self.0.len() == MAX_TIMES {
            self.0.pop_front();
        }
        self.0.push_back((time, reason));
    }

    /// The most frequent reason among the last two seconds' `frames`, if it is worth a word.
    pub(super) fn main(&mut self, frames: usize, now: Timestamp) -> Option<Unused> {
        let start = now.plus_ns(-WINDOW_NS);
        while self.0.front().is_some_and(|(time, _)| *time < start) {
            self.0.pop_front();
        }
        let of = |reason| self.0.iter().filter(move |(_, other)| *other == reason);
        let reasons = self.0.iter().map(|(_, reason)| *reason);
        let reason = reasons.max_by_key(|reason| (of(*reason).count(), *reason))?;
        let (first, _) = of(reason).next()?;
        let share = (of(reason).count() as f64 / frames.max(1) as f64).min(1.0);
        let is_worth_a_word = now.since_ns(*first) >= LASTING_NS && share >= WORTH_A_WORD;
        is_worth_a_word.then_some(Unused { reason, share })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_main_reason_is_told_once_it_lasts_and_forgotten_when_it_is_over() {
        let mut refusals = Refusals::default();
        let at = |frame: i64| Timestamp::from_ns(frame * 1_000_000_000 / 30);
        for frame in 0..60 {
            if frame % 6 != 0 {
                // Two bodies of one frame.
                refusals.add(at(frame), RejectionReason::Late);
                refusals.add(at(frame), RejectionReason::Late);
            } else {
                refusals.add(at(frame), RejectionReason::OutOfOrder);
            }
            let found = refusals.main(frame as usize + 1, at(frame));
            assert_eq!(found.is_some(), frame > 30, "frame {frame}: {found:?}");
        }
        let found = refusals.main(60, at(60)).unwrap();
        assert_eq!(found.reason, RejectionReason::Late);
        assert!((found.share - 50.0 / 60.0).abs() < 1e-9, "{found:?}");
        assert_eq!(refusals.main(60, at(130)), None);
    }

    #[test]
    fn a_frame_now_and_then_is_not_worth_a_word() {
        let mut refusals = Refusals::default();
        for second in 0..2 {
            refusals.add(
                Timestamp::from_ns(second * 900_000_000),
                RejectionReason::Late,
            );
        }
        assert_eq!(refusals.main(60, Timestamp::from_ns(1_900_000_000)), None);
    }
}
