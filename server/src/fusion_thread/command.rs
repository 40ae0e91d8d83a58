//! What the rest of the server asks of the fusion thread, between two inputs.

use posefuse_skeleton::{Body, SensorId, Timestamp};
use tokio::sync::{mpsc, oneshot};
use tonic::Status;

use crate::record::{Preamble, RecorderTap};
use crate::sinks::{FramePace, SensorSubscriber, Subscriber};

/// A sensor's frame on the server's clock, for calibration.
pub(crate) type WalkFrame = (SensorId, Timestamp, Vec<Body>);

/// A request to the fusion thread.
pub(crate) enum Command {
    /// Fused frames from now on.
    Watch(Subscriber, FramePace),
    /// Sensors' frames from now on.
    WatchSensors(SensorSubscriber),
    /// Tells what a take that starts now must begin with.
    Record(RecorderTap, oneshot::Sender<Preamble>),
    /// Records what has come so far, then lets go of the recorder.
    StopRecording(oneshot::Sender<()>),
    /// Sensors' frames with mapped times, until the receiver is dropped.
    Walk(mpsc::Sender<WalkFrame>),
    /// Takes in what has come so far, then ends.
    End,
}

/// The sending side; cheap to clone.
#[derive(Clone, Debug)]
pub(crate) struct Commands(mpsc::Sender<Command>);

impl Commands {
    pub(super) fn new(queue: mpsc::Sender<Command>) -> Self {
        Self(queue)
    }

    /// Asks; an error means that the server is stopping.
    pub(crate) async fn send(&self, command: Command) -> Result<(), Status> {
        let sent = self.0.send(command).await;
        sent.map_err(|_| Status::unavailable("the server is stopping"))
    }

    /// The same where one must not wait.
    pub(crate) fn try_send(&self, command: Command) -> Result<(), Status> {
        let sent = self.0.try_send(command);
        sent.map_err(|_| Status::unavailable("the server is busy or stopping; try again"))
    }
}
