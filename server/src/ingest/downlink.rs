//! What goes down to an agent. A clock probe is stamped when the connection takes it, not when it was asked for.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};

use futures_util::Stream;
use posefuse_proto::v1::{self, server_message::Message};
use posefuse_skeleton::Timestamp;
use tokio::sync::mpsc;
use tonic::Status;

use crate::Clock;

/// Probes that may be under way; an older one is forgotten.
const MAX_PROBES: usize = 8;

/// One thing to send.
#[derive(Debug)]
pub(super) enum Down {
    Message(Message),
    Probe,
    End(Status),
}

/// Clock probes that were sent and not answered yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Probes(Arc<Mutex<Sent>>);

#[derive(Debug, Default)]
struct Sent {
    next: u64,
    probes: Vec<(u64, Timestamp)>,
}

impl Probes {
    fn send(&self, now: Timestamp) -> u64 {
        let mut sent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        sent.next += 1;
        if sent.probes.len() == MAX_PROBES {
            sent.probes.remove(0);
        }
        let probe = sent.next;
        sent.probes.push((probe, now));
        probe
    }

    /// When this probe was sent; each is answered once.
    pub(super) fn answered(&self, probe: u64) -> Option<Timestamp> {
        let mut sent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let index = sent.probes.iter().position(|(id, _)| *id == probe)?;
        Some(sent.probes.remove(index).1)
    }
}

/// The stream to one agent.
pub(crate) struct Downlink {
    queue: mpsc::Receiver<Down>,
    probes: Probes,
    clock: Arc<dyn Clock>,
}

impl Downlink {
    pub(super) fn new(queue: mpsc::Receiver<Down>, probes: Probes, clock: Arc<dyn Clock>) -> Self {
        Self {
            queue,
            probes,
            clock,
        }
    }
}

impl Stream for Downlink {
    type Item = Result<v1::ServerMessage, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let message = match std::task::ready!(self.queue.poll_recv(context)) {
            None => return Poll::Ready(None),
            Some(Down::End(status)) => return Poll::Ready(Some(Err(status))),
            Some(Down::Message(message)) => message,
            Some(Down::Probe) => Message::ClockProbe(v1::ClockProbe {
                probe: self.probes.send(self.clock.now()),
            }),
        };
        Poll::Ready(Some(Ok(v1::ServerMessage {
            message: Some(message),
        })))
    }
}
