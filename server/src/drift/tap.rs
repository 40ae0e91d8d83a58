//! The fusion thread's side: what it offers to the watch, without ever waiting.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use posefuse_calibration::WalkFrame;
use posefuse_fusion::Engine;
use posefuse_skeleton::{Comparison, Observation, SensorId, Timestamp};
use tokio::sync::mpsc;

use super::Missed;
use super::recent::{MAX_BODIES, SPACING_NS};

/// What may wait for the watch: with 16 sensors and 2 people 4 s. What finds no room is left out and counted.
const QUEUE: usize = 1024;

/// Something seen.
pub(crate) enum Seen {
    /// One person by several sensors.
    Comparison(Box<Comparison>),
    /// A sensor's frame, its time on the server's clock. One without people tells that the sensor works.
    Frame(SensorId, WalkFrame),
}

/// The sending end.
pub(crate) struct Tap {
    queue: mpsc::Sender<Seen>,
    compares: bool,
    missed: Missed,
    /// By sensor: time of the last frame offered.
    last: Vec<Option<Timestamp>>,
}

pub(super) fn tap(compares: bool) -> (Tap, mpsc::Receiver<Seen>) {
    let (sender, receiver) = mpsc::channel(QUEUE);
    let tap = Tap {
        queue: sender,
        compares,
        missed: Missed::default(),
        last: vec![None; SensorId::MAX_SENSORS],
    };
    (tap, receiver)
}

impl Tap {
    /// Whether the engine is to compare sensors.
    pub(crate) fn compares(&self) -> bool {
        self.compares
    }

    /// How much found no room.
    pub(crate) fn missed(&self) -> Missed {
        Arc::clone(&self.missed)
    }

    /// What the engine has compared.
    pub(crate) fn compared(&self, engine: &mut Engine) {
        for comparison in engine.take_comparisons() {
            self.offer(Seen::Comparison(Box::new(comparison)));
        }
    }

    /// A frame that was caught at `time`. Frames that follow the last one closely are left aside.
    pub(crate) fn frame(&mut self, observation: &Observation, time: Timestamp) {
        let last = &mut self.last[observation.sensor.index()];
        let is_close = last.is_some_and(|last| (0..SPACING_NS).contains(&time.since_ns(last)));
        if is_close {
            return;
        }
        *last = Some(time);
        let bodies = &observation.bodies[..observation.bodies.len().min(MAX_BODIES)];
        let frame = WalkFrame::new(time, bodies);
        self.offer(Seen::Frame(observation.sensor, frame));
    }

    fn offer(&self, seen: Seen) {
        if let Err(mpsc::error::TrySendError::Full(_)) = self.queue.try_send(seen) {
            self.missed.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// What was missed since the last call, if anything.
pub(super) fn newly_missed(missed: &AtomicU64, known: &mut u64) -> Option<u64> {
    let all = missed.load(Ordering::Relaxed);
    let new = all - *known;
    *known = all;
    (new > 0).then_some(new)
}
