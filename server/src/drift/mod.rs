//! Whether the sensors still stand where the calibration has them, and one sensor calibrated anew from what was seen of
//! late.
//!
//! The fusion thread offers what it sees to a bounded queue (`tap`) and never waits; a task of its own (`watch`) owns the
//! monitor and keeps each sensor's last minute (`recent`). Sensors' places change only by `recalibrate`, on demand and
//! never while a take runs.

mod recalibrate;
mod recent;
mod tap;
mod watch;
mod words;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use posefuse_calibration::SensorDrift;
use posefuse_fusion::ConfigError;
use posefuse_proto::v1;
use posefuse_skeleton::SensorId;
use serde::{Deserialize, Serialize};

pub(crate) use recalibrate::recalibrate;
use recent::Recent;
pub(crate) use tap::{Seen, Tap};
pub(crate) use watch::watch;

/// When a sensor counts as moved. Section `[drift]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Whether sensors are held against each other at all.
    pub enabled: bool,
    /// A sensor shifted by so much is named, millimetres.
    pub alarm_mm: f64,
    /// A sensor turned by so much is named, degrees.
    pub alarm_deg: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            enabled: true,
            alarm_mm: 20.0,
            alarm_deg: 1.0,
        }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let numbers = [
            ("drift.alarm_mm", self.alarm_mm, 10.0, 1000.0),
            ("drift.alarm_deg", self.alarm_deg, 0.5, 45.0),
        ];
        for (key, found, low, high) in numbers {
            if !(low..=high).contains(&found) {
                return Err(ConfigError::Value {
                    key: key.to_owned(),
                    expected: format!("a number from {low} to {high}, found {found}"),
                });
            }
        }
        Ok(())
    }
}

/// What the watch has found, for the rest of the server.
#[derive(Debug, Default)]
pub(crate) struct Drift {
    found: Mutex<BTreeMap<SensorId, SensorDrift>>,
    recent: Mutex<Recent>,
}

impl Drift {
    /// The latest finding for `sensor`; `None`: nothing can be said.
    pub(crate) fn of(&self, sensor: SensorId) -> Option<SensorDrift> {
        lock(&self.found).get(&sensor).copied()
    }

    /// Takes in new findings. An alarm stands until something better is known, also when everybody has left.
    fn set(&self, found: &[SensorDrift]) {
        let mut known = lock(&self.found);
        known.retain(|_, drift| drift.alarm);
        known.extend(found.iter().map(|drift| (drift.sensor, *drift)));
    }

    /// Forgets all findings: the sensors stand elsewhere now.
    fn forget(&self) {
        lock(&self.found).clear();
    }

    fn recent(&self) -> MutexGuard<'_, Recent> {
        lock(&self.recent)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A finding as the wire says it.
pub(crate) fn to_wire(drift: &SensorDrift) -> v1::Drift {
    v1::Drift {
        residual_mm: drift.residual_m * 1e3,
        usual_mm: drift.usual_m * 1e3,
        moved_mm: drift.moved_m * 1e3,
        moved_deg: drift.turned_rad.to_degrees(),
        moved_sigma_mm: drift.sigma_m * 1e3,
        moved_sigma_deg: drift.sigma_rad.to_degrees(),
        alarm: drift.alarm,
    }
}

/// What is wrong with `sensor` and what to do; empty while it stands where it should.
pub(crate) fn trouble(
    drift: &Drift,
    sensor: SensorId,
    registry: &crate::ingest::Registry,
) -> String {
    match drift.of(sensor) {
        Some(found) if found.alarm => {
            words::trouble(&found, &registry.name(sensor), |other| registry.name(other))
        }
        _ => String::new(),
    }
}

/// The queue from the fusion thread: its two ends.
pub(crate) fn tap(config: &Config) -> (Tap, tokio::sync::mpsc::Receiver<Seen>) {
    tap::tap(config.enabled)
}

/// Counts of what the watch could not take in.
pub(crate) type Missed = Arc<std::sync::atomic::AtomicU64>;
