//! What a sink did: counts, added latency, and what is wrong with it.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::{Kind, LiveFrame};

/// Latencies that are remembered.
const LATENCIES: usize = 1024;

/// How a sink is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SinkState {
    /// Switched off.
    #[default]
    Off,
    /// On, and ready.
    Running,
    /// On, but it does not work: `trouble` says why. It is tried again.
    Failing,
}

/// One sink as its user sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct SinkStatus {
    /// Which.
    pub kind: Kind,
    /// How it is.
    pub state: SinkState,
    /// Where frames go, in words, e.g. `udp 127.0.0.1:39539`.
    pub place: String,
    /// Most frames a second; 0: every one.
    pub rate_hz: f64,
    /// Programs that are connected; `None` for kinds that cannot know.
    pub clients: Option<u32>,
    /// Frames that went out, and frames that were lost because it was slow, since the server's start.
    pub delivered: u64,
    /// Lost frames.
    pub dropped: u64,
    /// From the fusion thread to the operating system, of the latest frames, milliseconds; `None` before the first.
    pub p50_ms: Option<f64>,
    /// The 99th percentile of it.
    pub p99_ms: Option<f64>,
    /// What is wrong and what to do; empty: nothing.
    pub trouble: String,
}

/// One sink's totals and state; its task writes, anybody reads.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    delivered: AtomicU64,
    dropped: AtomicU64,
    clients: AtomicU32,
    latencies: Mutex<Latencies>,
    trouble: Mutex<String>,
}

#[derive(Debug, Default)]
struct Latencies {
    /// The latest ones, nanoseconds, as a ring.
    ring: Vec<u64>,
    next: usize,
}

impl Meter {
    /// A frame went out.
    pub(crate) fn sent(&self, frame: &LiveFrame) {
        self.delivered.fetch_add(1, Ordering::Relaxed);
        let ns = frame.offered.elapsed().as_nanos() as u64;
        let mut latencies = self
            .latencies
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let next = latencies.next;
        match latencies.ring.get_mut(next) {
            Some(place) => *place = ns,
            None => latencies.ring.push(ns),
        }
        latencies.next = (next + 1) % LATENCIES;
    }

    /// A frame was lost.
    pub(crate) fn drop_one(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    /// So many programs are connected.
    pub(crate) fn set_clients(&self, clients: usize) {
        let clients = u32::try_from(clients).unwrap_or(u32::MAX);
        self.clients.store(clients, Ordering::Relaxed);
    }

    /// What is wrong now; empty: nothing.
    pub(crate) fn set_trouble(&self, trouble: String) {
        *self.trouble.lock().unwrap_or_else(PoisonError::into_inner) = trouble;
    }

    pub(crate) fn trouble(&self) -> String {
        self.trouble
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    pub(crate) fn delivered(&self) -> u64 {
        self.delivered.load(Ordering::Relaxed)
    }

    pub(crate) fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    pub(crate) fn clients(&self) -> u32 {
        self.clients.load(Ordering::Relaxed)
    }

    /// Median and 99th percentile of the added latency, milliseconds.
    pub(crate) fn latency_ms(&self) -> Option<[f64; 2]> {
        let mut all = self
            .latencies
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .ring
            .clone();
        if all.is_empty() {
            return None;
        }
        all.sort_unstable();
        let at = |share: f64| all[((all.len() - 1) as f64 * share).round() as usize] as f64 * 1e-6;
        Some([at(0.5), at(0.99)])
    }
}
