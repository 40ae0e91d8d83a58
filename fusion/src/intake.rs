//! When a fused frame is made: `async` follows the observations, `window` a fixed grid of times.
//!
//! Frame times are capture times in the server's clock and strictly increase. Nothing here looks at what was seen.
//!
//! `async` makes a frame at the newest capture time, less what the slowest live sensor needs: trackers' delays differ by
//! 100 ms and more, and a sample moved that far by velocity says nothing. So the frame's time is held back until that
//! sensor's samples need not be moved further than the oldest that is allowed. Sensors alike hold nothing back.

use posefuse_skeleton::{SensorId, Timestamp};
use serde::{Deserialize, Serialize};

use crate::config::{IntakeConfig, IntakeMode, ms_to_ns};

/// Behind the present by more than this, grid times are skipped, ns.
const MAX_BACKLOG_NS: i64 = 1_000_000_000;

/// Share of a new age in a sensor's running one.
const AGE_GAIN: f64 = 0.05;
/// Share of the largest allowed age that a sensor's samples usually reach; the rest is for jitter.
const USUAL_SHARE: f64 = 0.8;
/// Frame times are held back, or let go, by at most one part in so many of the time that passes.
const SLEW_PARTS: i64 = 4;

/// One frame of a sensor: when it was captured and when it came.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Came {
    captured: Timestamp,
    received: Timestamp,
}

/// What is known of one sensor's frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Heard {
    /// The latest that came, usable or late.
    any: Option<Came>,
    /// The latest that was of use.
    usable: Option<Came>,
    /// How old its newest sample usually is, against the newest of all, when the next one comes, ns.
    age_ns: f64,
}

/// Decides frame times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Intake {
    /// By the sensors' numbers.
    heard: Vec<Heard>,
    /// `async`: frames are made so long before the newest capture time, ns.
    held_ns: i64,
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
    /// An observation of `sensor`, captured at `time`, came at `now`, whether or not it is too late to be of use.
    pub(crate) fn arrived(
        &mut self,
        sensor: SensorId,
        time: Timestamp,
        now: Timestamp,
        config: &IntakeConfig,
    ) {
        self.make_room(sensor);
        let live_ns = ms_to_ns(config.live_ms);
        let is_live = |came: &Came| now.since_ns(came.received) <= live_ns;
        let (mut newest, mut slowest_ns) = (None, 0.0);
        for (other, heard) in self.heard.iter().enumerate() {
            if let Some(came) = heard.any.filter(is_live) {
                newest = newest.max(Some(came.captured));
                if other != sensor.index() {
                    slowest_ns = f64::max(slowest_ns, heard.age_ns);
                }
            }
        }
        let heard = &mut self.heard[sensor.index()];
        if let (Some(known), Some(newest)) = (heard.any.filter(is_live), newest) {
            let age = newest.since_ns(known.captured);
            // What is waited for no more, or comes again after a pause, says nothing of what is usual.
            if age <= ms_to_ns(config.max_lag_ms) {
                heard.age_ns += AGE_GAIN * (age as f64 - heard.age_ns);
            }
        }
        heard.any = Some(Came {
            captured: time,
            received: now,
        });
        let age_ns = heard.age_ns;
        let passed_ns = newest.map_or(0, |newest| time.since_ns(newest).clamp(0, live_ns));
        self.hold_back(f64::max(slowest_ns, age_ns) as i64, passed_ns, config);
    }

    /// Lets `held_ns` go to where samples that are usually `slowest_ns` old can be used, as `passed_ns` have passed.
    fn hold_back(&mut self, slowest_ns: i64, passed_ns: i64, config: &IntakeConfig) {
        let usable_ns = (USUAL_SHARE * config.max_age_ns() as f64) as i64;
        let wanted_ns = match config.mode {
            IntakeMode::Async => slowest_ns.saturating_sub(usable_ns).max(0),
            IntakeMode::Window => 0,
        };
        let step_ns = passed_ns / SLEW_PARTS;
        self.held_ns = wanted_ns.clamp(self.held_ns - step_ns, self.held_ns + step_ns);
    }

    /// A usable observation of `sensor`, captured at `time`, came at `now`.
    pub(crate) fn delivered(
        &mut self,
        sensor: SensorId,
        time: Timestamp,
        now: Timestamp,
        config: &IntakeConfig,
    ) {
        self.make_room(sensor);
        self.heard[sensor.index()].usable = Some(Came {
            captured: time,
            received: now,
        });
        match config.mode {
            IntakeMode::Async if self.is_due(time.plus_ns(-self.held_ns)) => {
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

    fn make_room(&mut self, sensor: SensorId) {
        if self.heard.len() <= sensor.index() {
            self.heard.resize(sensor.index() + 1, Heard::default());
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
            let newest = self.usable().map(|came| came.captured).max()?;
            let time = newest.plus_ns(-self.held_ns);
            let last = self.last.map(|(last, _)| last);
            let all_here = self
                .live(now, config)
                .all(|came| last.is_none_or(|last| came.captured > last));
            if all_here || now >= deadline {
                self.deadline = None;
                self.coasting = false;
                self.schedule_after(time, config);
                return Some(time);
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
        let all_passed = live.peek().is_some() && live.all(|came| came.captured >= grid);
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

    /// Every sensor's latest frame that was of use.
    fn usable(&self) -> impl Iterator<Item = &Came> {
        self.heard.iter().filter_map(|heard| heard.usable.as_ref())
    }

    fn live(&self, now: Timestamp, config: &IntakeConfig) -> impl Iterator<Item = &Came> {
        let live_ns = ms_to_ns(config.live_ms);
        self.usable()
            .filter(move |came| now.since_ns(came.received) <= live_ns)
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
