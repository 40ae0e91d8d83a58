//! The one bounded queue into the fusion thread.

use std::time::Duration;

use posefuse_fusion::Input;
use tokio::sync::mpsc::{self, error::TrySendError};
use tonic::Status;

use crate::Clock;

/// The sending side; cheap to clone.
#[derive(Clone, Debug)]
pub(crate) struct Inputs {
    queue: mpsc::Sender<Input>,
    max_wait: Duration,
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pushed {
    /// The fusion thread will get it.
    Queued,
    /// There was no room for as long as one waits; it is dropped.
    Full,
    /// The fusion thread has ended.
    Stopped,
}

impl Inputs {
    pub(super) fn new(queue: mpsc::Sender<Input>, max_wait_ms: u64) -> Self {
        Self {
            queue,
            max_wait: Duration::from_millis(max_wait_ms),
        }
    }

    /// Queues a frame; waits for room up to the configured time, so that a short stop costs nothing.
    pub(crate) async fn push(&self, input: Input, clock: &dyn Clock) -> Pushed {
        let input = match self.queue.try_send(input) {
            Ok(()) => return Pushed::Queued,
            Err(TrySendError::Closed(_)) => return Pushed::Stopped,
            Err(TrySendError::Full(input)) => input,
        };
        tokio::select! {
            sent = self.queue.send(input) => match sent {
                Ok(()) => Pushed::Queued,
                Err(_) => Pushed::Stopped,
            },
            () = clock.sleep(self.max_wait) => Pushed::Full,
        }
    }

    /// Queues what must not be lost; waits as long as it takes.
    pub(crate) async fn send(&self, input: Input) -> Result<(), Status> {
        let sent = self.queue.send(input).await;
        sent.map_err(|_| Status::unavailable("the server is stopping"))
    }

    /// Queues what another will replace soon; leaves it out if there is no room.
    pub(crate) fn offer(&self, input: Input) {
        let _ = self.queue.try_send(input);
    }
}
