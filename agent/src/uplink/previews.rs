//! Depth previews on their way up: when there is nothing better to send, and only as far as the connection bears it.
//!
//! A preview goes right behind the frame of the same image, when no other frame is there to be carried; one that is due
//! while the connection is busy is dropped, and a newer one follows. Busy is a connection on which frames wait to be
//! sent, many wait to be acknowledged, or the frame behind the last preview is still under way. One on which that took
//! long rests for several times as long, so that on a slow line the previews become few and the frames keep nearly all
//! of it.

use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use posefuse_proto::v1::agent_message::Message;
use tokio::time::Instant;

use super::Shared;
use crate::{DepthPreview, PreviewSlot, wire};

/// With more frames than this unacknowledged, half a second at 30 Hz, the server is behind.
const MANY: usize = 16;
/// The server acknowledges every 50 ms, which is seen with the next frame; a frame behind a preview that took longer than
/// this was held up by it.
const LONG: Duration = Duration::from_millis(150);
/// So many times as long as it took, the next preview waits after one that took long.
const REST: u32 = 4;
/// A preview whose frame has not come by then is dropped.
const PATIENCE: Duration = Duration::from_secs(1);

/// The previews of one connection.
pub(crate) struct Previews {
    slot: PreviewSlot,
    shared: Arc<Shared>,
    /// Waits for its frame to go first, since then.
    held: Option<(Instant, DepthPreview)>,
    /// When the last one went, and the frame after it, until that is acknowledged.
    under_way: Option<(Instant, u64)>,
    rest_until: Option<Instant>,
}

impl Previews {
    pub(super) fn new(slot: PreviewSlot, shared: Arc<Shared>) -> Self {
        Self {
            slot,
            shared,
            held: None,
            under_way: None,
            rest_until: None,
        }
    }

    /// The next preview for a connection that has room now and nothing else to carry.
    pub(super) fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<Message> {
        self.arrived(Instant::now());
        loop {
            let (since, preview) = match self.held.take() {
                Some(held) => held,
                None => (Instant::now(), ready!(self.slot.poll_newest(context))),
            };
            let now = Instant::now();
            let newest = self.shared.lock().buffer.newest_captured_ns();
            if newest.is_none_or(|newest| newest < preview.captured.ns()) {
                if now - since < PATIENCE {
                    // Its frame wakes the connection.
                    self.held = Some((since, preview));
                    return Poll::Pending;
                }
            } else if let Some(next) = self.may_go(now) {
                self.under_way = Some((now, next));
                return Poll::Ready(Message::Preview(wire::preview(&preview)));
            }
        }
    }

    /// Looks whether the last preview is through, and how long that took.
    fn arrived(&mut self, now: Instant) {
        let Some((went, behind)) = self.under_way else {
            return;
        };
        if self.shared.lock().buffer.oldest() <= behind {
            return;
        }
        self.under_way = None;
        let took = now - went;
        if took > LONG {
            self.rest_until = Some(now + took * REST);
        }
    }

    /// The number of the frame that will follow, if the connection bears a preview now.
    fn may_go(&mut self, now: Instant) -> Option<u64> {
        let resting = self.rest_until.is_some_and(|until| now < until);
        let state = self.shared.lock();
        let busy = state.buffer.has_unsent() || state.buffer.len() > MANY;
        let free = self.under_way.is_none() && !resting && !busy;
        free.then_some(state.buffer.captured())
    }
}
