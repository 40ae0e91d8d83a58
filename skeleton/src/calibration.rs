//! Where every sensor stands in the room: data only; `posefuse-calibration` makes it, the engine uses it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{Room, Sensor, Transform};

/// The poses of a room's sensors, by sensor name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Civil time it was made, RFC 3339 (UTC).
    pub created: String,
    /// How it was made, e.g. `svd`.
    pub method: String,
    /// Where floor, up and heading came from.
    pub floor: FloorSource,
    /// One pose per sensor.
    pub sensors: BTreeMap<String, SensorPose>,
}

/// What the room's floor, origin and heading were taken from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FloorSource {
    /// The feet of the person who walked.
    #[default]
    Walk,
    /// A person's entry.
    Manual,
    /// Too little was seen: the first sensor is assumed level.
    Assumed,
}

/// One sensor's place in the room and how well it is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorPose {
    /// Takes points of the sensor's optical frame to the room.
    pub room_from_sensor: Transform<Room, Sensor>,
    /// What is left of the sensor's delay after clock mapping, added to its capture times. Only differences between
    /// sensors count: calibration gives, and the engine takes, the largest of a room as 0.
    pub time_offset_ns: i64,
    /// Median distance between this sensor's joints and the other sensors', metres.
    pub residual_median_m: f64,
    /// 95th percentile of the same, metres.
    pub residual_p95_m: f64,
    /// Joint pairs that were used.
    pub samples: u64,
}
