//! What came of the windows that the model beside the engine was asked to fill.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use posefuse_proto::v1;

use super::About;

/// Times kept for the percentiles.
const MAX_TIMES: usize = 512;

/// Counts, shared by the fusion thread, the worker and the status.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    about: About,
    counts: Mutex<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    view: View,
    times: VecDeque<Duration>,
}

/// The counts since the server's start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct View {
    pub(crate) requests: u64,
    pub(crate) answers: u64,
    pub(crate) late: u64,
    pub(crate) failed: u64,
}

impl Meter {
    pub(crate) fn new(about: About) -> Self {
        Self {
            about,
            counts: Mutex::default(),
        }
    }

    /// Counts something.
    pub(crate) fn count(&self, change: impl FnOnce(&mut View)) {
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut counts.view);
    }

    /// An answer in time, so long after the question.
    pub(super) fn answered(&self, after: Duration) {
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        counts.view.answers += 1;
        if counts.times.len() == MAX_TIMES {
            counts.times.pop_front();
        }
        counts.times.push_back(after);
    }

    /// For the status.
    pub(crate) fn to_wire(&self) -> v1::RepairStatus {
        let counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        let View {
            requests,
            answers,
            late,
            failed,
        } = counts.view;
        let mut times: Vec<Duration> = counts.times.iter().copied().collect();
        drop(counts);
        times.sort_unstable();
        let quantile = |share: f64| {
            let index = (share * times.len() as f64) as usize;
            let time = times.get(index.min(times.len().saturating_sub(1)))?;
            Some(time.as_secs_f64() * 1e3)
        };
        v1::RepairStatus {
            model: self.about.model.clone(),
            runtime: self.about.runtime.clone(),
            requests,
            answers,
            late,
            failed,
            p50_ms: quantile(0.5),
            p99_ms: quantile(0.99),
            trouble: self.about.trouble.clone(),
        }
    }

    /// Why the model that was asked for is not used.
    pub(crate) fn trouble(&self) -> Option<String> {
        (!self.about.trouble.is_empty()).then(|| self.about.trouble.clone())
    }
}
