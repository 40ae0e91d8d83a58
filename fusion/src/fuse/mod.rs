//! Several sensors' sightings of one joint become one estimate.
//!
//! `average` and `weighted` are pure functions of the sightings, moved to the frame's time; [`kalman`] has a memory of
//! its own, which a track keeps, and takes each sample at its own time.

mod average;
pub(crate) mod kalman;
mod weighted;

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{Provenance, SensorId, SensorSet};

use crate::config::{FuseConfig, FuseMethod};

/// One joint as one sensor sees it at the frame's time, room frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sighting {
    pub(crate) sensor: SensorId,
    /// Metres.
    pub(crate) position: Vector3<f64>,
    /// 0..=1.
    pub(crate) confidence: f64,
    /// Where the sensor stands, metres.
    pub(crate) origin: Vector3<f64>,
    /// How far the sample was moved in time, seconds, never negative.
    pub(crate) age_s: f64,
}

/// What the sensors say together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fused {
    pub(crate) position: Vector3<f64>,
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) confidence: f64,
    pub(crate) provenance: Provenance,
}

/// What the sightings say by themselves, by a method without a memory; `None` without sightings.
pub(crate) fn fuse(sightings: &[Sighting], config: &FuseConfig) -> Option<Fused> {
    match config.method {
        FuseMethod::Average => average::average(sightings, config.min_confidence),
        FuseMethod::Weighted | FuseMethod::Kalman => {
            weighted::weighted(sightings, config.min_confidence)
        }
    }
}

/// Measured by those who trust their sighting, else predicted from all.
fn provenance(sightings: &[Sighting], trusted: f64) -> Provenance {
    let all: SensorSet = sightings.iter().map(|s| s.sensor).collect();
    let sure: SensorSet = sightings
        .iter()
        .filter(|s| s.confidence >= trusted)
        .map(|s| s.sensor)
        .collect();
    if sure.is_empty() {
        Provenance::Predicted(all)
    } else {
        Provenance::Measured(sure)
    }
}

#[cfg(test)]
mod tests;
