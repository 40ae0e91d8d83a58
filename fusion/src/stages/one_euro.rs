//! One-Euro over one joint (Casiez, Roussel and Vogel, "1 EUR filter", CHI 2012), with one cut-off for all three
//! axes from the speed's magnitude, so that it does not depend on where the room's axes point.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use posefuse_skeleton::Timestamp;
use serde::{Deserialize, Serialize};

use super::JointFilter;

/// Cut-off of the speed estimate, Hz.
const SPEED_CUTOFF_HZ: f64 = 1.0;

/// The filter and its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct OneEuro {
    min_cutoff_hz: f64,
    beta: f64,
    last: Option<Last>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Last {
    time: Timestamp,
    raw: Vector3<f64>,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl OneEuro {
    pub(super) fn new(min_cutoff_hz: f64, beta: f64) -> Self {
        Self {
            min_cutoff_hz,
            beta,
            last: None,
        }
    }

    pub(super) fn restart(&mut self) {
        self.last = None;
    }

    fn next(&self, time: Timestamp, raw: Vector3<f64>) -> Last {
        let start = Last {
            time,
            raw,
            position: raw,
            velocity: Vector3::zeros(),
        };
        let Some(last) = self.last else {
            return start;
        };
        let elapsed_s = time.since_seconds(last.time);
        if elapsed_s <= 0.0 {
            return start;
        }
        let velocity = last.velocity.lerp(
            &((raw - last.raw) / elapsed_s),
            gain(SPEED_CUTOFF_HZ, elapsed_s),
        );
        let cutoff_hz = self.min_cutoff_hz + self.beta * velocity.norm();
        Last {
            time,
            raw,
            position: last.position.lerp(&raw, gain(cutoff_hz, elapsed_s)),
            velocity,
        }
    }
}

impl JointFilter for OneEuro {
    fn push(
        &mut self,
        time: Timestamp,
        position: Vector3<f64>,
    ) -> Option<(Timestamp, Vector3<f64>)> {
        let next = self.next(time, position);
        self.last = Some(next);
        Some((time, next.position))
    }
}

/// Weight of a new sample in a first-order low-pass.
fn gain(cutoff_hz: f64, elapsed_s: f64) -> f64 {
    let ratio = TAU * cutoff_hz * elapsed_s;
    ratio / (ratio + 1.0)
}
