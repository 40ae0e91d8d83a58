//! A bone's length as a running median: robust, and nothing to be kept.

use serde::{Deserialize, Serialize};

/// First and last step of the running median, metres.
const FIRST_STEP_M: f64 = 0.06;
const LAST_STEP_M: f64 = 0.0005;
/// Measurements before a length is used.
const MIN_MEASURED: u32 = 30;
/// After so many a length is as well known as it will be.
const SETTLED: f64 = 300.0;
/// No bone of a person is longer, metres.
const MAX_BONE_M: f64 = 0.9;

/// A running median.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Length {
    median_m: f64,
    measured: u32,
}

impl Length {
    /// Takes one measurement; what no bone can be is left out.
    pub(crate) fn learn(&mut self, length_m: f64) {
        if length_m >= MAX_BONE_M {
            return;
        }
        if self.measured == 0 {
            self.median_m = length_m;
        } else {
            let step = (FIRST_STEP_M / f64::from(self.measured)).max(LAST_STEP_M);
            let error = length_m - self.median_m;
            self.median_m += error.clamp(-step, step);
        }
        self.measured = self.measured.saturating_add(1);
    }

    /// How much of what can be known of it is known, 0..=1.
    pub(crate) fn settled(&self) -> f64 {
        (f64::from(self.measured) / SETTLED).min(1.0)
    }

    /// The length, metres, once it was measured often enough.
    pub(crate) fn known(&self) -> Option<f64> {
        (self.measured >= MIN_MEASURED).then_some(self.median_m)
    }
}
