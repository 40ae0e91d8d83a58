//! The vocabulary of Posefuse: coordinate frames, joints, skeletons, time, observations, tracks, calibration data.
//!
//! Pure data and the laws that hold for it: no I/O, no clock, no other crate of this project.
//! Units are metres, radians and nanoseconds unless a name says otherwise. See `docs/FRAMES.md` for the axes.

mod axes;
mod calibration;
pub mod calibration_text;
mod comparison;
mod confidence;
mod depth;
mod frame;
mod joint;
mod joint_set;
mod local_axes;
mod observation;
mod sensor;
mod skeleton;
mod time;
mod timecode;
mod track;

pub use axes::Axes;
pub use calibration::{Calibration, FloorSource, PoseSigma, SensorPose};
pub use comparison::{Comparison, View};
pub use confidence::{Confidence, ConfidenceError};
pub use depth::{DepthImage, Intrinsics};
pub use frame::{Frame, Position, Room, Sensor, Transform};
pub use joint::{ARMS, BONES, Bone, JOINT_COUNT, Joint, LEGS, SIDE_PAIRS};
pub use joint_set::{JointSet, Mapping, RawJoint, UnknownJointSet};
pub use local_axes::{local_axes, local_axes_within, trunk_axes};
pub use observation::{Body, Observation};
pub use sensor::{SensorId, SensorIdError, SensorInfo, SensorSet};
pub use skeleton::{JointMap, JointState, Provenance, Skeleton};
pub use time::{AgentTime, Clock, SensorClock, ServerClock, Time, Timestamp};
pub use timecode::{Timecode, TimecodeError, TimecodeRate, TimecodeZone};
pub use track::{HandVotes, RoomFrame, Track, TrackId};
