//! The kinds of sinks.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Where a live stream goes. The word is the section's name in the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Positions of joints as floats over OSC: TouchDesigner, Max, Pure Data.
    Osc,
    /// Bodies by the Virtual Motion Capture Protocol: Unity, Unreal, Blender, avatars.
    Vmc,
    /// Samples for the Lab Streaming Layer: LabRecorder, MATLAB, Python.
    Lsl,
    /// Frames as JSON over WebSocket: pages, TouchDesigner, Node-RED, Python.
    Websocket,
    /// Scenes, transforms and frames over Foxglove's WebSocket protocol.
    Foxglove,
    /// Frames over Zenoh, and through it transforms for ROS 2.
    Zenoh,
}

impl Kind {
    /// Every kind, in the order they are shown.
    pub const ALL: [Self; 6] = [
        Self::Osc,
        Self::Vmc,
        Self::Lsl,
        Self::Websocket,
        Self::Foxglove,
        Self::Zenoh,
    ];

    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Osc => "osc",
            Self::Vmc => "vmc",
            Self::Lsl => "lsl",
            Self::Websocket => "websocket",
            Self::Foxglove => "foxglove",
            Self::Zenoh => "zenoh",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Kind {
    type Err = UnknownKind;

    fn from_str(name: &str) -> Result<Self, UnknownKind> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| UnknownKind(name.to_owned()))
    }
}

/// No sink is called this.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no sink `{0}`: choose one of {known}", known = Kind::ALL.map(Kind::name).join(", "))]
pub struct UnknownKind(pub(crate) String);
