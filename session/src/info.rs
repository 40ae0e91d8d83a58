//! What the list of takes shows of one, and how the file keeps it: a metadata record at its end.

use std::collections::BTreeMap;

use posefuse_skeleton::Timestamp;
use serde::{Deserialize, Serialize};

use crate::TakeHeader;

/// The metadata record that a take ends with.
pub(crate) const END: &str = "posefuse.take.end";

/// One take, as a list shows it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TakeInfo {
    /// The file's name without `.mcap`.
    pub name: String,
    /// What the user calls the scene.
    pub slate: String,
    /// What the user wrote down.
    pub notes: String,
    /// Civil time of the start, RFC 3339, UTC.
    pub started: String,
    /// The same, nanoseconds since 1970.
    pub start_unix_ns: i64,
    /// The same as timecode, and its rate; empty in takes from before there was one.
    pub timecode: String,
    /// Its rate.
    pub timecode_rate: String,
    /// Most people at once.
    pub people: u32,
    /// Names of the sensors that took part, in order.
    pub sensors: Vec<String>,
    /// From the start to the last message, nanoseconds.
    pub duration_ns: i64,
    /// Fused frames.
    pub frames: u64,
    /// The file's bytes.
    pub size_bytes: u64,
    /// Inputs that did not reach the file.
    pub dropped: u64,
    /// Frames, rejections and events that did not reach the file.
    pub dropped_outputs: u64,
    /// How the take stands.
    pub state: TakeState,
    /// What is wrong with it, in words; empty when nothing is.
    pub trouble: String,
}

/// How a take stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TakeState {
    /// It is being written.
    Recording,
    /// It has a proper end.
    Complete,
    /// It was cut off and repaired.
    Recovered,
    /// It was cut off and not repaired yet, or it cannot be read; `trouble` says which.
    #[default]
    Damaged,
}

impl TakeState {
    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recording => "recording",
            Self::Complete => "complete",
            Self::Recovered => "recovered",
            Self::Damaged => "damaged",
        }
    }
}

impl TakeInfo {
    pub(crate) fn begun(header: &TakeHeader) -> Self {
        let start = header.start.unwrap_or(Timestamp::ZERO);
        let [timecode, timecode_rate] = header.timecode(start);
        Self {
            start_unix_ns: start.ns().saturating_add(header.unix_offset_ns),
            timecode,
            timecode_rate,
            name: header.name.clone(),
            slate: header.slate.clone(),
            notes: header.notes.clone(),
            started: header.started.clone(),
            state: TakeState::Recording,
            ..Self::default()
        }
    }

    pub(crate) fn to_metadata(&self) -> BTreeMap<String, String> {
        let pairs = [
            ("state", self.state.name().to_owned()),
            ("people", self.people.to_string()),
            ("sensors", self.sensors.join(" ")),
            ("duration_ns", self.duration_ns.to_string()),
            ("frames", self.frames.to_string()),
            ("dropped", self.dropped.to_string()),
            ("dropped_outputs", self.dropped_outputs.to_string()),
            ("trouble", self.trouble.clone()),
        ];
        pairs
            .into_iter()
            .map(|(key, value)| (key.to_owned(), value))
            .collect()
    }

    /// Takes in the metadata record that the file ends with; what is no number counts as 0.
    pub(crate) fn take_end(&mut self, metadata: &BTreeMap<String, String>) {
        let text = |key: &str| metadata.get(key).map_or("", String::as_str);
        self.state = match text("state") {
            "recovered" => TakeState::Recovered,
            _ => TakeState::Complete,
        };
        let count = |key: &str| text(key).parse().unwrap_or(0);
        self.people = text("people").parse().unwrap_or(0);
        self.sensors = text("sensors")
            .split_whitespace()
            .map(str::to_owned)
            .collect();
        self.duration_ns = text("duration_ns").parse().unwrap_or(0);
        self.frames = count("frames");
        self.dropped = count("dropped");
        self.dropped_outputs = count("dropped_outputs");
        self.trouble = text("trouble").to_owned();
    }
}
