//! What the engine consumes. Everything that can change its state is one of these, and a take records them all.

use std::sync::Arc;

use posefuse_skeleton::{AgentTime, Calibration, Observation, SensorId, SensorInfo, Timestamp};
use serde::{Deserialize, Serialize};

use crate::repair::{RepairAnswer, RepairModel};

/// One input of the engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Input {
    /// A sensor exists (first greeting, or a greeting with other properties). Comes before its observations.
    Sensor(SensorInfo),
    /// A sensor's frame.
    Observation(Observation),
    /// An answered clock probe of a sensor's agent.
    ClockSample(ClockSample),
    /// These sensor poses are in force from now on.
    Calibration(Arc<Calibration>),
    /// A sensor is left out of fusing from now on, or taken in again.
    Mute {
        /// Which sensor.
        sensor: SensorId,
        /// Left out.
        muted: bool,
    },
    /// A model outside the engine answers requests from now on; `None`: there is none any more.
    RepairModel(Option<RepairModel>),
    /// What the model outside the engine answered to an [`Output::Repair`](crate::Output::Repair).
    Repaired(Box<RepairAnswer>),
    /// It is this late now. Sent when the deadline of the last `Output::WakeAt` has come.
    Tick(Timestamp),
}

impl Input {
    /// When the input tells the engine how late it is; `None` where it does not.
    pub fn time(&self) -> Option<Timestamp> {
        match self {
            Self::Observation(observation) => Some(observation.received),
            Self::ClockSample(sample) => Some(sample.returned),
            Self::Repaired(answer) => Some(answer.received),
            Self::Tick(time) => Some(*time),
            Self::Sensor(_) | Self::Calibration(_) | Self::Mute { .. } | Self::RepairModel(_) => {
                None
            }
        }
    }
}

/// One answered clock probe: four stamps, as in NTP (RFC 5905).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClockSample {
    /// Whose agent answered.
    pub sensor: SensorId,
    /// When the probe left the server.
    pub sent: Timestamp,
    /// When its echo came back to the server.
    pub returned: Timestamp,
    /// When the agent got the probe.
    pub agent_received: AgentTime,
    /// When the agent sent the echo.
    pub agent_sent: AgentTime,
}
