//! The JSON that `--json` prints: plain names and SI units, the same from a server and from a folder.

mod calibration;

use std::collections::BTreeMap;

use posefuse_proto::v1;
use posefuse_session::TakeInfo;
use posefuse_skeleton::{Provenance, RoomFrame, Track};
use serde::Serialize;

pub(crate) use calibration::{CalibrationView, KeptView, MoveView, PairView, SensorPoseView};

/// A take.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TakeView {
    pub(crate) name: String,
    pub(crate) slate: String,
    pub(crate) notes: String,
    /// `recording`, `complete`, `recovered` or `damaged`.
    pub(crate) state: &'static str,
    pub(crate) started: String,
    /// The same, nanoseconds since 1970.
    pub(crate) start_unix_ns: i64,
    /// The same as timecode, and its rate; empty in takes from before there was one.
    pub(crate) timecode: String,
    pub(crate) timecode_rate: String,
    pub(crate) seconds: f64,
    pub(crate) bytes: u64,
    pub(crate) frames: u64,
    pub(crate) people: u32,
    pub(crate) sensors: Vec<String>,
    pub(crate) dropped: u64,
    pub(crate) trouble: String,
    /// The file, where it is known to be on this machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) path: Option<String>,
}

/// A take of the wire and one of a folder have the same fields, but for the state.
macro_rules! take_view {
    ($take:expr, $state:expr) => {
        TakeView {
            name: $take.name.clone(),
            slate: $take.slate.clone(),
            notes: $take.notes.clone(),
            state: $state,
            started: $take.started.clone(),
            start_unix_ns: $take.start_unix_ns,
            timecode: $take.timecode.clone(),
            timecode_rate: $take.timecode_rate.clone(),
            seconds: $take.duration_ns as f64 * 1e-9,
            bytes: $take.size_bytes,
            frames: $take.frames,
            people: $take.people,
            sensors: $take.sensors.clone(),
            dropped: $take.dropped,
            trouble: $take.trouble.clone(),
            path: None,
        }
    };
}

impl From<&v1::Take> for TakeView {
    fn from(take: &v1::Take) -> Self {
        let state = match take.state() {
            v1::TakeState::Recording => "recording",
            v1::TakeState::Complete => "complete",
            v1::TakeState::Recovered => "recovered",
            v1::TakeState::Damaged | v1::TakeState::Unspecified => "damaged",
        };
        take_view!(take, state)
    }
}

impl From<&TakeInfo> for TakeView {
    fn from(take: &TakeInfo) -> Self {
        take_view!(take, take.state.name())
    }
}

/// One fused frame.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FrameView {
    pub(crate) number: u64,
    /// The instant the poses belong to, server clock.
    pub(crate) time_s: f64,
    /// The same instant in civil time, nanoseconds since 1970, and as the room's timecode.
    pub(crate) unix_ns: i64,
    pub(crate) timecode: String,
    pub(crate) people: Vec<PersonView>,
}

/// One fused person.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PersonView {
    pub(crate) id: u64,
    /// Since when this person has been followed, server clock.
    pub(crate) since_s: f64,
    pub(crate) sensors: Vec<String>,
    pub(crate) joints: BTreeMap<&'static str, JointView>,
}

/// One joint of a person; a joint that is missing is absent.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct JointView {
    /// Room frame: x forward, y left, z up.
    pub(crate) position_m: [f64; 3],
    pub(crate) sigma_mm: f64,
    pub(crate) confidence: f64,
    /// `measured`, `predicted` or `repaired`.
    pub(crate) provenance: &'static str,
}

impl FrameView {
    /// The frame, with its civil time and timecode, and its sensors by name.
    pub(crate) fn new(
        frame: &RoomFrame,
        (unix_ns, timecode): (i64, String),
        name: impl Fn(usize) -> String,
    ) -> Self {
        let person = |track: &Track| PersonView {
            id: track.id.0,
            since_s: track.since.seconds(),
            sensors: track.sensors.iter().map(|id| name(id.index())).collect(),
            joints: track
                .skeleton
                .iter()
                .map(|(joint, state)| {
                    let p = state.position.vector();
                    let view = JointView {
                        position_m: [p.x, p.y, p.z].map(|v| (v * 1e5).round() / 1e5),
                        sigma_mm: (state.sigma_m() * 1e5).round() / 100.0,
                        confidence: (f64::from(state.confidence.get()) * 1e3).round() / 1e3,
                        provenance: provenance(state.provenance),
                    };
                    (joint.name(), view)
                })
                .collect(),
        };
        Self {
            number: frame.number,
            time_s: frame.time.seconds(),
            unix_ns,
            timecode,
            people: frame.tracks.iter().map(person).collect(),
        }
    }
}

fn provenance(provenance: Provenance) -> &'static str {
    match provenance {
        Provenance::Measured(_) => "measured",
        Provenance::Predicted(_) => "predicted",
        Provenance::Repaired => "repaired",
    }
}
