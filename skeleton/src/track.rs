//! One person over time, and the fused state of the room at one instant.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{Confidence, Room, SensorSet, Skeleton, Timestamp};

/// A person's number, never reused within a server run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TrackId(pub u64);

impl fmt::Display for TrackId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// One person at one instant, fused from every sensor that saw them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Who it is.
    pub id: TrackId,
    /// Since when this person has been followed.
    pub since: Timestamp,
    /// The sensors that contributed to this frame.
    pub sensors: SensorSet,
    /// The pose in the room.
    pub skeleton: Skeleton<Room>,
    /// What sensors say of the left and the right hand in this frame; `None` where none says anything.
    #[serde(default)]
    pub hands: [Option<HandVotes>; 2],
}

/// What the sensors say of one hand in one frame. Single votes are often wrong: `posefuse-kinematics` makes a state of them
/// that does not flicker.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandVotes {
    /// The mean of their probabilities that the hand is closed.
    pub closed: Confidence,
    /// How many sensors voted, 1 or more.
    pub sensors: u8,
}

/// Everybody in the room at one instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoomFrame {
    /// Counts up by one from the engine's start.
    pub number: u64,
    /// The instant the poses belong to (capture time, not the time of computing).
    pub time: Timestamp,
    /// How much newer the newest sample was that went into this frame: the delay that was chosen, not suffered.
    pub look_ahead_ns: i64,
    /// The people, in order of their ids.
    pub tracks: Vec<Track>,
}
