//! Watches whether the sensors still stand where the calibration put them.
//!
//! Each sensor is held against the fusion of the *others* (`rows`), over the last seconds, and beyond what is usual for it
//! at the places where people are (`baseline`). What is left is read as a rigid motion of the sensor (`motion`). When one
//! sensor moves, the others disagree with it, too, so that the sensor is named whose motion explains the most, and the
//! others are held against it as put right (`blame`).
//!
//! Pure: comparisons and time in, findings out. Room axes, metres and radians.

mod baseline;
mod blame;
mod motion;
mod rows;

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector3;
use posefuse_skeleton::{Comparison, Room, Sensor, SensorId, SensorPose, Timestamp, Transform};
use serde::{Deserialize, Serialize};

use baseline::Baseline;
use blame::Finding;
use rows::{Place, Rows, rows};

/// When a sensor counts as moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DriftOptions {
    /// A sensor that has been shifted by so much is to be named, metres.
    pub alarm_m: f64,
    /// The same for a turn, radians.
    pub alarm_rad: f64,
    /// Comparisons of so many seconds are looked at together.
    pub window_s: f64,
}

impl Default for DriftOptions {
    fn default() -> Self {
        Self {
            alarm_m: 0.02,
            alarm_rad: 1_f64.to_radians(),
            window_s: 10.0,
        }
    }
}

/// One sensor against the others, as of the last look.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorDrift {
    /// Which sensor.
    pub sensor: SensorId,
    /// Median distance of its joints to the other sensors', metres.
    pub residual_m: f64,
    /// What that was after the calibration.
    pub usual_m: f64,
    /// How far it seems to have been shifted since, metres. While people stand still this and the turn are hard to tell
    /// apart.
    pub moved_m: f64,
    /// How far it seems to have been turned since, radians.
    pub turned_rad: f64,
    /// Standard deviation of the shift: root of its covariance's trace, metres.
    pub sigma_m: f64,
    /// The same of the turn, radians.
    pub sigma_rad: f64,
    /// How far off what it sees is by that where people are, RMS, metres.
    pub off_m: f64,
    /// That in standard deviations.
    pub significance: f64,
    /// It has moved: to be calibrated anew.
    pub alarm: bool,
    /// When the look came that first found it moved; it was moved within the window before.
    pub since: Option<Timestamp>,
    /// Nobody can tell whether this sensor has moved or that one.
    pub instead: Option<SensorId>,
}

/// Where a sensor is taken to stand.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stand {
    room_from_sensor: Transform<Room, Sensor>,
    origin: Vector3<f64>,
}

/// What is remembered of one sensor.
#[derive(Clone, Debug, Default)]
struct Watched {
    baseline: Baseline,
    usual: Usual,
    alarm: bool,
    /// Looks in a row that found it moved, and not.
    over: u32,
    calm: u32,
    since: Option<Timestamp>,
    instead: Option<SensorId>,
}

/// The watch over a room's sensors. Memory is bounded: the window's comparisons, some hundred places per sensor.
#[derive(Clone, Debug, Default)]
pub struct DriftMonitor {
    options: DriftOptions,
    stands: BTreeMap<SensorId, Stand>,
    watched: BTreeMap<SensorId, Watched>,
    window: VecDeque<Comparison>,
    /// Nothing is learnt while something may have moved.
    suspicious: bool,
}

/// Most comparisons of a window: beyond, the oldest go early.
const MAX_WINDOW: usize = 1024;
/// Fewest comparisons of a sensor in the window for a finding.
const MIN_COMPARISONS: usize = 15;
/// Looks in a row until an alarm, and until it ends.
const LOOKS_TO_ALARM: u32 = 2;
const LOOKS_TO_CALM: u32 = 15;

impl DriftMonitor {
    /// A monitor that knows of no sensor.
    pub fn new(options: DriftOptions) -> Self {
        Self {
            options,
            ..Self::default()
        }
    }

    /// These sensors stand there from now on. If one that was known stands elsewhere, or is gone, everything is learnt anew:
    /// each was held against all others.
    pub fn place<'a>(&mut self, poses: impl IntoIterator<Item = (SensorId, &'a SensorPose)>) {
        let stands: BTreeMap<SensorId, Stand> = poses
            .into_iter()
            .filter(|(_, pose)| pose.room_from_sensor.is_finite())
            .map(|(sensor, pose)| {
                let room_from_sensor = pose.room_from_sensor;
                let origin = room_from_sensor.origin().vector();
                let stand = Stand {
                    room_from_sensor,
                    origin,
                };
                (sensor, stand)
            })
            .collect();
        let stays = |(sensor, stand): (&SensorId, &Stand)| stands.get(sensor) == Some(stand);
        if !self.stands.iter().all(stays) {
            *self = Self::new(self.options);
        }
        self.stands = stands;
    }

    /// Takes in what sensors saw of one person.
    pub fn add(&mut self, mut comparison: Comparison) {
        // Sums depend on their order by the last bit, and that can decide a look.
        comparison.views.sort_by_key(|view| view.sensor);
        if self.window.len() == MAX_WINDOW {
            self.window.pop_front();
        }
        self.window.push_back(comparison);
    }

    /// What can be said of each sensor now; nothing of those that saw too little in the last seconds. Meant for once a second:
    /// an alarm takes two looks that agree.
    pub fn look(&mut self, now: Timestamp) -> Vec<SensorDrift> {
        self.forget_before(now.plus_ns(-(self.options.window_s * 1e9) as i64));
        let findings = self.blame();
        let thresholds = self.thresholds();
        self.suspicious = findings.values().any(|f| f.is_suspicious(&thresholds));
        let mut drifts = Vec::with_capacity(findings.len());
        for (sensor, finding) in findings {
            let watched = self.watched.entry(sensor).or_default();
            watched.decide(now, &finding, &thresholds);
            drifts.push(watched.drift(sensor, &finding));
        }
        drifts
    }

    /// What leaves the window is what is usual, unless something may have moved.
    fn forget_before(&mut self, start: Timestamp) {
        let mut learnt = false;
        while self.window.front().is_some_and(|c| c.time < start) {
            let Some(comparison) = self.window.pop_front() else {
                break;
            };
            if self.suspicious || self.watched.values().any(|w| w.alarm) {
                continue;
            }
            if let Some((place, rows)) = rows(&comparison, &self.stands, &BTreeMap::new()) {
                rows.iter().for_each(|rows| self.learn(place, rows));
                learnt = true;
            }
        }
        if learnt {
            self.watched.values_mut().for_each(|w| w.baseline.settle());
        }
    }

    fn learn(&mut self, place: Place, rows: &Rows) {
        let watched = self.watched.entry(rows.sensor).or_default();
        watched.baseline.learn(place, &rows.stats);
        watched.usual.learn(&rows.distances);
    }
}

impl Watched {
    fn decide(&mut self, now: Timestamp, finding: &Finding, thresholds: &blame::Thresholds) {
        let moved = finding.is_moved(thresholds);
        self.over = if moved { self.over + 1 } else { 0 };
        if self.over == 1 && !self.alarm {
            self.since = Some(now);
        }
        self.calm = if finding.is_calm(thresholds) {
            self.calm + 1
        } else {
            0
        };
        if self.over >= LOOKS_TO_ALARM {
            self.alarm = true;
            self.instead = finding.instead;
        } else if self.calm >= LOOKS_TO_CALM {
            self.alarm = false;
            self.instead = None;
        }
    }

    fn drift(&self, sensor: SensorId, finding: &Finding) -> SensorDrift {
        let estimate = &finding.estimate;
        let [sigma_rad, sigma_m] = motion::sigmas(&estimate.covariance);
        SensorDrift {
            sensor,
            residual_m: finding.residual_m,
            usual_m: self.usual.median_m().unwrap_or(finding.residual_m),
            moved_m: estimate.motion.shift().norm(),
            turned_rad: estimate.motion.turn().norm(),
            sigma_m,
            sigma_rad,
            off_m: finding.off_m,
            significance: estimate.chi2.sqrt(),
            alarm: self.alarm,
            since: self.since.filter(|_| self.alarm),
            instead: self.instead,
        }
    }
}

/// A sensor's usual median distance, from a histogram of millimetres.
#[derive(Clone, Debug)]
struct Usual {
    counts: Vec<u32>,
    total: u32,
}

impl Default for Usual {
    fn default() -> Self {
        Self {
            counts: vec![0; Self::BINS],
            total: 0,
        }
    }
}

impl Usual {
    const BINS: usize = 256;
    /// Distances learnt: some three minutes of one person.
    const ENOUGH: u32 = 15_000;

    fn learn(&mut self, distances_m: &[f64]) {
        if self.total >= Self::ENOUGH {
            return;
        }
        for distance_m in distances_m {
            let bin = ((distance_m * 1e3) as usize).min(Self::BINS - 1);
            self.counts[bin] += 1;
            self.total += 1;
        }
    }

    fn median_m(&self) -> Option<f64> {
        let mut below = 0;
        let bin = self.counts.iter().position(|count| {
            below += count;
            below * 2 > self.total
        })?;
        Some((bin as f64 + 0.5) * 1e-3)
    }
}
