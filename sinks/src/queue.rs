//! One sink's frames: bounded; a full queue loses its oldest.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Notify;

use crate::LiveFrame;
use crate::meter::Meter;

#[derive(Debug)]
struct Shared<F> {
    frames: Mutex<VecDeque<Arc<F>>>,
    news: Notify,
}

/// The hub's end; or, of a sink's own clients, the sink's.
#[derive(Debug)]
pub(crate) struct FramesIn<F = LiveFrame> {
    shared: Arc<Shared<F>>,
    capacity: usize,
    meter: Arc<Meter>,
}

/// The sink's end.
#[derive(Debug)]
pub struct Frames<F = LiveFrame>(Arc<Shared<F>>);

impl<F> Clone for Frames<F> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

/// A queue for `capacity` frames; what is lost goes to the `meter`.
pub(crate) fn frames<F>(capacity: usize, meter: Arc<Meter>) -> (FramesIn<F>, Frames<F>) {
    let shared = Arc::new(Shared {
        frames: Mutex::default(),
        news: Notify::new(),
    });
    let frames_in = FramesIn {
        shared: shared.clone(),
        capacity: capacity.max(1),
        meter,
    };
    (frames_in, Frames(shared))
}

impl<F> FramesIn<F> {
    pub(crate) fn push(&self, frame: Arc<F>) {
        let mut frames = self
            .shared
            .frames
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        while frames.len() >= self.capacity {
            frames.pop_front();
            self.meter.drop_one();
        }
        frames.push_back(frame);
        drop(frames);
        self.shared.news.notify_one();
    }
}

impl<F> Frames<F> {
    /// The oldest frame that waits; waits for one if none does. Nothing is lost when this is dropped.
    pub async fn next(&self) -> Arc<F> {
        loop {
            let frame = self
                .0
                .frames
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .pop_front();
            match frame {
                Some(frame) => return frame,
                None => self.0.news.notified().await,
            }
        }
    }
}
