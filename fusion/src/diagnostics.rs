//! What the engine can say of each sensor.

use posefuse_skeleton::{SensorId, TrackId};
use serde::{Deserialize, Serialize};

use crate::clock::ClockEstimate;
use crate::ledger::Contribution;
use crate::{Engine, RejectionReason};

/// How many reasons there are.
pub(crate) const REASONS: usize = ALL_REASONS.len();

const ALL_REASONS: [RejectionReason; 11] = [
    RejectionReason::NonFinite,
    RejectionReason::Absurd,
    RejectionReason::Jumped,
    RejectionReason::OutOfOrder,
    RejectionReason::Repeated,
    RejectionReason::ClockStep,
    RejectionReason::ClockUnknown,
    RejectionReason::Uncalibrated,
    RejectionReason::UnknownSensor,
    RejectionReason::Late,
    RejectionReason::TooManyBodies,
];

pub(crate) fn reason_index(reason: RejectionReason) -> usize {
    reason as usize
}

/// One sensor's part in the result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorDiagnostics {
    /// Which sensor.
    pub sensor: SensorId,
    /// Whether the calibration in force knows it.
    pub calibrated: bool,
    /// Frames that came.
    pub frames: u64,
    /// Frames that went into fusing, whole or in part.
    pub used: u64,
    /// From capture to reception, running mean, ns; `None` before the first usable frame.
    pub latency_ns: Option<i64>,
    /// Median over the last 10 s of each frame's median joint distance to the fused person, metres.
    pub residual_m: Option<f64>,
    /// Its part in what was fused of late; `None` with a method that keeps no account of it (`average`, `weighted`),
    /// and while nothing was fused.
    pub contribution: Option<Contribution>,
    /// Frames and joints that were refused, by reason; reasons without a case are left out.
    pub rejected: Vec<(RejectionReason, u64)>,
    /// Clock probe answers that contradicted themselves.
    pub refused_probes: u64,
    /// The clock, once a probe was answered.
    pub clock: Option<ClockEstimate>,
}

/// How the labels of one sensor's body are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodyLabels {
    /// Which sensor.
    pub sensor: SensorId,
    /// The sensor's own id of the body.
    pub tracking_id: u64,
    /// Whose body it is; `None` while that is a candidate only.
    pub track: Option<TrackId>,
    /// Whether left and right of the arms (and shoulders), and of the legs (and hips), are exchanged in its latest
    /// sample.
    pub mirrored: [bool; 2],
}

impl Engine {
    /// How every body that a sensor follows is taken, in order of the tracks.
    pub fn labels(&self) -> Vec<BodyLabels> {
        self.state.people.labels().collect()
    }

    /// Every sensor's part in the result, in order of sensors.
    pub fn diagnostics(&self) -> Vec<SensorDiagnostics> {
        let known = self.state.sensors.iter().flatten();
        let ledgers = || self.state.sensors.iter().flatten().map(|s| &s.ledger);
        known
            .map(|sensor| SensorDiagnostics {
                sensor: sensor.info.id,
                calibrated: sensor.place.is_some(),
                frames: sensor.frames,
                used: sensor.used,
                latency_ns: sensor.latency_ns.map(|ns| ns as i64),
                residual_m: sensor.residual_m(),
                contribution: sensor.ledger.contribution(ledgers()),
                rejected: ALL_REASONS
                    .into_iter()
                    .map(|reason| (reason, sensor.rejected[reason_index(reason)]))
                    .filter(|(_, count)| *count > 0)
                    .collect(),
                refused_probes: sensor.clock.refused(),
                clock: self.clock(sensor.info.id),
            })
            .collect()
    }
}
