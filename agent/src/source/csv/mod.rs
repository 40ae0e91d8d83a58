//! Replays one Kinect of a recorded session with two Kinects v2 on two computers.
//!
//! The recording's clocks are kept: a frame is stamped with its Kinect's own time (100 ns ticks from an epoch of its
//! own), and handed on when the recording's logger got it. The file says how the two relate only up to the delay of
//! each frame; the shortest delay of the file counts as none.

mod header;
mod recording;

use std::path::PathBuf;
use std::sync::Arc;

use posefuse_skeleton::{AgentTime, JointSet};
use serde::{Deserialize, Serialize};

use super::pace::{Pace, aligned_start, monotonic_of};
use super::{Description, SensorClock, SensorSource, SourceError, SourceFrame};
use crate::Clock;

pub use recording::{CsvError, RecordedFrame, Recording};

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

fn real_time() -> f64 {
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

    fn check(&self) -> Result<(), SourceError> {
        let within =
            |name: &str, value: f64, low: f64, high: f64| match (low..=high).contains(&value) {
                true => Ok(()),
                false => Err(SourceError::Final(format!(
                    "csv source: `{name}` must lie between {low} and {high}, found {value}"
                ))),
            };
        within("speed", self.speed, 0.01, 1000.0)?;
        within("align_s", self.align_s, 0.0, 3600.0)
    }
}

/// One Kinect of a recording, as a sensor.
pub(crate) struct CsvSource {
    recording: Recording,
    pace: Pace,
    repeat: bool,
    prompt: bool,
    next: usize,
    round: u32,
    last_due_ns: i64,
}

impl CsvSource {
    pub(crate) fn open(config: &CsvConfig, clock: &dyn Clock) -> Result<Self, SourceError> {
        config.check()?;
        let recording = Recording::read(&config.file, &config.kinect)
            .map_err(|error| SourceError::Final(error.to_string()))?;
        let start_ns = match config.epoch_unix_ns {
            Some(epoch) => monotonic_of(clock, epoch),
            None => aligned_start(clock, config.align_s),
        };
        let pace = Pace {
            start_ns,
            origin_ns: recording.begins_ns,
            speed: config.speed,
            round_ns: recording.ends_ns - recording.begins_ns,
        };
        let mut source = Self {
            recording,
            pace,
            repeat: config.repeat,
            prompt: config.prompt,
            next: 0,
            round: 0,
            last_due_ns: i64::MIN,
        };
        source.join_in(clock.monotonic_ns());
        Ok(source)
    }

    /// Passes over what was due before `now_ns`: a replay whose epoch is past is joined midway.
    fn join_in(&mut self, now_ns: i64) {
        if self.pace.start_ns >= now_ns {
            return;
        }
        let recorded = (now_ns - self.pace.start_ns) as f64 * self.pace.speed;
        if self.repeat {
            self.round = (recorded / self.pace.round_ns as f64) as u32;
        }
        let frames = &self.recording.frames;
        let due = |frame: &RecordedFrame| self.pace.replayed(frame.delivered_ns, self.round);
        self.next = frames
            .iter()
            .position(|frame| due(frame) >= now_ns)
            .unwrap_or(frames.len());
    }
}

impl SensorSource for CsvSource {
    fn description(&self) -> Description {
        Description {
            model: "Kinect v2 (recording)".into(),
            joint_set: JointSet::KinectV2,
        }
    }

    fn clock(&self) -> SensorClock {
        let (start, first) = (self.pace.start_ns, self.recording.device_origin_ns);
        Arc::new(move |monotonic| {
            AgentTime::from_ns(monotonic.saturating_sub(start).saturating_add(first))
        })
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        if self.next >= self.recording.frames.len() {
            if !self.repeat {
                return Ok(None);
            }
            self.next = 0;
            self.round = self.round.wrapping_add(1);
        }
        let frame = &self.recording.frames[self.next];
        self.next += 1;
        let captured = self.pace.replayed(frame.captured_ns, self.round);
        let delivered = self.pace.replayed(frame.delivered_ns, self.round);
        let due = if self.prompt { captured } else { delivered };
        self.last_due_ns = self.last_due_ns.max(due);
        Ok(Some(SourceFrame {
            captured: (self.clock())(captured),
            due_ns: Some(self.last_due_ns),
            bodies: frame.bodies.clone(),
        }))
    }
}

#[cfg(test)]
mod tests;
