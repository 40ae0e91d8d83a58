//! Recording a take: a sink with a bounded queue and a thread of its own, so that a slow disk delays nobody.
//!
//! The fusion thread puts every input, frame and rejection into the queue in the order they happened. When the queue
//! is full the newest message is dropped and counted; the take's list entry and an event in the take say how many.

mod recorder;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use posefuse_fusion::{Input, Rejection};
use posefuse_session::Event;
use posefuse_skeleton::{RoomFrame, Timestamp};
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;

pub(crate) use recorder::{Opening, start};

use crate::sinks::Counters;

/// Where takes go. Section `[takes]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The folder; made when it is not there.
    pub folder: std::path::PathBuf,
    /// A take begins, and goes on, only while so many megabytes stay free.
    pub min_free_mb: u64,
    /// Messages that may wait for the disk: 8192 are some 4 s of 64 sensors.
    pub queue: usize,
    /// What is recorded is on the disk after so long, milliseconds; 20 to 250.
    pub flush_ms: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            folder: "takes".into(),
            min_free_mb: 200,
            queue: 8192,
            flush_ms: 200,
        }
    }
}

/// What a take must begin with, taken between two inputs.
#[derive(Debug)]
pub(crate) struct Preamble {
    pub(crate) start: Timestamp,
    pub(crate) inputs: Vec<Input>,
    /// The engine's snapshot; without it the take is fused again from its preamble.
    pub(crate) state: Option<Vec<u8>>,
}

/// One message for the recorder.
#[derive(Debug)]
pub(crate) enum Record {
    Input(Input),
    Frame(RoomFrame),
    Rejection(Rejection),
    Event(Event),
}

/// What is known of a running take, for those who do not hold it.
#[derive(Debug, Default)]
pub(crate) struct Progress {
    pub(crate) frames: AtomicU64,
    pub(crate) people: AtomicU64,
    pub(crate) bytes: AtomicU64,
    /// Inputs dropped because the queue was full, and everything else: frames, rejections, events.
    pub(crate) dropped: AtomicU64,
    pub(crate) dropped_outputs: AtomicU64,
}

/// The sending side of a take.
#[derive(Clone, Debug)]
pub(crate) struct RecorderTap {
    queue: mpsc::Sender<Record>,
    progress: Arc<Progress>,
    counters: Arc<Counters>,
}

impl RecorderTap {
    pub(crate) fn new(
        capacity: usize,
        progress: Arc<Progress>,
        counters: Arc<Counters>,
    ) -> (Self, mpsc::Receiver<Record>) {
        let (queue, records) = mpsc::channel(capacity);
        let tap = Self {
            queue,
            progress,
            counters,
        };
        (tap, records)
    }

    /// Offers a message; `false`: the take has ended.
    pub(crate) fn offer(&self, record: Record) -> bool {
        match self.queue.try_send(record) {
            Ok(()) => {
                self.counters.recorder.deliver();
                true
            }
            Err(mpsc::error::TrySendError::Full(record)) => {
                self.counters.recorder.drop_one();
                let dropped = match record {
                    Record::Input(_) => &self.progress.dropped,
                    _ => &self.progress.dropped_outputs,
                };
                dropped.fetch_add(1, Ordering::Relaxed);
                true
            }
            Err(mpsc::error::TrySendError::Closed(_)) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_finds_no_room_is_counted_by_what_it_was() {
        let (progress, counters) = (Arc::new(Progress::default()), Arc::default());
        let (tap, records) = RecorderTap::new(1, progress.clone(), counters);
        let input = || Record::Input(Input::Tick(Timestamp::ZERO));
        assert!(tap.offer(input()) && tap.offer(input()));
        let event = Record::Event(Event::default());
        assert!(tap.offer(event));
        let count = |count: &AtomicU64| count.load(Ordering::Relaxed);
        assert_eq!(count(&progress.dropped), 1);
        assert_eq!(count(&progress.dropped_outputs), 1);
        drop(records);
        assert!(!tap.offer(input()));
    }
}
