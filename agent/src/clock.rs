//! Where an agent gets its time from.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use posefuse_skeleton::AgentTime;
use tokio::time::Instant;

use crate::source::SensorClock;

/// The time sources of one agent.
pub trait Clock: Send + Sync {
    /// Monotonic, nanoseconds since an epoch of its own. Must run at the pace of tokio's timers.
    fn monotonic_ns(&self) -> i64;
    /// Civil time, nanoseconds since 1970-01-01 UTC.
    fn unix_ns(&self) -> i64;
}

/// The machine's clocks. The monotonic one counts from the moment this was made, and follows tokio's clock, so that
/// it also tells simulated time inside a simulated network.
#[derive(Clone, Debug)]
pub struct SystemClock {
    start: Instant,
}

impl SystemClock {
    /// A clock whose monotonic time begins now.
    pub fn new() -> Self {
        Self {
            start: Instant::now(),
        }
    }
}

impl Default for SystemClock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock for SystemClock {
    fn monotonic_ns(&self) -> i64 {
        self.start
            .elapsed()
            .as_nanos()
            .try_into()
            .unwrap_or(i64::MAX)
    }

    fn unix_ns(&self) -> i64 {
        let since = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        since.as_nanos().try_into().unwrap_or(i64::MAX)
    }
}

/// The clock that stamps this agent's frames and answers its clock probes.
#[derive(Clone)]
pub(crate) struct AgentClock {
    pub(crate) base: Arc<dyn Clock>,
    pub(crate) sensor: SensorClock,
}

impl AgentClock {
    pub(crate) fn now(&self) -> AgentTime {
        (self.sensor)(self.base.monotonic_ns())
    }
}
