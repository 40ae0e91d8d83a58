//! How much each sink delivered and dropped.

use std::sync::atomic::{AtomicU64, Ordering};

/// One sink's totals since the server's start.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    delivered: AtomicU64,
    dropped: AtomicU64,
}

impl Meter {
    pub(crate) fn deliver(&self) {
        self.delivered.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn drop_one(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn delivered(&self) -> u64 {
        self.delivered.load(Ordering::Relaxed)
    }

    pub(crate) fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// The totals of all sinks, by kind.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    pub(crate) watch: Meter,
    pub(crate) watch_sensors: Meter,
    pub(crate) recorder: Meter,
}

impl Counters {
    /// Each sink with its name.
    pub(crate) fn all(&self) -> [(&'static str, &Meter); 3] {
        [
            ("watch", &self.watch),
            ("watch-sensors", &self.watch_sensors),
            ("recorder", &self.recorder),
        ]
    }
}
