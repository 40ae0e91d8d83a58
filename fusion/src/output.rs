//! What the engine gives.

use std::fmt;

use posefuse_skeleton::{Joint, RoomFrame, SensorId, Timestamp};
use serde::{Deserialize, Serialize};

use crate::repair::RepairRequest;

/// One output of the engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Output {
    /// A fused frame.
    Frame(RoomFrame),
    /// A frame or a joint was refused; the rest was used.
    Rejected(Rejection),
    /// A model outside the engine is to fill in what is missing; its frame waits for the answer
    /// ([`Input::Repaired`](crate::Input::Repaired)) until the deadline. Only after
    /// [`Input::RepairModel`](crate::Input::RepairModel) told of such a model.
    Repair(Box<RepairRequest>),
    /// Nothing more for now. Send `Input::Tick` at this time unless another input comes first;
    /// `None`: only an input can change anything.
    WakeAt(Option<Timestamp>),
}

/// Something that was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rejection {
    /// Whose it was.
    pub sensor: SensorId,
    /// When the server had received it.
    pub time: Timestamp,
    /// Why.
    pub reason: RejectionReason,
    /// The joint, if it was one joint and not the whole frame.
    pub joint: Option<Joint>,
}

/// Why something was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum RejectionReason {
    /// A coordinate, covariance or quaternion was NaN or infinite.
    NonFinite,
    /// A position no sensor can see (further than the configured range, or behind the lens).
    Absurd,
    /// The joint moved faster than a person can.
    Jumped,
    /// The frame was older than one already used, or the same again.
    OutOfOrder,
    /// A body repeated one of its latest poses, under whatever time.
    Repeated,
    /// The agent's clock stepped; frames are held back until it is mapped again.
    ClockStep,
    /// The agent's clock is not mapped yet.
    ClockUnknown,
    /// The calibration in force does not know this sensor.
    Uncalibrated,
    /// The frame came from a sensor that never greeted.
    UnknownSensor,
    /// The frame came too late for the room's present.
    Late,
    /// The frame had more bodies than a frame may have; those beyond were not looked at.
    TooManyBodies,
}

impl RejectionReason {
    /// The name used in metrics, takes and the dashboard.
    pub fn name(self) -> &'static str {
        match self {
            Self::NonFinite => "non-finite",
            Self::Absurd => "absurd",
            Self::Jumped => "jumped",
            Self::OutOfOrder => "out-of-order",
            Self::Repeated => "repeated",
            Self::ClockStep => "clock-step",
            Self::ClockUnknown => "clock-unknown",
            Self::Uncalibrated => "uncalibrated",
            Self::UnknownSensor => "unknown-sensor",
            Self::Late => "late",
            Self::TooManyBodies => "too-many-bodies",
        }
    }
}

impl fmt::Display for RejectionReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
