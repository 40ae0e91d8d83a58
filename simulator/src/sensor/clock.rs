//! The faulty clock of a simulated agent.

use posefuse_skeleton::AgentTime;

use super::errors::SensorErrors;
use crate::random::{Purpose, Stream};

/// A clock that starts off by `offset_ns` and runs fast by `drift_ppm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimClock {
    /// What it shows at the scenario's start, nanoseconds.
    pub offset_ns: i64,
    /// How much faster than true time it runs, parts per million.
    pub drift_ppm: f64,
}

impl SimClock {
    pub(crate) fn new(seed: u64, sensor: usize, errors: &SensorErrors) -> Self {
        let mut stream = Stream::new(seed, Purpose::Clock, &[sensor as u64]);
        let offset_ms = errors.clock_offset_ms * stream.between(-1.0, 1.0);
        Self {
            offset_ns: (offset_ms * 1e6).round() as i64,
            drift_ppm: errors.clock_drift_ppm * stream.between(-1.0, 1.0),
        }
    }

    /// What it shows `at_ns` nanoseconds after the scenario's start.
    pub fn shows(&self, at_ns: i64) -> AgentTime {
        let gained = (at_ns as f64 * self.drift_ppm * 1e-6).round() as i64;
        AgentTime::from_ns(at_ns.saturating_add(self.offset_ns).saturating_add(gained))
    }
}
