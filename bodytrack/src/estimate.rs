//! What the network says of a person.

use crate::flesh::Joints;
use posefuse_skeleton::JOINT_COUNT;

/// One person in one image.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    /// Sensor metres.
    pub(crate) joints: Joints,
    /// Standard deviation along each axis, metres.
    pub(crate) sigma_m: [f32; JOINT_COUNT],
    /// The probability that the joint's surface is seen.
    pub(crate) visible: [f32; JOINT_COUNT],
    /// Sine and cosine of the heading against the line of sight; cosine above 0 faces the sensor.
    pub(crate) heading: [f32; 2],
}
