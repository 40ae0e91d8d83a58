//! One answered probe as an offset with a hard bound.

use serde::{Deserialize, Serialize};

use crate::ClockSample;
use crate::config::ClockConfig;

/// Answers slower than this say nothing, ns.
const MAX_ROUND_TRIP_NS: i64 = 10_000_000_000;
/// Rounding of stamps may make a round trip look this much shorter than nothing, ns.
const ROUNDING_NS: i64 = 1_000_000;

/// Offset of one answered probe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Probe {
    /// The stamps themselves, to hand on.
    pub(super) sample: ClockSample,
    /// Middle of the exchange, server clock.
    pub(super) at_ns: i64,
    /// Server minus agent.
    pub(super) offset_ns: i64,
    /// The offset is off by at most this.
    pub(super) half_ns: i64,
}

impl Probe {
    /// `None` where the stamps contradict themselves.
    pub(super) fn new(sample: &ClockSample) -> Option<Self> {
        let away = i128::from(sample.returned.ns()) - i128::from(sample.sent.ns());
        let inside = i128::from(sample.agent_sent.ns()) - i128::from(sample.agent_received.ns());
        let trip = away - inside;
        let plausible = away >= 0
            && inside >= 0
            && trip >= -i128::from(ROUNDING_NS)
            && away <= i128::from(MAX_ROUND_TRIP_NS);
        if !plausible {
            return None;
        }
        let server_twice = i128::from(sample.sent.ns()) + i128::from(sample.returned.ns());
        let agent_twice =
            i128::from(sample.agent_received.ns()) + i128::from(sample.agent_sent.ns());
        Some(Self {
            sample: *sample,
            at_ns: i64::try_from(server_twice.div_euclid(2)).ok()?,
            offset_ns: i64::try_from((server_twice - agent_twice).div_euclid(2)).ok()?,
            half_ns: i64::try_from(trip.max(0) / 2 + 1).ok()?,
        })
    }

    /// Lowest and highest offset this probe allows at server time `at_ns`, ns.
    pub(super) fn interval(&self, at_ns: i64, config: &ClockConfig) -> (i64, i64) {
        let wide = self
            .half_ns
            .saturating_add(drifted_ns(at_ns.saturating_sub(self.at_ns), config));
        (
            self.offset_ns.saturating_sub(wide),
            self.offset_ns.saturating_add(wide),
        )
    }
}

/// How far two clocks may drift apart in `elapsed_ns`, ns.
pub(super) fn drifted_ns(elapsed_ns: i64, config: &ClockConfig) -> i64 {
    (elapsed_ns.unsigned_abs() as f64 * config.max_drift_ppm * 1e-6) as i64
}
