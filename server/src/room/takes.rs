//! The take that is being recorded, and what became of earlier ones.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use posefuse_proto::v1;
use posefuse_session::{Event, TakeInfo};
use posefuse_skeleton::Timestamp;
use tokio::sync::oneshot;

use crate::record::{Progress, Record, RecorderTap};

/// Troubles of earlier takes that are remembered.
const MAX_TROUBLES: usize = 4;

/// The take that is being recorded, if one is, and what became of earlier ones.
#[derive(Default)]
pub(crate) struct Takes {
    /// One finished take is rewritten at a time. That may last, and must not hold up a take that starts or stops.
    pub(super) rewriting: tokio::sync::Mutex<()>,
    current: Mutex<Option<Recording>>,
    troubles: Mutex<Vec<String>>,
}

pub(super) struct Recording {
    pub(super) name: String,
    pub(super) slate: String,
    pub(super) notes: String,
    pub(super) started: String,
    pub(super) start: Timestamp,
    /// Civil time of the start, nanoseconds since 1970.
    pub(super) start_unix_ns: i64,
    /// Its timecode, and the timecode's rate.
    pub(super) timecode: [String; 2],
    pub(super) sensors: Vec<String>,
    pub(super) progress: Arc<Progress>,
    pub(super) tap: RecorderTap,
    pub(super) ended: oneshot::Receiver<TakeInfo>,
}

impl Takes {
    pub(crate) fn new(troubles: Vec<String>) -> Self {
        Self {
            troubles: Mutex::new(troubles),
            ..Self::default()
        }
    }

    pub(super) fn current(&self) -> MutexGuard<'_, Option<Recording>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn is_recording(&self) -> bool {
        self.current().is_some()
    }

    /// Notes something in the take that is being recorded, if one is.
    pub(crate) fn event(&self, event: Event) {
        if let Some(recording) = self.current().as_ref() {
            recording.tap.offer(Record::Event(event));
        }
    }

    /// What went wrong with takes, in words.
    pub(super) fn troubles(&self) -> Vec<String> {
        self.troubles
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    pub(super) fn add_trouble(&self, trouble: String) {
        let mut troubles = self.troubles.lock().unwrap_or_else(PoisonError::into_inner);
        if troubles.len() == MAX_TROUBLES {
            troubles.remove(0);
        }
        troubles.push(trouble);
    }

    /// Looks whether the take has ended by itself (the disk was full).
    pub(super) fn notice_end(&self, civil_time: &str) {
        let mut current = self.current();
        let Some(recording) = current.as_mut() else {
            return;
        };
        let info = match recording.ended.try_recv() {
            Ok(info) => info,
            Err(oneshot::error::TryRecvError::Empty) => return,
            Err(oneshot::error::TryRecvError::Closed) => TakeInfo {
                trouble: "the recorder ended unexpectedly".to_owned(),
                ..TakeInfo::default()
            },
        };
        let (name, trouble) = (&recording.name, info.trouble);
        tracing::error!(take = name, trouble, "the take ended by itself");
        // Before the take is gone, or a status between says neither.
        self.add_trouble(format!(
            "{civil_time}: take `{name}` ended by itself: {trouble}"
        ));
        *current = None;
    }

    /// The running take's list entry.
    pub(super) fn recording(&self, now: Timestamp) -> Option<v1::Take> {
        let current = self.current();
        let recording = current.as_ref()?;
        let progress = &recording.progress;
        Some(v1::Take {
            name: recording.name.clone(),
            slate: recording.slate.clone(),
            notes: recording.notes.clone(),
            state: v1::TakeState::Recording.into(),
            started: recording.started.clone(),
            duration_ns: now.since_ns(recording.start),
            size_bytes: progress.bytes.load(Ordering::Relaxed),
            frames: progress.frames.load(Ordering::Relaxed),
            people: progress.people.load(Ordering::Relaxed) as u32,
            sensors: recording.sensors.clone(),
            dropped: progress.dropped.load(Ordering::Relaxed),
            trouble: String::new(),
            start_unix_ns: recording.start_unix_ns,
            timecode: recording.timecode[0].clone(),
            timecode_rate: recording.timecode[1].clone(),
        })
    }
}
