//! What stands on the floor, and where it is kept.
//!
//! Heel and ball of each foot are watched by themselves, so that a foot that rolls off keeps its toes. What is slow and
//! low stands; it leaves when it is fast or high, with other thresholds (hysteresis), or when it is too far from where it
//! is kept. Taking hold and letting go are gradual.

use nalgebra::Vector3;
use posefuse_skeleton::Timestamp;

use crate::bones::LEGS;
use crate::config::FeetConfig;

/// What of a foot stands on the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// The heel (the ankle joint is at its flat height and still).
    pub heel: bool,
    /// The ball of the foot (the foot joint is).
    pub toes: bool,
}

/// The watched points: bones whose origins they are. Left heel, left ball, right heel, right ball.
pub(crate) const POINTS: [usize; 4] = [LEGS[0].foot, LEGS[0].toes, LEGS[1].foot, LEGS[1].toes];

/// Speed is the slope over so many frames.
const WINDOW: usize = 5;
/// Older places say nothing of the speed, seconds.
const OLDEST_S: f64 = 0.4;
/// The place that is kept follows what is seen: by the mean at first, over this many seconds later.
const SETTLE_S: f64 = 5.0;
/// What is not seen for this long is let go, seconds.
const UNSEEN_S: f64 = 0.5;

/// Where a point should be that is kept, and how much it is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Held {
    /// Where it was seen last, moved by `share` of the way to where it is kept.
    pub(crate) at: Vector3<f64>,
    /// 0 (not yet, or no more) to 1.
    pub(crate) share: f64,
}

#[derive(Clone, Debug, Default)]
struct Point {
    recent: Vec<(Timestamp, Vector3<f64>)>,
    stands: bool,
    kept: Vector3<f64>,
    /// From where it was seen to where it is kept; as it was last while it stood. A foot that is let go leaves with that: what
    /// is left of it moves along and dwindles.
    offset: Vector3<f64>,
    frames: f64,
    /// Grows evenly while it stands, falls evenly after.
    grip: f64,
}

/// The feet of one person.
#[derive(Clone, Debug, Default)]
pub(crate) struct Feet {
    points: [Point; POINTS.len()],
}

impl Feet {
    /// Takes in where the four points are seen; `flat` are their heights in flat standing.
    pub(crate) fn step(
        &mut self,
        seen: &[Option<Vector3<f64>>; POINTS.len()],
        flat: &[f64; POINTS.len()],
        at: Timestamp,
        elapsed: f64,
        config: &FeetConfig,
    ) {
        for (point, (seen, flat)) in self.points.iter_mut().zip(seen.iter().zip(flat)) {
            point.step(*seen, *flat, at, elapsed, config);
        }
    }

    /// Left, right.
    pub(crate) fn contacts(&self) -> [Contact; 2] {
        [0, 2].map(|first| Contact {
            heel: self.points[first].stands,
            toes: self.points[first + 1].stands,
        })
    }

    /// Where point `index` is kept; `None` where it moves freely.
    pub(crate) fn held(&self, index: usize) -> Option<Held> {
        let point = &self.points[index];
        let share = point.grip * point.grip * (3.0 - 2.0 * point.grip);
        let seen = point.recent.last().map_or(point.kept, |(_, seen)| *seen);
        (share > 0.0).then(|| Held {
            at: seen + point.offset * share,
            share,
        })
    }
}

impl Point {
    fn step(
        &mut self,
        seen: Option<Vector3<f64>>,
        flat: f64,
        at: Timestamp,
        elapsed: f64,
        config: &FeetConfig,
    ) {
        self.recent
            .retain(|(time, _)| (0.0..=OLDEST_S).contains(&at.since_seconds(*time)));
        if let Some(seen) = seen {
            if self.recent.len() == WINDOW {
                self.recent.remove(0);
            }
            self.recent.push((at, seen));
        }
        let stood = self.stands;
        self.stands = self.is_standing(flat, at, config);
        if self.stands {
            if !stood {
                // A hold that was just let go is taken up again where it was, if that is near enough.
                let back = self.grip > 0.0
                    && seen.is_some_and(|seen| (seen - self.kept).norm() < config.leave_m / 2.0);
                if !back {
                    self.kept = seen.unwrap_or(self.kept);
                    self.frames = 1.0;
                    self.grip = 0.0;
                }
            } else if let Some(seen) = seen {
                self.frames += 1.0;
                let gain = (1.0 / self.frames).max((elapsed / SETTLE_S).min(1.0));
                self.kept += (seen - self.kept) * gain;
            }
        }
        if let (true, Some(seen)) = (self.stands, seen) {
            self.offset = self.kept - seen;
        }
        let (goal, over) = if self.stands {
            (1.0, config.catch_s)
        } else {
            (0.0, config.release_s)
        };
        let most = if over > 0.0 { elapsed / over } else { 1.0 };
        self.grip += (goal - self.grip).clamp(-most, most);
    }

    fn is_standing(&self, flat: f64, at: Timestamp, config: &FeetConfig) -> bool {
        let Some((last, place)) = self.recent.last() else {
            return false;
        };
        if at.since_seconds(*last) > UNSEEN_S {
            return false;
        }
        let Some(speed) = self.speed() else {
            return false;
        };
        let height = place.z - flat;
        if self.stands {
            let near = (place - self.kept).norm() < config.leave_m;
            speed < config.fast_mps && height < config.high_m && near
        } else {
            speed < config.slow_mps && height < config.low_m
        }
    }

    /// Length of the slope of the recent places over time, m/s.
    fn speed(&self) -> Option<f64> {
        let (first, _) = self.recent.first()?;
        let count = self.recent.len() as f64;
        if self.recent.len() < 3 {
            return None;
        }
        let (mut time, mut place) = (0.0, Vector3::zeros());
        for (at, seen) in &self.recent {
            time += at.since_seconds(*first) / count;
            place += seen / count;
        }
        let (mut spread, mut slope) = (0.0, Vector3::zeros());
        for (at, seen) in &self.recent {
            let off = at.since_seconds(*first) - time;
            spread += off * off;
            slope += (seen - place) * off;
        }
        (spread > 1e-9).then(|| slope.norm() / spread)
    }
}
