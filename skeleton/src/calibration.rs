//! Where every sensor stands in the room: data only; `posefuse-calibration` makes it, the engine uses it.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{JointMap, JointSet, Room, Sensor, Transform};

/// The poses of a room's sensors, by sensor name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Civil time it was made, RFC 3339 (UTC).
    pub created: String,
    /// How it was made, e.g. `svd`.
    pub method: String,
    /// Where floor, up and heading came from.
    pub floor: FloorSource,
    /// The verdict it got when it was made: `passed` or `weak`; empty where nobody judged it (typed or imported).
    pub verdict: String,
    /// One pose per sensor.
    pub sensors: BTreeMap<String, SensorPose>,
    /// How far trackers report each joint nearer to their sensor than it is, metres along the ray; a joint that is not
    /// in it: unknown. The engine moves joints back by it.
    pub ray_bias_m: JointMap<f64>,
    /// Where each canonical joint lies from what the trackers of a joint set call by its name, metres, in the joint's
    /// local axes. The engine adds it. A joint set or joint that is not in it is taken as it comes.
    pub joint_offsets_m: BTreeMap<JointSet, JointMap<Vector3<f64>>>,
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
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// How well the pose and the offset are known; `None` where nobody said.
    pub sigma: Option<PoseSigma>,
}

/// How well a sensor's pose is known beside the other sensors': standard deviations from the solver's posterior.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseSigma {
    /// Root of the trace of the position's covariance, metres.
    pub position_m: f64,
    /// The same of the rotation, radians.
    pub rotation_rad: f64,
    /// Of the time offset, seconds.
    pub time_s: f64,
}
