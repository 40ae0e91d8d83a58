//! What an agent knows of itself.

use std::collections::VecDeque;

use posefuse_proto::v1;

/// Frames are counted over this long, nanoseconds.
const RATE_WINDOW_NS: i64 = 2_000_000_000;
/// A sensor that has given nothing for this long is silent, nanoseconds.
const SILENT_NS: i64 = 1_000_000_000;

/// The sensor's side of the health message. Times are the agent's base clock.
#[derive(Debug)]
pub(crate) struct SensorHealth {
    started_ns: i64,
    arrivals: VecDeque<i64>,
    trouble: String,
}

impl SensorHealth {
    pub(crate) fn new(now_ns: i64) -> Self {
        Self {
            started_ns: now_ns,
            arrivals: VecDeque::new(),
            trouble: String::new(),
        }
    }

    /// A frame came: whatever the trouble was, it is over.
    pub(crate) fn frame(&mut self, now_ns: i64) {
        self.trouble.clear();
        self.arrivals.push_back(now_ns);
        while self.arrivals.len() > 1 && now_ns - self.arrivals[0] > RATE_WINDOW_NS {
            self.arrivals.pop_front();
        }
    }

    /// The source says why it gives no frames.
    pub(crate) fn trouble(&mut self, why: String) {
        self.trouble = why;
    }

    /// The health message of this moment, without the uplink's figures.
    pub(crate) fn report(&self, now_ns: i64) -> v1::Health {
        let lately = self
            .arrivals
            .iter()
            .filter(|&&at| now_ns - at <= RATE_WINDOW_NS)
            .count();
        let watched_ns = (now_ns - self.started_ns).clamp(1, RATE_WINDOW_NS);
        let silent_ns = now_ns - self.arrivals.back().unwrap_or(&self.started_ns);
        let trouble = if !self.trouble.is_empty() {
            self.trouble.clone()
        } else if silent_ns < SILENT_NS {
            String::new()
        } else if self.arrivals.is_empty() {
            "the sensor has given no frame yet".to_owned()
        } else {
            format!(
                "the sensor has given no frame for {} s",
                silent_ns / 1_000_000_000
            )
        };
        v1::Health {
            frames_per_second: Some(lately as f64 * 1e9 / watched_ns as f64),
            trouble,
            ..Default::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn silence_and_trouble_are_told_and_end_with_the_next_frame() {
        let mut health = SensorHealth::new(0);
        for frame in 1..=90 {
            health.frame(frame * 100 * MS / 3);
        }
        let report = health.report(3_010 * MS);
        assert!(
            (report.frames_per_second.unwrap() - 30.0).abs() <= 1.0,
            "{report:?}"
        );
        assert_eq!(report.trouble, "");

        let report = health.report(5_500 * MS);
        assert_eq!(report.frames_per_second, Some(0.0));
        assert_eq!(report.trouble, "the sensor has given no frame for 2 s");

        health.trouble("unplugged".into());
        assert_eq!(health.report(5_600 * MS).trouble, "unplugged");
        health.frame(5_700 * MS);
        assert_eq!(health.report(5_800 * MS).trouble, "");
    }
}
