//! Conversions between wire messages and the vocabulary, and what can be wrong with a message.

pub(crate) mod calibration;
pub(crate) mod observation;
pub(crate) mod room_frame;

use posefuse_skeleton::{JointSet, Observation, SensorIdError, UnknownJointSet};
use thiserror::Error;

/// What is wrong with a message, what was expected, and thereby what to do.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WireError {
    /// An array has the wrong length.
    #[error("body {body}: `{field}` has {found} numbers, joint set {joint_set} needs {expected}")]
    Length {
        /// Index of the body in its frame.
        body: usize,
        /// The array.
        field: &'static str,
        /// What there is.
        found: usize,
        /// What there must be.
        expected: usize,
        /// The joint set that was announced.
        joint_set: JointSet,
    },
    /// There are two hands, or nothing is said of them.
    #[error("body {body}: `hands_closed` has {found} numbers; it needs 2 (left, right) or none")]
    Hands {
        /// Index of the body in its frame.
        body: usize,
        /// What there is.
        found: usize,
    },
    /// A fused person has two hands, or nothing is said of them.
    #[error(
        "track {track}: `hands_closed` and `hands_sensors` need 2 numbers each (left, right) or none"
    )]
    TrackHands {
        /// The track's number.
        track: u64,
    },
    /// More bodies than any tracker gives.
    #[error("a frame has at most {max} bodies, found {found}", max = Observation::MAX_BODIES)]
    TooManyBodies {
        /// What there is.
        found: usize,
    },
    /// Two bodies of one frame are called the same.
    #[error(
        "bodies {} and {} have the same tracking_id {tracking_id}; give each person in a frame a number of their own",
        bodies[0],
        bodies[1]
    )]
    TrackingIdTwice {
        /// The number.
        tracking_id: u64,
        /// Indices of the first two bodies that have it.
        bodies: [usize; 2],
    },
    /// The joint set is not one of ours.
    #[error(transparent)]
    JointSet(#[from] UnknownJointSet),
    /// The sensor's number is out of range.
    #[error(transparent)]
    SensorId(#[from] SensorIdError),
    /// A sensor's name cannot be used.
    #[error("sensor name `{0}`: use 1 to 64 of the letters a-z A-Z, digits, `.`, `_` and `-`")]
    SensorName(String),
    /// What a calibration says of a joint cannot be.
    #[error("joints of the calibration: {0}")]
    Joint(String),
    /// A part of the message is missing.
    #[error("the message lacks `{0}`")]
    Missing(&'static str),
    /// A pose is no rigid motion.
    #[error("pose of sensor `{sensor}`: {problem}")]
    Pose {
        /// Whose.
        sensor: String,
        /// What is wrong.
        problem: String,
    },
    /// A fused frame's array has the wrong length or holds an unknown value.
    #[error("track {track}: `{field}` does not hold what 25 joints need")]
    Track {
        /// The track's number.
        track: u64,
        /// The array.
        field: &'static str,
    },
}

/// Checks that `name` may name a sensor (it becomes part of topics and file names).
pub fn check_sensor_name(name: &str) -> Result<(), WireError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    if (1..=64).contains(&name.len()) && name.chars().all(allowed) && !name.starts_with('.') {
        Ok(())
    } else {
        Err(WireError::SensorName(name.chars().take(80).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_could_leave_a_folder_are_refused() {
        for bad in ["", "..", "a/b", "a\\b", "a b", "ä", &"x".repeat(65)] {
            assert!(check_sensor_name(bad).is_err(), "{bad} was taken");
        }
        assert!(check_sensor_name("left-1.front").is_ok());
    }
}
