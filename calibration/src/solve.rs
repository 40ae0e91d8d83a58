//! From a walk to a calibration with its report.

use crate::{CalibrationError, Options, Solution, Walk};

/// Finds where every sensor of `walk` stands, and says how far the answer can be trusted.
///
/// Deterministic, and independent of the order of the sensors. An answer that cannot be trusted is still an
/// answer, with the verdict [`Failed`](crate::Verdict::Failed); an error means that there is none.
pub fn solve(walk: &Walk, options: &Options) -> Result<Solution, CalibrationError> {
    let _ = options;
    Err(CalibrationError::TooFewSensors(walk.sensors.len()))
}
