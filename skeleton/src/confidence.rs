//! How much a tracker trusts a joint: a number in 0..=1, by construction.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A tracker's trust in one joint, 0 (none) to 1 (full). Never NaN.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f32", into = "f32")]
pub struct Confidence(f32);

/// The value was not a number between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("confidence must be a number between 0 and 1, found {0}")]
pub struct ConfidenceError(pub f32);

impl Confidence {
    /// No trust at all.
    pub const NONE: Self = Self(0.0);
    /// Full trust.
    pub const FULL: Self = Self(1.0);

    /// Checks that `value` lies in 0..=1.
    pub fn new(value: f32) -> Result<Self, ConfidenceError> {
        if (0.0..=1.0).contains(&value) {
            Ok(Self(value))
        } else {
            Err(ConfidenceError(value))
        }
    }

    /// The nearest valid confidence; NaN becomes [`Confidence::NONE`].
    pub fn saturating(value: f32) -> Self {
        if value.is_nan() {
            Self::NONE
        } else {
            Self(value.clamp(0.0, 1.0))
        }
    }

    /// The value, 0..=1.
    pub fn get(self) -> f32 {
        self.0
    }
}

impl TryFrom<f32> for Confidence {
    type Error = ConfidenceError;

    fn try_from(value: f32) -> Result<Self, Self::Error> {
        Self::new(value)
    }
}

impl From<Confidence> for f32 {
    fn from(confidence: Confidence) -> f32 {
        confidence.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_is_no_share() {
        for bad in [-0.01, 1.01, f32::NAN, f32::INFINITY] {
            assert!(Confidence::new(bad).is_err(), "{bad} was taken");
        }
        assert_eq!(Confidence::saturating(f32::NAN), Confidence::NONE);
        assert_eq!(Confidence::saturating(7.0), Confidence::FULL);
    }
}
