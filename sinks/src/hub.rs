//! Between the fusion thread and the sinks: bodies are solved here, once for all, and frames handed out.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use posefuse_kinematics::Crowd;
use posefuse_skeleton::RoomFrame;
use tokio::sync::mpsc;

use crate::queue::FramesIn;
use crate::{Config, FramePace, Kind, LiveFrame};

/// Frames that may wait for their bodies; beyond, the newest are lost.
const WAITING: usize = 8;

/// The queues of the sinks that are on. Changed by the switchboard, used by the hub.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outlets(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    open: Mutex<Vec<Outlet>>,
    any: AtomicBool,
    solved: AtomicU64,
    missed: AtomicU64,
    /// The hub has ended while frames still come.
    broken: AtomicBool,
}

#[derive(Debug)]
struct Outlet {
    kind: Kind,
    frames: FramesIn,
    pace: FramePace,
}

impl Outlets {
    /// Frames go to this kind from now on.
    pub(crate) fn open(&self, kind: Kind, frames: FramesIn, rate_hz: f64) {
        let pace = FramePace::new(rate_hz);
        self.change(|open| open.push(Outlet { kind, frames, pace }));
    }

    /// No more frames go to this kind.
    pub(crate) fn close(&self, kind: Kind) {
        self.change(|open| open.retain(|outlet| outlet.kind != kind));
    }

    /// Frames whose bodies were solved, and frames that found no place in the hub's own queue.
    pub(crate) fn counts(&self) -> [u64; 2] {
        [&self.0.solved, &self.0.missed].map(|count| count.load(Ordering::Relaxed))
    }

    pub(crate) fn is_broken(&self) -> bool {
        self.0.broken.load(Ordering::Relaxed)
    }

    fn change(&self, change: impl FnOnce(&mut Vec<Outlet>)) {
        let mut open = self.0.open.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut open);
        self.0.any.store(!open.is_empty(), Ordering::Release);
    }

    fn hand_out(&self, frame: &Arc<LiveFrame>) {
        let mut open = self.0.open.lock().unwrap_or_else(PoisonError::into_inner);
        for outlet in open.iter_mut() {
            if outlet.pace.is_due(&frame.frame) {
                outlet.frames.push(frame.clone());
            }
        }
    }
}

/// When a frame is for the world.
#[derive(Clone, Debug, Default)]
pub struct Civil {
    /// Civil time minus the frame's clock, nanoseconds.
    pub unix_offset_ns: i64,
    /// The room's timecode; empty: it has none.
    pub timecode: String,
}

impl From<i64> for Civil {
    fn from(unix_offset_ns: i64) -> Self {
        Self {
            unix_offset_ns,
            timecode: String::new(),
        }
    }
}

struct Offered {
    frame: RoomFrame,
    civil: Civil,
    at: Instant,
}

/// The fusion thread's end: costs it nothing while no sink is on, and a copy of the frame otherwise.
#[derive(Debug)]
pub struct Tap {
    queue: mpsc::Sender<Offered>,
    outlets: Outlets,
}

impl Tap {
    /// Hands a frame on if anybody wants it, with the civil time that `civil` gives it.
    pub fn offer<C: Into<Civil>>(&self, frame: &RoomFrame, civil: impl FnOnce() -> C) {
        if !self.outlets.0.any.load(Ordering::Acquire) {
            return;
        }
        let place = match self.queue.try_reserve() {
            Ok(place) => place,
            Err(error) => {
                let ended = matches!(error, mpsc::error::TrySendError::Closed(()));
                self.outlets.0.broken.store(ended, Ordering::Relaxed);
                self.outlets.0.missed.fetch_add(1, Ordering::Relaxed);
                return;
            }
        };
        place.send(Offered {
            frame: frame.clone(),
            civil: civil().into(),
            at: Instant::now(),
        });
    }
}

/// The loop between the fusion thread and the sinks.
#[derive(Debug)]
pub struct Hub {
    queue: mpsc::Receiver<Offered>,
    outlets: Outlets,
    crowd: Crowd,
}

pub(crate) fn hub(config: &Config, outlets: Outlets) -> (Tap, Hub) {
    let (sender, queue) = mpsc::channel(WAITING);
    let tap = Tap {
        queue: sender,
        outlets: outlets.clone(),
    };
    let crowd = Crowd::new(config.bodies.clone());
    let hub = Hub {
        queue,
        outlets,
        crowd,
    };
    (tap, hub)
}

impl Hub {
    /// Runs until the [`Tap`] is gone.
    pub async fn run(mut self) {
        while let Some(Offered { frame, civil, at }) = self.queue.recv().await {
            let figures = self.crowd.step(&frame);
            self.outlets.0.solved.fetch_add(1, Ordering::Relaxed);
            self.outlets.hand_out(&Arc::new(LiveFrame {
                unix_ns: frame.time.ns().saturating_add(civil.unix_offset_ns),
                timecode: civil.timecode,
                frame,
                figures,
                offered: at,
            }));
        }
    }
}
