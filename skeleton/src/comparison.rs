//! One person as several sensors saw them at one instant: what tells whether each still stands where it should.

use serde::{Deserialize, Serialize};

use crate::{JointMap, Position, Sensor, SensorId, Timestamp, TrackId};

/// One person at one instant, seen by two sensors or more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The instant.
    pub time: Timestamp,
    /// The person.
    pub track: TrackId,
    /// What each sensor saw, in order of sensors, each once.
    pub views: Vec<View>,
}

/// One person as one sensor saw them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Which sensor.
    pub sensor: SensorId,
    /// The joints it measured with trust, at the comparison's instant, metres, in its own optical frame; left and right
    /// put right, and what the calibration knows of trackers' biases taken off.
    pub joints: JointMap<Position<Sensor>>,
}
