//! How far a sensor is off the others while it stands where the calibration put it: what a motion is told from.
//!
//! Trackers err by where a person stands and faces, so that a sensor is never quite where the others have it: a rigid
//! part that is the same everywhere (the calibration's own error), and a shift of each place.

use std::collections::BTreeMap;

use nalgebra::{Matrix6, Vector3};
use serde::{Deserialize, Serialize};

use super::motion::{Motion, Stats, diagonal};
use super::rows::Place;

/// What a calibration is believed to be off by, standard deviations.
const OFF_RAD: f64 = 0.005;
const OFF_M: f64 = 0.010;
/// Standard deviation of a place's own shift, metres: what a tracker's bias changes by as people move and turn.
const PLACE_M: f64 = 0.008;
/// The same between two visits of a place that is known.
const VISIT_M: f64 = 0.0025;
/// Places kept for a sensor, and how much is learnt of one: 1/m^2, as from some 30 s there.
const MAX_PLACES: usize = 512;
const ENOUGH: f64 = 2.0e6;

/// A sensor's usual error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Baseline {
    places: BTreeMap<Place, Stats>,
    rigid: Motion,
    covariance: Option<Matrix6<f64>>,
    /// Comparisons learnt.
    pub(super) learnt: u64,
}

impl Baseline {
    /// Takes in what was seen at `place` while the sensor stood still.
    pub(super) fn learn(&mut self, place: Place, stats: &Stats) {
        self.learnt += 1;
        let is_full = self.places.len() >= MAX_PLACES;
        if is_full && !self.places.contains_key(&place) {
            return;
        }
        let known = self.places.entry(place).or_default();
        if known.weight() < ENOUGH {
            known.join(stats, 1.0);
        }
    }

    /// Finds the rigid part anew.
    pub(super) fn settle(&mut self) {
        let mut sum = Stats {
            h: diagonal(OFF_RAD, OFF_M),
            ..Stats::default()
        };
        for stats in self.places.values() {
            sum.join(stats, share(stats, PLACE_M));
        }
        let covariance = sum.h.try_inverse();
        self.rigid = Motion(covariance.map_or_else(Default::default, |c| c * sum.g));
        self.covariance = covariance;
    }

    /// What is not known of the rigid part.
    pub(super) fn covariance(&self) -> Matrix6<f64> {
        let nothing = || diagonal(OFF_RAD.recip(), OFF_M.recip());
        self.covariance.unwrap_or_else(nothing)
    }

    /// `seen`, by place, beyond what is usual: a place counts the less, the less its own shift is known.
    pub(super) fn beyond(&self, seen: &BTreeMap<Place, Stats>) -> Stats {
        let mut sum = Stats::default();
        for (place, stats) in seen {
            let (shift, sigma_m) = self.shift_of(place);
            let beyond = stats.after(&self.rigid, &shift);
            sum.join(&beyond, share(stats, sigma_m));
        }
        sum
    }

    /// The usual shift of a place beyond the rigid part, and its standard deviation, metres.
    fn shift_of(&self, place: &Place) -> (Vector3<f64>, f64) {
        let Some(stats) = self.places.get(place) else {
            return (Vector3::zeros(), PLACE_M);
        };
        let rest = stats.after(&self.rigid, &Vector3::zeros());
        let (weight, prior) = (stats.weight(), PLACE_M.powi(-2));
        let shift = rest.mean() * (weight / (weight + prior));
        let sigma = ((weight + prior).recip() + VISIT_M * VISIT_M).sqrt();
        (shift, sigma)
    }
}

/// By how much the sums of one place count less when they have an error in common.
fn share(stats: &Stats, common_m: f64) -> f64 {
    (1.0 + stats.weight() * common_m * common_m).recip()
}
