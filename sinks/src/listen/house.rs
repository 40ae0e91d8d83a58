//! Those who are in: a queue each.

use std::sync::{Arc, Mutex, PoisonError};

use super::{Door, Talk, WAITING};
use crate::LiveFrame;
use crate::meter::Meter;
use crate::queue::{Frames, FramesIn, frames};

/// A listener's clients.
pub(super) struct House<T: Talk> {
    pub(super) talk: T,
    pub(super) door: Door,
    pub(super) meter: Arc<Meter>,
    queues: Mutex<Queues<T::Frame>>,
}

struct Queues<F> {
    all: Vec<(u64, FramesIn<F>)>,
    /// Numbers are given once.
    next: u64,
}

/// A client's place; others can have it once this is gone.
pub(super) struct Place<T: Talk> {
    house: Arc<House<T>>,
    number: u64,
    /// What waits for this client.
    pub(super) frames: Frames<T::Frame>,
}

impl<T: Talk> House<T> {
    pub(super) fn new(door: Door, talk: T, meter: Arc<Meter>) -> Self {
        let queues = Mutex::new(Queues {
            all: Vec::new(),
            next: 0,
        });
        Self {
            talk,
            door,
            meter,
            queues,
        }
    }

    /// A place, if one is free.
    pub(super) fn enter(self: &Arc<Self>) -> Option<Place<T>> {
        let mut queues = self.queues.lock().unwrap_or_else(PoisonError::into_inner);
        if queues.all.len() >= self.door.max_clients {
            return None;
        }
        let number = queues.next;
        queues.next += 1;
        let (frames_in, frames) = frames(WAITING, self.meter.clone());
        queues.all.push((number, frames_in));
        self.meter.set_clients(queues.all.len());
        Some(Place {
            house: self.clone(),
            number,
            frames,
        })
    }

    pub(super) fn hand_out(&self, frame: Arc<LiveFrame>) {
        let queues = self.queues.lock().unwrap_or_else(PoisonError::into_inner);
        if queues.all.is_empty() {
            return;
        }
        let frame = Arc::new(self.talk.prepare(frame));
        for (_, queue) in &queues.all {
            queue.push(frame.clone());
        }
    }
}

impl<T: Talk> Drop for Place<T> {
    fn drop(&mut self) {
        let queues = self.house.queues.lock();
        let mut queues = queues.unwrap_or_else(PoisonError::into_inner);
        queues.all.retain(|(number, _)| *number != self.number);
        self.house.meter.set_clients(queues.all.len());
    }
}
