//! Plays a recording as if its sensor stood here: keeps its rhythm, its delays and its clock, at any speed.

use std::sync::Arc;

use posefuse_skeleton::AgentTime;

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

/// How to play a recording; the fields are those of the sources' settings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReplayOptions {
    pub(crate) speed: f64,
    pub(crate) repeat: bool,
    pub(crate) align_s: f64,
    pub(crate) epoch_unix_ns: Option<i64>,
    pub(crate) prompt: bool,
}

impl ReplayOptions {
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
    options: ReplayOptions,
    round: u32,
    last_due_ns: i64,
    /// Found while joining in midway.
    pending: Option<RecordedFrame>,
}

impl<T: Tape> Replay<T> {
    /// Starts now, at the next aligned instant, or at the epoch, which may be past.
    pub(crate) fn start(
        tape: T,
        options: ReplayOptions,
        clock: &dyn Clock,
    ) -> Result<Self, SourceError> {
        let (begins_ns, ends_ns) = tape.span_ns();
        let pace = Pace {
            start_ns: match options.epoch_unix_ns {
                Some(epoch) => monotonic_of(clock, epoch),
                None => aligned_start(clock, options.align_s),
            },
            origin_ns: begins_ns,
            speed: options.speed,
            round_ns: (ends_ns - begins_ns).max(1),
        };
        let mut replay = Self {
            tape,
            pace,
            options,
            round: 0,
            last_due_ns: i64::MIN,
            pending: None,
        };
        if options.epoch_unix_ns.is_some() {
            replay.join_in(clock.monotonic_ns())?;
        }
        Ok(replay)
    }

    /// Passes over what was due before `now_ns`.
    fn join_in(&mut self, now_ns: i64) -> Result<(), SourceError> {
        let gone = now_ns.saturating_sub(self.pace.start_ns).max(0) as f64 * self.pace.speed;
        if self.options.repeat {
            self.round = (gone / self.pace.round_ns as f64) as u32;
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
        if frame.is_some() || !self.options.repeat {
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
        let due = if self.options.prompt {
            captured
        } else {
            delivered
        };
        self.last_due_ns = self.last_due_ns.max(due);
        Ok(Some(SourceFrame {
            captured: (self.clock())(captured),
            due_ns: Some(self.last_due_ns),
            bodies: frame.bodies,
        }))
    }
}
