//! What one sensor saw at one instant.

use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

use crate::{AgentTime, Confidence, JointMap, Sensor, SensorId, Skeleton, Timestamp};

/// One frame of one sensor: every body it saw at `captured`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// Who saw it.
    pub sensor: SensorId,
    /// The agent's frame counter; gaps are frames that never arrived.
    pub sequence: u64,
    /// When the light was caught, in the agent's clock.
    pub captured: AgentTime,
    /// When the server took it in, in the server's clock.
    pub received: Timestamp,
    /// The bodies, in the order the tracker gave them: at most [`Observation::MAX_BODIES`], each tracking id once.
    pub bodies: Vec<Body>,
}

impl Observation {
    /// Most bodies of one frame. Trackers of this class follow six.
    pub const MAX_BODIES: usize = 16;
}

/// A person as one sensor sees it in one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// The sensor's own id for this person, stable while its tracker holds on.
    pub tracking_id: u64,
    /// Joint positions in the sensor's optical frame.
    pub skeleton: Skeleton<Sensor>,
    /// Joint orientations (sensor frame from joint frame), where the tracker gives them.
    pub orientations: Option<Box<JointMap<UnitQuaternion<f64>>>>,
    /// The probability that the left and the right hand is closed, where the tracker tells.
    pub hands_closed: [Option<Confidence>; 2],
}
