//! What goes up, in the order of its hurry: greeting, clock echoes and health first, then frames, then depth previews.

use std::pin::Pin;
use std::task::{Context, Poll};

use posefuse_proto::v1::{AgentMessage, agent_message::Message};
use tokio::sync::mpsc::Receiver;
use tokio_stream::Stream;

use super::previews::Previews;
use crate::clock::AgentClock;

/// The upward half of one connection's stream. Ends when both of its queues have ended. It is asked for the next message
/// only when the connection has room for one.
pub(crate) struct Outbound {
    pub(crate) urgent: Receiver<Message>,
    pub(crate) frames: Receiver<Message>,
    /// If the source has any.
    pub(crate) previews: Option<Previews>,
    /// The agent's clock: an echo is stamped at the moment it is handed to the connection.
    pub(crate) clock: AgentClock,
}

impl Stream for Outbound {
    type Item = AgentMessage;

    fn poll_next(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<AgentMessage>> {
        let urgent = self.urgent.poll_recv(context);
        if let Poll::Ready(Some(mut message)) = urgent {
            if let Message::ClockEcho(echo) = &mut message {
                echo.agent_sent_ns = self.clock.now().ns();
            }
            return Poll::Ready(Some(AgentMessage {
                message: Some(message),
            }));
        }
        let message = match self.frames.poll_recv(context) {
            Poll::Ready(Some(message)) => Poll::Ready(message),
            Poll::Ready(None) if urgent.is_ready() => return Poll::Ready(None),
            _ => match &mut self.previews {
                Some(previews) => previews.poll_next(context),
                None => Poll::Pending,
            },
        };
        message.map(|message| {
            Some(AgentMessage {
                message: Some(message),
            })
        })
    }
}
