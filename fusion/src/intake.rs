//! When a fused frame is made: `async` follows the observations, `window` a fixed grid of times.
//!
//! Frame times are capture times in the server's clock and strictly increase. Nothing here looks at what was seen.

use posefuse_skeleton::{SensorId, Timestamp};
use serde::{Deserialize, Serialize};

use crate::config::{IntakeConfig, IntakeMode, ms_to_ns};

/// Behind the present by more than this, grid times are skipped, ns.
const MAX_BACKLOG_NS: i64 = 1_000_000_000;

/// What one sensor has delivered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Delivered {
    newest: Timestamp,
    received: Timestamp,
}

/// Decides frame times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Intake {
    delivered: Vec<Option<Delivered>>,
    /// Time of the last frame, and when it was made.
    last: Option<(Timestamp, Timestamp)>,
    /// `async`: no frame before this.
    not_before: Option<Timestamp>,
    /// `async`: a due frame waits for other sensors until then.
    deadline: Option<Timestamp>,
    /// `async`: the last frame came from a tick.
    coasting: bool,
    /// `window`: the next grid time.
    grid: Option<Timestamp>,
}

impl Intake {
    /// A usable observation of `sensor`, captured at `time`, came at `now`.
    pub(crate) fn delivered(
        &mut self,
        sensor: SensorId,
        time: Timestamp,
        now: Timestamp,
        config: &IntakeConfig,
    ) {
        let index = sensor.index();
        if self.delivered.len() <= index {
            self.delivered.resize(index + 1, None);
        }
        self.delivered[index] = Some(Delivered {
            newest: time,
            received: now,
        });
        match config.mode {
            IntakeMode::Async if self.is_due(time) => {
                self.deadline
                    .get_or_insert(now.plus_ns(ms_to_ns(config.coalesce_ms)));
            }
            IntakeMode::Async => {}
            IntakeMode::Window => {
                let first = || first_grid_time(time, self.last.map(|(last, _)| last), config);
                self.grid = self.grid.or_else(|| Some(first()));
            }
        }
    }

    /// Whether a sample captured at `time` is too old to be of use.
    pub(crate) fn is_late(&self, time: Timestamp, config: &IntakeConfig) -> bool {
        self.last
            .is_some_and(|(last, _)| last.since_ns(time) > config.max_age_ns())
    }

    /// The time of the frame to be made at `now`, if one is; `anyone` says whether the room must go on without
    /// observations. Call until `None`.
    pub(crate) fn due(
        &mut self,
        now: Timestamp,
        anyone: bool,
        config: &IntakeConfig,
    ) -> Option<Timestamp> {
        let time = match config.mode {
            IntakeMode::Async => self.due_async(now, anyone, config),
            IntakeMode::Window => self.due_window(now, anyone, config),
        }?;
        if self.last.is_some_and(|(last, _)| time <= last) {
            return None;
        }
        self.last = Some((time, now));
        Some(time)
    }

    /// When to call [`Intake::due`] next though nothing comes.
    pub(crate) fn wake(
        &self,
        now: Timestamp,
        anyone: bool,
        config: &IntakeConfig,
    ) -> Option<Timestamp> {
        let wake = match config.mode {
            IntakeMode::Async => {
                let silence = if anyone { self.silent_at(config) } else { None };
                self.deadline.into_iter().chain(silence).min()
            }
            IntakeMode::Window => {
                let going_on = anyone || self.live(now, config).next().is_some();
                let grid = if going_on { self.grid } else { None };
                grid.map(|grid| grid.plus_ns(ms_to_ns(config.max_wait_ms)))
            }
        };
        wake.map(|wake| wake.max(now.plus_ns(1)))
    }

    fn is_due(&self, time: Timestamp) -> bool {
        self.last.is_none_or(|(last, _)| time > last)
            && self.not_before.is_none_or(|earliest| time >= earliest)
    }

    fn due_async(
        &mut self,
        now: Timestamp,
        anyone: bool,
        config: &IntakeConfig,
    ) -> Option<Timestamp> {
        if let Some(deadline) = self.deadline {
            let newest = self.delivered.iter().flatten().map(|d| d.newest).max()?;
            let last = self.last.map(|(last, _)| last);
            let all_here = self
                .live(now, config)
                .all(|d| last.is_none_or(|last| d.newest > last));
            if all_here || now >= deadline {
                self.deadline = None;
                self.coasting = false;
                self.schedule_after(newest, config);
                return Some(newest);
            }
        }
        if anyone && self.silent_at(config).is_some_and(|at| now >= at) {
            let (last, made) = self.last?;
            let time = last.plus_ns(now.since_ns(made));
            self.deadline = None;
            self.coasting = true;
            self.schedule_after(time, config);
            return Some(time);
        }
        None
    }

    /// A frame may come a quarter of a period early, so that a sensor's jitter does not halve the rate.
    fn schedule_after(&mut self, time: Timestamp, config: &IntakeConfig) {
        let period = config.period_ns();
        let regular = self.not_before.map(|earliest| earliest.plus_ns(period));
        let soonest = time.plus_ns(period - period / 2);
        self.not_before = Some(
            regular.map_or(time.plus_ns(period - period / 4), |regular| {
                regular.max(soonest)
            }),
        );
    }

    /// When ticks have to carry the room on.
    fn silent_at(&self, config: &IntakeConfig) -> Option<Timestamp> {
        let (_, made) = self.last?;
        let wait = if self.coasting {
            config.period_ns()
        } else {
            ms_to_ns(config.silence_ms)
        };
        Some(made.plus_ns(wait))
    }

    fn due_window(
        &mut self,
        now: Timestamp,
        anyone: bool,
        config: &IntakeConfig,
    ) -> Option<Timestamp> {
        let mut grid = self.grid?;
        let mut live = self.live(now, config).peekable();
        if live.peek().is_none() && !anyone {
            drop(live);
            self.grid = None;
            return None;
        }
        let all_passed = live.peek().is_some() && live.all(|d| d.newest >= grid);
        drop(live);
        let waited_ns = now.since_ns(grid);
        if !all_passed && waited_ns < ms_to_ns(config.max_wait_ms) {
            return None;
        }
        if waited_ns > MAX_BACKLOG_NS {
            grid = grid_time(now.plus_ns(-ms_to_ns(config.max_wait_ms)), config);
        }
        self.grid = Some(grid.plus_ns(config.period_ns()));
        Some(grid)
    }

    fn live(&self, now: Timestamp, config: &IntakeConfig) -> impl Iterator<Item = &Delivered> {
        let live_ns = ms_to_ns(config.live_ms);
        self.delivered
            .iter()
            .flatten()
            .filter(move |d| now.since_ns(d.received) <= live_ns)
    }
}

/// The grid's last time up to `time`.
fn grid_time(time: Timestamp, config: &IntakeConfig) -> Timestamp {
    let period = config.period_ns();
    Timestamp::from_ns(time.ns().div_euclid(period).saturating_mul(period))
}

/// The grid's first time at or after `time` and after `last`.
fn first_grid_time(time: Timestamp, last: Option<Timestamp>, config: &IntakeConfig) -> Timestamp {
    let at_or_after = grid_time(time.plus_ns(config.period_ns() - 1), config);
    match last {
        Some(last) if at_or_after <= last => grid_time(last, config).plus_ns(config.period_ns()),
        _ => at_or_after,
    }
}

#[cfg(test)]
mod tests;
