//! What happened in a simulated network, and when.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use posefuse_proto::v1::SensorState;

/// One thing that somebody saw.
#[derive(Clone, Debug, PartialEq)]
pub enum Happening {
    /// The server began to listen.
    Listens,
    /// An agent tried to connect.
    Connects {
        /// The agent's host.
        agent: String,
    },
    /// The operator got a sensor's frame.
    Observed {
        /// The sensor.
        sensor: String,
        /// The agent's number of the frame.
        sequence: u64,
        /// The agent's clock.
        captured_ns: i64,
    },
    /// The operator got a fused frame.
    Fused {
        /// Its number.
        number: u64,
        /// Its time, server clock.
        time_ns: i64,
        /// The first person's first coordinates, bit for bit.
        pose: Vec<u32>,
    },
    /// The operator saw a sensor's state change.
    State {
        /// The sensor.
        sensor: String,
        /// What it is now.
        state: SensorState,
    },
}

/// A happening with its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Since the network began.
    pub at: Duration,
    /// How many times the server had been started.
    pub life: u32,
    /// What it was.
    pub what: Happening,
}

/// The shared list; clones are the same list.
#[derive(Clone, Debug, Default)]
pub struct Log(Arc<Mutex<Inner>>);

#[derive(Debug, Default)]
struct Inner {
    entries: Vec<Entry>,
    life: u32,
}

impl Log {
    /// Adds what happens now. To be called from a simulated host.
    pub(super) fn add(&self, what: Happening) {
        let at = turmoil::sim_elapsed().expect("within the simulation");
        let mut inner = self.0.lock().unwrap();
        if what == Happening::Listens {
            inner.life += 1;
        }
        let life = inner.life;
        inner.entries.push(Entry { at, life, what });
    }

    /// Everything so far, in the order it was seen.
    pub fn entries(&self) -> Vec<Entry> {
        self.0.lock().unwrap().entries.clone()
    }

    /// When something first happened at or after `from`.
    pub fn first(&self, from: Duration, is: impl Fn(&Happening) -> bool) -> Option<Duration> {
        let inner = self.0.lock().unwrap();
        // Times never run backwards in the list.
        let start = inner.entries.partition_point(|entry| entry.at < from);
        let found = inner.entries[start..].iter().find(|entry| is(&entry.what));
        found.map(|entry| entry.at)
    }
}
