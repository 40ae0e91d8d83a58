//! What a take holds, in the words of this project.

use posefuse_fusion::Input;
use posefuse_skeleton::{JOINT_COUNT, Position, Room, RoomFrame, Timestamp};

use crate::EngineState;

/// One message of a take.
#[derive(Clone, Debug, PartialEq)]
pub enum Recorded {
    /// The engine consumed this.
    Input(Input),
    /// The engine's state when recording began.
    State(EngineState),
    /// A fused frame.
    Frame(RoomFrame),
    /// The engine refused this.
    Rejection(RecordedRejection),
    /// Something happened around the engine.
    Event(Event),
    /// Where simulated people truly were.
    Truth(Truth),
    /// For viewers only.
    View,
}

/// Something the engine refused, as a take names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedRejection {
    /// The sensor's number.
    pub sensor: u32,
    /// When the server had received it.
    pub time: Timestamp,
    /// `fusion::RejectionReason::name`.
    pub reason: String,
    /// The joint's name, if it was one joint.
    pub joint: Option<String>,
}

/// Something that happened around the engine.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Event {
    /// When, server time, nanoseconds.
    pub time_ns: i64,
    /// What kind, e.g. `sensor-connected`.
    pub kind: String,
    /// The sensor it is about; empty: none.
    pub sensor: String,
    /// In words.
    pub text: String,
    /// [`Event::INPUTS_DROPPED`] and [`Event::OUTPUTS_DROPPED`]: how many messages did not reach the file since the
    /// last such event.
    pub count: u64,
}

impl Event {
    /// The kind that tells of inputs that are not in the file.
    pub const INPUTS_DROPPED: &str = "inputs-dropped";
    /// The kind that tells of frames, rejections and events that are not in the file.
    pub const OUTPUTS_DROPPED: &str = "outputs-dropped";
}

/// Where simulated people truly are at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Server time.
    pub time: Timestamp,
    /// The people.
    pub people: Vec<TruePerson>,
}

/// One simulated person.
#[derive(Clone, Debug, PartialEq)]
pub struct TruePerson {
    /// The simulator's number for this person.
    pub id: u64,
    /// All joints in canonical order; kept as f32.
    pub joints: [Position<Room>; JOINT_COUNT],
}
