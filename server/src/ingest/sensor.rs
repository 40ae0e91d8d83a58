//! What the server knows of one sensor: who it is, what came from it, what was refused.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use posefuse_proto::{WireError, v1};
use posefuse_skeleton::{SensorId, SensorInfo, Timestamp};
use tokio_util::sync::CancellationToken;

use super::depth::Depth;

/// Why a frame did not reach the engine. The engine's own reasons come on top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub(crate) enum Refusal {
    /// An array's length does not fit the joint set.
    WrongLength,
    /// More bodies than any tracker gives.
    TooManyBodies,
    /// Something else is wrong with the message.
    Malformed,
    /// It was here already (sent again after a reconnection).
    Duplicate,
    /// The fusion thread could not keep up.
    QueueFull,
    /// A depth preview that is none.
    BadPreview,
}

impl Refusal {
    pub(crate) const ALL: [Self; 6] = [
        Self::WrongLength,
        Self::TooManyBodies,
        Self::Malformed,
        Self::Duplicate,
        Self::QueueFull,
        Self::BadPreview,
    ];

    /// The name used in metrics and on the dashboard.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::WrongLength => "wrong-length",
            Self::TooManyBodies => "too-many-bodies",
            Self::Malformed => "malformed",
            Self::Duplicate => "duplicate",
            Self::QueueFull => "queue-full",
            Self::BadPreview => "bad-preview",
        }
    }
}

impl From<&WireError> for Refusal {
    fn from(error: &WireError) -> Self {
        match error {
            WireError::Length { .. } => Self::WrongLength,
            WireError::TooManyBodies { .. } => Self::TooManyBodies,
            _ => Self::Malformed,
        }
    }
}

/// The stream a sensor's frames come on now.
#[derive(Debug)]
pub(crate) struct Live {
    /// Which run of the agent.
    pub(crate) run_id: u64,
    /// Ends the stream.
    pub(crate) cancel: CancellationToken,
    /// Cancelled once the stream has ended.
    pub(crate) gone: CancellationToken,
}

/// What changes with a greeting.
#[derive(Debug)]
pub(crate) struct Greeting {
    pub(crate) info: SensorInfo,
    /// What the engine was told of it.
    pub(crate) announced: Option<SensorInfo>,
    pub(crate) agent_version: String,
    /// What its depth camera sees, where the agent knows; 0 where a number is not known.
    pub(crate) camera: Option<v1::CameraInfo>,
    pub(crate) live: Option<Live>,
    /// The run that `last_sequence` belongs to.
    pub(crate) run_id: u64,
    pub(crate) last_sequence: Option<u64>,
    pub(crate) health: Option<v1::Health>,
    /// The last refused frame: when, and what was wrong.
    pub(crate) last_refusal: Option<(Timestamp, String)>,
}

/// One sensor of this server run.
#[derive(Debug)]
pub(crate) struct Sensor {
    id: SensorId,
    name: String,
    greeting: Mutex<Greeting>,
    connected: AtomicBool,
    muted: AtomicBool,
    received: AtomicU64,
    lost: AtomicU64,
    refused: [AtomicU64; Refusal::ALL.len()],
    last_frame_ns: AtomicI64,
    depth: Depth,
}

impl Sensor {
    pub(crate) fn new(info: SensorInfo) -> Self {
        Self {
            id: info.id,
            name: info.name.clone(),
            greeting: Mutex::new(Greeting {
                info,
                announced: None,
                agent_version: String::new(),
                camera: None,
                live: None,
                run_id: 0,
                last_sequence: None,
                health: None,
                last_refusal: None,
            }),
            connected: AtomicBool::new(false),
            muted: AtomicBool::new(false),
            received: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            refused: Default::default(),
            last_frame_ns: AtomicI64::new(i64::MIN),
            depth: Depth::default(),
        }
    }

    pub(crate) fn id(&self) -> SensorId {
        self.id
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Held for a moment only, never while waiting.
    pub(crate) fn greeting(&self) -> MutexGuard<'_, Greeting> {
        self.greeting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Its depth previews.
    pub(crate) fn depth(&self) -> &Depth {
        &self.depth
    }

    pub(crate) fn set_connected(&self, connected: bool) {
        self.connected.store(connected, Ordering::Release);
    }

    pub(crate) fn is_connected(&self) -> bool {
        self.connected.load(Ordering::Acquire)
    }

    /// Left out of fusing by a person; outlasts the agent's connection.
    pub(crate) fn set_muted(&self, muted: bool) {
        self.muted.store(muted, Ordering::Release);
    }

    pub(crate) fn is_muted(&self) -> bool {
        self.muted.load(Ordering::Acquire)
    }

    /// A frame came, good or bad.
    pub(crate) fn count_received(&self, now: Timestamp) {
        self.received.fetch_add(1, Ordering::Relaxed);
        self.last_frame_ns.store(now.ns(), Ordering::Relaxed);
    }

    pub(crate) fn count_lost(&self, frames: u64) {
        self.lost.fetch_add(frames, Ordering::Relaxed);
    }

    pub(crate) fn count_refused(&self, refusal: Refusal) {
        self.refused[refusal as usize].fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn received(&self) -> u64 {
        self.received.load(Ordering::Relaxed)
    }

    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    pub(crate) fn refused(&self, refusal: Refusal) -> u64 {
        self.refused[refusal as usize].load(Ordering::Relaxed)
    }

    /// When the last frame came, if one ever did.
    pub(crate) fn last_frame(&self) -> Option<Timestamp> {
        let ns = self.last_frame_ns.load(Ordering::Relaxed);
        (ns != i64::MIN).then(|| Timestamp::from_ns(ns))
    }
}
