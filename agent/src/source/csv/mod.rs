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

use super::replay::{RecordedFrame, Replay, ReplayOptions, Tape};
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
    /// How many times faster than recorded.
    #[serde(default = "real_time")]
    pub speed: f64,
    /// Begin again at the end, for ever.
    #[serde(default, rename = "loop")]
    pub repeat: bool,
    /// Begin at the next multiple of this many seconds of civil time, so that the agents of both Kinects, started
    /// within the same interval, replay in step. 0: begin at once.
    #[serde(default)]
    pub align_s: f64,
    /// Begin at this civil instant instead (ns since 1970), which may be past: then join in midway.
    #[serde(default)]
    pub epoch_unix_ns: Option<i64>,
    /// Hand frames on as they were captured instead of with the delays of the recording's logger (up to a second).
    #[serde(default)]
    pub prompt: bool,
}

pub(crate) fn real_time() -> f64 {
    1.0
}

impl CsvConfig {
    /// Real time, once, at once.
    pub fn new(file: impl Into<PathBuf>, kinect: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            kinect: kinect.into(),
            speed: real_time(),
            repeat: false,
            align_s: 0.0,
            epoch_unix_ns: None,
            prompt: false,
        }
    }

    fn options(&self) -> ReplayOptions {
        ReplayOptions {
            speed: self.speed,
            repeat: self.repeat,
            align_s: self.align_s,
            epoch_unix_ns: self.epoch_unix_ns,
            prompt: self.prompt,
        }
    }
}

/// Reads the recording and makes its Kinect a sensor.
pub(crate) fn open(config: &CsvConfig, clock: &dyn Clock) -> Result<Replay<CsvTape>, SourceError> {
    config.options().check("csv")?;
    let recording = Recording::read(&config.file, &config.kinect)
        .map_err(|error| SourceError::Final(error.to_string()))?;
    Replay::start(CsvTape { recording, next: 0 }, config.options(), clock)
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
