//! Holt's double exponential smoothing over one joint: a place and a trend, the trend per second so that uneven
//! frame times do no harm.

use nalgebra::Vector3;
use posefuse_skeleton::Timestamp;
use serde::{Deserialize, Serialize};

use super::JointFilter;

/// The filter and its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Holt {
    alpha: f64,
    gamma: f64,
    last: Option<Last>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Last {
    time: Timestamp,
    position: Vector3<f64>,
    trend: Vector3<f64>,
}

impl Holt {
    pub(super) fn new(alpha: f64, gamma: f64) -> Self {
        Self {
            alpha,
            gamma,
            last: None,
        }
    }

    pub(super) fn restart(&mut self) {
        self.last = None;
    }
}

impl JointFilter for Holt {
    fn push(&mut self, time: Timestamp, raw: Vector3<f64>) -> Option<(Timestamp, Vector3<f64>)> {
        let elapsed_s = self.last.map_or(0.0, |last| time.since_seconds(last.time));
        let next = match self.last {
            Some(last) if elapsed_s > 0.0 => {
                let position = (last.position + last.trend * elapsed_s).lerp(&raw, self.alpha);
                let trend = last
                    .trend
                    .lerp(&((position - last.position) / elapsed_s), self.gamma);
                Last {
                    time,
                    position,
                    trend,
                }
            }
            _ => Last {
                time,
                position: raw,
                trend: Vector3::zeros(),
            },
        };
        self.last = Some(next);
        Some((time, next.position))
    }
}
