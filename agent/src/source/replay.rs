//! Plays a recording as if its sensor stood here: keeps its rhythm, its delays and its clock, at any speed.

use std::sync::Arc;

use posefuse_skeleton::AgentTime;
use serde::{Deserialize, Serialize};

use super::pace::{Pace, aligned_start, monotonic_of};
use super::{Description, SensorClock, SensorSource, SourceBody, SourceError, SourceFrame};
use crate::Clock;

/// What a sensor saw at one instant. Times are the recording's delivery clock.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// When it was delivered, nanoseconds.
    pub delivered_ns: i64,
    /// When it was captured: the sensor's own time, moved so that the recording's quickest frame took no time.
    pub captured_ns: i64,
    /// Who was in view.
    pub bodies: Vec<SourceBody>,
}

/// A recording that can be played from its beginning, again and again.
pub(crate) trait Tape: Send {
    /// What the sensor was.
    fn description(&self) -> Description;
    /// Its frames' delivery clock at its beginning, and when a next round may begin, nanoseconds.
    fn span_ns(&self) -> (i64, i64);
    /// What the sensor's own clock shows at the beginning.
    fn sensor_origin_ns(&self) -> i64;
    /// Goes back to the first frame.
    fn rewind(&mut self);
    /// The next frame, in the order of delivery.
    fn next(&mut self) -> Result<Option<RecordedFrame>, SourceError>;
}

/// How a recording is played: once, at once and in real time unless it says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReplayConfig {
    /// How many times faster than recorded.
    pub speed: f64,
    /// Begin again at the end, for ever.
    #[serde(rename = "loop")]
    pub repeat: bool,
    /// Begin at the next multiple of this many seconds of civil time, so that the agents of several sensors, started
    /// within the same interval, replay in step. 0: begin at once.
    pub align_s: f64,
    /// Begin at this civil instant instead (ns since 1970), which may be past: then join in midway. With `repeat` the
    /// position in the recording follows civil time from there on, whenever the agent was started: agents of one
    /// recording that are given the same instant are in step.
    pub epoch_unix_ns: Option<i64>,
}

impl Default for ReplayConfig {
    fn default() -> Self {
        Self {
            speed: 1.0,
            repeat: false,
            align_s: 0.0,
            epoch_unix_ns: None,
        }
    }
}

impl ReplayConfig {
    /// Checks the numbers; `source` is the word for messages.
    pub(crate) fn check(&self, source: &str) -> Result<(), SourceError> {
        let within =
            |name: &str, value: f64, low: f64, high: f64| match (low..=high).contains(&value) {
                true => Ok(()),
                false => Err(SourceError::Final(format!(
                    "{source} source: `{name}` must lie between {low} and {high}, found {value}"
                ))),
            };
        within("speed", self.speed, 0.01, 1000.0)?;
        within("align_s", self.align_s, 0.0, 3600.0)
    }
}

/// A recording as a sensor.
pub(crate) struct Replay<T> {
    tape: T,
    pace: Pace,
    config: ReplayConfig,
    /// Frames are due when they were captured, not when they were delivered.
    prompt: bool,
    round: u32,
    last_due_ns: i64,
    /// Found while joining in midway.
    pending: Option<RecordedFrame>,
}

impl<T: Tape> Replay<T> {
    /// Starts now, at the next aligned instant, or at the epoch, which may be past. `prompt`: frames are handed on when
    /// they were captured, without the recording's delays.
    pub(crate) fn start(
        tape: T,
        config: ReplayConfig,
        prompt: bool,
        clock: &dyn Clock,
    ) -> Result<Self, SourceError> {
        let (begins_ns, ends_ns) = tape.span_ns();
        let pace = Pace {
            start_ns: match config.epoch_unix_ns {
                Some(epoch) => monotonic_of(clock, epoch),
                None => aligned_start(clock, config.align_s),
            },
            origin_ns: begins_ns,
            speed: config.speed,
            round_ns: (ends_ns - begins_ns).max(1),
        };
        let mut replay = Self {
            tape,
            pace,
            config,
            prompt,
            round: 0,
            last_due_ns: i64::MIN,
            pending: None,
        };
        if config.epoch_unix_ns.is_some() {
            replay.join_in(clock.monotonic_ns())?;
        }
        Ok(replay)
    }

    /// Passes over what was due before `now_ns`: whole rounds at once, then frames of the round that is on. The
    /// sensor's clock counts from that round's beginning.
    fn join_in(&mut self, now_ns: i64) -> Result<(), SourceError> {
        if self.config.repeat {
            let gone_ns = now_ns.saturating_sub(self.pace.start_ns).max(0) as f64;
            let round_ns = self.pace.round_ns as f64 / self.pace.speed;
            let before_ns = (gone_ns / round_ns).floor() * round_ns;
            self.pace.start_ns = self.pace.start_ns.saturating_add(before_ns.round() as i64);
        }
        while let Some(frame) = self.tape.next()? {
            if self.pace.replayed(frame.delivered_ns, self.round) >= now_ns {
                self.pending = Some(frame);
                break;
            }
        }
        Ok(())
    }

    fn recorded(&mut self) -> Result<Option<RecordedFrame>, SourceError> {
        if let Some(frame) = self.pending.take() {
            return Ok(Some(frame));
        }
        let frame = self.tape.next()?;
        if frame.is_some() || !self.config.repeat {
            return Ok(frame);
        }
        self.tape.rewind();
        self.round = self.round.saturating_add(1);
        self.tape.next()
    }
}

impl<T: Tape> SensorSource for Replay<T> {
    fn description(&self) -> Description {
        self.tape.description()
    }

    fn clock(&self) -> SensorClock {
        let (start_ns, origin_ns) = (self.pace.start_ns, self.tape.sensor_origin_ns());
        Arc::new(move |monotonic_ns: i64| {
            AgentTime::from_ns(
                monotonic_ns
                    .saturating_sub(start_ns)
                    .saturating_add(origin_ns),
            )
        })
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        let Some(frame) = self.recorded()? else {
            return Ok(None);
        };
        let captured = self.pace.replayed(frame.captured_ns, self.round);
        let delivered = self.pace.replayed(frame.delivered_ns, self.round);
        let due = if self.prompt { captured } else { delivered };
        self.last_due_ns = self.last_due_ns.max(due);
        Ok(Some(SourceFrame {
            captured: (self.clock())(captured),
            due_ns: Some(self.last_due_ns),
            bodies: frame.bodies,
        }))
    }
}
