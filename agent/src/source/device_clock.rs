//! From a device's clock to the agent's: by the quickest deliveries, whatever both clocks' rates are.
//!
//! A frame arrives its capture time plus a delay that is never below some least one. Seen over device time, "arrival less
//! capture" lies above a straight line, whose slope is the difference of the rates; the line is an edge of the lower convex
//! hull (L. Zhang, Z. Liu, C. Xia, "Clock synchronization algorithms for network measurements", IEEE INFOCOM 2002). What
//! remains is the least delay itself (exposure and transfer), which nobody can see from here; it is the same for all frames.

use std::collections::VecDeque;

/// One point, the lowest, is kept of this much device time.
const BUCKET_NS: i64 = 1_000_000_000;
/// Of so many buckets.
const BUCKETS: usize = 40;
/// From here on the rates' difference is looked for; before, 100 parts per million make half a millisecond at most.
const SLOPE_FROM: usize = 6;
/// No crystal is further off, nanoseconds a nanosecond.
const STEEPEST: f64 = 500e-6;
/// A frame this much sooner than any before it: the device started anew. So much later, again and again: the same, or this
/// computer slept.
const JUMP_NS: i64 = 500_000_000;
/// A busy computer is late for no longer than this.
const LATE_NS: i64 = 3_000_000_000;

/// What the clock of one device shows, against the agent's.
#[derive(Debug)]
pub(super) struct DeviceClock {
    /// Device time and lowest "arrival less device time", oldest first.
    lowest: VecDeque<[i64; 2]>,
    line: Line,
    last_ns: i64,
    last_device_ns: i64,
    /// Device time since which every frame is late by a jump.
    late_since_ns: Option<i64>,
}

/// `at` device time `x`: `y + slope (at - x)`.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    x: i64,
    y: i64,
    slope: f64,
}

impl Line {
    fn at(&self, device_ns: i64) -> i64 {
        self.y + (self.slope * (device_ns - self.x) as f64).round() as i64
    }
}

impl Default for DeviceClock {
    fn default() -> Self {
        Self {
            lowest: VecDeque::new(),
            line: Line::default(),
            last_ns: i64::MIN,
            last_device_ns: i64::MIN,
            late_since_ns: None,
        }
    }
}

impl DeviceClock {
    /// When a frame was captured, agent's clock, ns; later than the frame before.
    pub(super) fn captured_ns(&mut self, device_ns: i64, arrived_ns: i64) -> i64 {
        let offset = arrived_ns.saturating_sub(device_ns);
        if !self.lowest.is_empty() && self.is_another(device_ns, offset) {
            self.lowest.clear();
            self.late_since_ns = None;
        }
        self.last_device_ns = device_ns;
        self.keep(device_ns, offset);
        self.line = self.fit();
        let captured_ns = device_ns.saturating_add(self.line.at(device_ns));
        self.last_ns = captured_ns
            .min(arrived_ns)
            .max(self.last_ns.saturating_add(1));
        self.last_ns
    }

    /// Whether the device's clock is not the one that it was.
    fn is_another(&mut self, device_ns: i64, offset: i64) -> bool {
        let late_ns = offset - self.line.at(device_ns);
        if late_ns <= JUMP_NS {
            self.late_since_ns = None;
            return late_ns < -JUMP_NS || device_ns <= self.last_device_ns;
        }
        let since_ns = *self.late_since_ns.get_or_insert(device_ns);
        device_ns <= self.last_device_ns || device_ns - since_ns > LATE_NS
    }

    fn keep(&mut self, device_ns: i64, offset: i64) {
        match self.lowest.back_mut() {
            Some(last) if last[0].div_euclid(BUCKET_NS) == device_ns.div_euclid(BUCKET_NS) => {
                if offset <= last[1] {
                    *last = [device_ns, offset];
                }
            }
            _ => self.lowest.push_back([device_ns, offset]),
        }
        if self.lowest.len() > BUCKETS {
            self.lowest.pop_front();
        }
    }

    /// The edge of the lower hull over the points' middle; while there are few, the lowest of them.
    fn fit(&self) -> Line {
        let Some(&[last, _]) = self.lowest.back() else {
            return Line::default();
        };
        let lowest = self.lowest.iter().min_by_key(|point| point[1]);
        let flat = lowest.map_or(Line::default(), |&[x, y]| Line { x, y, slope: 0.0 });
        if self.lowest.len() < SLOPE_FROM {
            return flat;
        }
        let mut hull: Vec<[i64; 2]> = Vec::new();
        for &point in &self.lowest {
            while hull.len() >= 2
                && slope(hull[hull.len() - 2], hull[hull.len() - 1])
                    >= slope(hull[hull.len() - 1], point)
            {
                hull.pop();
            }
            hull.push(point);
        }
        let sum: i128 = self
            .lowest
            .iter()
            .map(|point| i128::from(last - point[0]))
            .sum();
        let middle = last - (sum / self.lowest.len() as i128) as i64;
        let edge = hull.windows(2).find(|edge| edge[1][0] >= middle);
        edge.map_or(flat, |edge| Line {
            x: edge[0][0],
            y: edge[0][1],
            slope: slope(edge[0], edge[1]).clamp(-STEEPEST, STEEPEST),
        })
    }
}

fn slope(from: [i64; 2], to: [i64; 2]) -> f64 {
    (to[1] - from[1]) as f64 / (to[0] - from[0]).max(1) as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MS: i64 = 1_000_000;
    const FRAME_NS: i64 = 33_333_333;

    /// Frames of a device whose clock runs `ppm` faster, each delayed by `least` and what `delays` says.
    fn errors_ns(ppm: f64, least: i64, delays: impl Fn(i64) -> i64, frames: i64) -> Vec<i64> {
        let mut clock = DeviceClock::default();
        let frame = |number: i64| {
            let truth = number * FRAME_NS;
            let device =
                77_000_000_000 + (truth as f64 * (1.0 + ppm * 1e-6)).round() as i64 / 1000 * 1000;
            clock.captured_ns(device, truth + least + delays(number)) - truth - least
        };
        (0..frames).map(frame).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn capture_times_are_right_to_a_millisecond_whatever_the_rates_and_the_delays(
            ppm in -100.0..100.0f64,
            least in 0..40i64,
            jitter in proptest::collection::vec(0.0..1.0f64, 997),
        ) {
            // Most frames come soon, some much later, as on a busy computer.
            let delays = |number: i64| (8e6 * jitter[number as usize % 997].powi(4)) as i64;
            let errors = errors_ns(ppm, least * MS, delays, 4000);
            for (number, error) in errors.iter().enumerate().skip(30) {
                prop_assert!(error.abs() < MS, "frame {number}: {error} ns at {ppm} ppm");
            }
        }
    }

    #[test]
    fn times_grow_and_never_lie_after_the_arrival() {
        let mut clock = DeviceClock::default();
        let mut last = i64::MIN;
        for number in 0..200 {
            let arrived = number * FRAME_NS + (number * 7919 % 13) * MS;
            let captured = clock.captured_ns(number * FRAME_NS, arrived);
            assert!(
                captured > last && captured <= arrived.max(last + 1),
                "frame {number}"
            );
            last = captured;
        }
    }

    #[test]
    fn a_device_that_starts_anew_is_followed_at_once() {
        let mut clock = DeviceClock::default();
        for number in 0..100 {
            clock.captured_ns(9_000_000_000 + number * FRAME_NS, number * FRAME_NS);
        }
        let arrived = 200 * FRAME_NS;
        assert_eq!(clock.captured_ns(0, arrived), arrived);
        assert_eq!(
            clock.captured_ns(FRAME_NS, arrived + FRAME_NS),
            arrived + FRAME_NS
        );
    }

    #[test]
    fn one_frame_that_is_seconds_late_is_late_and_a_clock_that_stays_behind_is_another() {
        let mut clock = DeviceClock::default();
        let frame = |number: i64| 9_000_000_000 + number * FRAME_NS;
        for number in 0..100 {
            clock.captured_ns(frame(number), number * FRAME_NS);
        }
        let late = clock.captured_ns(frame(100), 100 * FRAME_NS + 2_000 * MS);
        assert_eq!(late, 100 * FRAME_NS);
        let slept = 60_000 * MS;
        let captured =
            (101..300).map(|number| clock.captured_ns(frame(number), number * FRAME_NS + slept));
        assert_eq!(captured.last(), Some(299 * FRAME_NS + slept));
    }
}
