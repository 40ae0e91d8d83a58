//! What goes up, in the order of its hurry: greeting, clock echoes and health first, then frames.

use std::pin::Pin;
use std::task::{Context, Poll};

use posefuse_proto::v1::{AgentMessage, agent_message::Message};
use tokio::sync::mpsc::Receiver;
use tokio_stream::Stream;

use crate::clock::AgentClock;

/// The upward half of one connection's stream. Ends when both of its queues have ended.
pub(crate) struct Outbound {
    pub(crate) urgent: Receiver<Message>,
    pub(crate) frames: Receiver<Message>,
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
        match self.frames.poll_recv(context) {
            Poll::Ready(Some(message)) => Poll::Ready(Some(AgentMessage {
                message: Some(message),
            })),
            Poll::Ready(None) if urgent.is_ready() => Poll::Ready(None),
            _ => Poll::Pending,
        }
    }
}
