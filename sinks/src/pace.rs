//! Fewer messages a second than there are.

use posefuse_skeleton::{RoomFrame, Timestamp};

/// Thins a stream out to at most so many messages a second.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    interval_ns: i64,
    next: Timestamp,
}

impl Pace {
    /// At most `max_rate_hz` messages a second; 0 (or nonsense): every one.
    pub fn new(max_rate_hz: f64) -> Self {
        let interval_ns = if max_rate_hz.is_finite() && max_rate_hz > 0.0 {
            (1e9 / max_rate_hz).min(3.6e12) as i64
        } else {
            0
        };
        Self {
            interval_ns,
            next: Timestamp::from_ns(i64::MIN),
        }
    }

    /// Whether the message of this time may pass.
    pub fn is_due(&mut self, time: Timestamp) -> bool {
        // A message a little early still passes, or a 30 Hz stream asked for at 30 Hz would be halved.
        if time.plus_ns(self.interval_ns / 10) < self.next {
            return false;
        }
        // A little late is made up for; after a pause it begins anew.
        let is_late = self.next < time.plus_ns(-self.interval_ns);
        let due = if is_late { time } else { self.next };
        self.next = due.plus_ns(self.interval_ns);
        true
    }
}

/// Thins a stream of frames out, but never loses that the last person has left: no frame may come after that one.
#[derive(Clone, Copy, Debug)]
pub struct FramePace {
    pace: Pace,
    peopled: bool,
}

impl FramePace {
    /// As [`Pace::new`].
    pub fn new(max_rate_hz: f64) -> Self {
        Self {
            pace: Pace::new(max_rate_hz),
            peopled: false,
        }
    }

    /// Whether this frame may pass.
    pub fn is_due(&mut self, frame: &RoomFrame) -> bool {
        let empties = self.peopled && frame.tracks.is_empty();
        let passes = self.pace.is_due(frame.time) || empties;
        if passes {
            self.peopled = !frame.tracks.is_empty();
        }
        passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use posefuse_skeleton::{SensorSet, Skeleton, Track, TrackId};

    #[test]
    fn a_pace_thins_out_to_its_rate() {
        let passed = |source_hz: f64, max_hz: f64| {
            let mut pace = Pace::new(max_hz);
            (0..source_hz as i64 * 10)
                .filter(|i| pace.is_due(Timestamp::from_seconds(5.0 + *i as f64 / source_hz)))
                .count()
        };
        assert_eq!(passed(30.0, 0.0), 300);
        assert_eq!(passed(30.0, f64::NAN), 300);
        let usual = passed(30.0, 30.0);
        assert!((295..=300).contains(&usual), "{usual}");
        let few = passed(30.0, 10.0);
        assert!((98..=103).contains(&few), "{few}");
    }

    #[test]
    fn the_frame_in_which_the_last_person_leaves_always_passes() {
        let frame = |number: u64, tracks| RoomFrame {
            number,
            time: Timestamp::from_seconds(1.0 + number as f64 / 30.0),
            look_ahead_ns: 0,
            tracks,
        };
        let somebody = || {
            vec![Track {
                id: TrackId(1),
                since: Timestamp::from_seconds(1.0),
                sensors: SensorSet::EMPTY,
                skeleton: Skeleton::empty(),
                hands: [None; 2],
            }]
        };
        let mut pace = FramePace::new(10.0);
        assert!(pace.is_due(&frame(0, somebody())));
        assert!(!pace.is_due(&frame(1, somebody())));
        assert!(pace.is_due(&frame(2, vec![])));
        assert!(!pace.is_due(&frame(2, vec![])), "told once");
    }
}
