//! Replays one Kinect of a recorded session with two Kinects v2 on two computers.
//!
//! The recording's clocks are kept: a frame is stamped with its Kinect's own time (100 ns ticks from an epoch of its
//! own), and handed on when the recording's logger got it. The file says how the two relate only up to the delay of
//! each frame; the shortest delay of the file counts as none.

mod header;
mod recording;

use std::path::PathBuf;

use posefuse_skeleton::JointSet;
use serde::{Deserialize, Serialize};

use super::replay::{RecordedFrame, Replay, ReplayConfig, Tape};
use super::{Description, SourceError};
use crate::Clock;

pub use recording::{CsvError, Recording};

/// Which recording, which Kinect, and how to replay it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CsvConfig {
    /// The file.
    pub file: PathBuf,
    /// The Kinect: the IPv4 address of its computer as the file has it, or its number (1, 2) in the order of addresses.
    pub kinect: String,
    /// How to play it.
    #[serde(default)]
    pub replay: ReplayConfig,
    /// Hand frames on as they were captured instead of with the delays of the recording's logger (up to a second).
    #[serde(default)]
    pub prompt: bool,
}

impl CsvConfig {
    /// Real time, once, at once.
    pub fn new(file: impl Into<PathBuf>, kinect: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            kinect: kinect.into(),
            replay: ReplayConfig::default(),
            prompt: false,
        }
    }
}

/// Reads the recording and makes its Kinect a sensor.
pub(crate) fn open(config: &CsvConfig, clock: &dyn Clock) -> Result<Replay<CsvTape>, SourceError> {
    config.replay.check("csv")?;
    let recording = Recording::read(&config.file, &config.kinect)
        .map_err(|error| SourceError::Final(error.to_string()))?;
    let tape = CsvTape { recording, next: 0 };
    Replay::start(tape, config.replay, config.prompt, clock)
}

/// One Kinect of a recording, from its first frame to its last.
pub(crate) struct CsvTape {
    recording: Recording,
    next: usize,
}

impl Tape for CsvTape {
    fn description(&self) -> Description {
        Description {
            model: "Kinect v2 (recording)".into(),
            joint_set: JointSet::KinectV2,
            camera: None,
        }
    }

    fn span_ns(&self) -> (i64, i64) {
        (self.recording.begins_ns, self.recording.ends_ns)
    }

    fn sensor_origin_ns(&self) -> i64 {
        self.recording.device_origin_ns
    }

    fn rewind(&mut self) {
        self.next = 0;
    }

    fn next(&mut self) -> Result<Option<RecordedFrame>, SourceError> {
        let frame = self.recording.frames.get(self.next).cloned();
        self.next += 1;
        Ok(frame)
    }
}

#[cfg(test)]
mod tests;
