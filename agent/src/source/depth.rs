//! The seam for sensors that give depth images and no skeletons.

use posefuse_skeleton::{AgentTime, DepthImage, Intrinsics};

use super::{SensorClock, SourceError};

/// One depth image.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthFrame {
    /// When the light was caught, by the sensor's clock.
    pub captured: AgentTime,
    /// As in [`SourceFrame`](super::SourceFrame): when a real sensor would have delivered, by the agent's monotonic clock.
    pub due_ns: Option<i64>,
    /// What was seen. Not mirrored.
    pub image: DepthImage,
}

/// A depth sensor, or something that takes its place. It may block: it runs on a thread of its own.
pub trait DepthSource: Send {
    /// The device, e.g. "Kinect v1 (OpenNI2)".
    fn model(&self) -> String;

    /// Its camera; may change when the device comes back in another mode.
    fn intrinsics(&self) -> Intrinsics;

    /// As [`SensorSource::clock`](super::SensorSource::clock).
    fn clock(&self) -> SensorClock {
        std::sync::Arc::new(AgentTime::from_ns)
    }

    /// Whether every image is to be tracked, however long that takes (a file, to be read as fast as possible), or the
    /// newest only (a device: a slow computer tracks fewer images, none of them late).
    fn every_frame(&self) -> bool {
        false
    }

    /// The next image, or `None` when there will be no more. After [`SourceError::Trouble`] it is called again.
    fn next_frame(&mut self) -> Result<Option<DepthFrame>, SourceError>;
}
