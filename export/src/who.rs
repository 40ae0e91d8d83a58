//! Whose motion it is.

use std::fmt;

use posefuse_skeleton::TrackId;
use serde::Serialize;

/// One person of an export. The text is part of file names and columns: `person3`, `sim1-body2`, `true1`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(into = "String")]
pub enum Who {
    /// A fused person, by the number that takes and the dashboard show.
    Person(TrackId),
    /// A body as one sensor saw it, before fusion.
    Body {
        /// The sensor's name.
        sensor: String,
        /// Counts the bodies of the sensor from 1, in the order in which they appeared.
        number: u64,
    },
    /// A simulated person as they truly moved.
    True(u64),
}

impl Who {
    /// The number that `--person` selects by.
    pub fn number(&self) -> u64 {
        match self {
            Self::Person(track) => track.0,
            Self::Body { number, .. } | Self::True(number) => *number,
        }
    }
}

impl fmt::Display for Who {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Person(track) => write!(f, "person{track}"),
            Self::Body { sensor, number } => write!(f, "{sensor}-body{number}"),
            Self::True(number) => write!(f, "true{number}"),
        }
    }
}

impl From<Who> for String {
    fn from(who: Who) -> Self {
        who.to_string()
    }
}
