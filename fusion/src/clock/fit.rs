//! Offset, drift and error bound from the remembered probes.

use std::collections::VecDeque;

use posefuse_skeleton::{AgentTime, Timestamp};
use serde::{Deserialize, Serialize};

use super::probe::{Probe, drifted_ns};
use crate::config::{ClockConfig, seconds_to_ns};

/// Probes a drift needs.
const MIN_FOR_DRIFT: usize = 8;
/// Spread of the offset of even the best probes, ns, and as a share of their delay.
const BEST_NS: f64 = 20_000.0;
const BEST_SHARE: f64 = 0.3;
/// Clocks drift by about this much before anything is measured; little evidence changes little.
const USUAL_DRIFT: f64 = 50e-6;
/// A drift is not applied over more than this, ns.
const MAX_SPAN_NS: i64 = 3_600_000_000_000;

/// Server time as a line over agent time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Line {
    /// Where `offset_ns` holds, server clock.
    at_ns: i64,
    /// Server minus agent there.
    offset_ns: i64,
    /// Bound of the offset there.
    bound_ns: i64,
    /// Growth of the offset per server time.
    pub(super) drift: f64,
}

impl Line {
    /// Server minus agent at server time `server_ns`.
    pub(super) fn offset_at_ns(&self, server_ns: i64) -> i64 {
        let elapsed = server_ns
            .saturating_sub(self.at_ns)
            .clamp(-MAX_SPAN_NS, MAX_SPAN_NS);
        self.offset_ns
            .saturating_add((self.drift * elapsed as f64).round() as i64)
    }

    /// The agent time in the server's clock.
    pub(super) fn map(&self, time: AgentTime) -> Timestamp {
        let roughly = time.ns().saturating_add(self.offset_ns);
        Timestamp::from_ns(time.ns().saturating_add(self.offset_at_ns(roughly)))
    }

    /// Bound of the offset at server time `server_ns`, ns.
    pub(super) fn error_ns(&self, server_ns: i64, config: &ClockConfig) -> i64 {
        // The line has some drift already; the true one may be as far on the other side.
        let elapsed = server_ns.saturating_sub(self.at_ns);
        let own = (elapsed.unsigned_abs() as f64 * self.drift.abs()) as i64;
        self.bound_ns
            .saturating_add(drifted_ns(elapsed, config))
            .saturating_add(own)
    }
}

/// Where all probes' intervals overlap at server time `at_ns`; low may exceed high. `None` without probes.
pub(super) fn overlap<'a>(
    probes: impl Iterator<Item = &'a Probe>,
    at_ns: i64,
    config: &ClockConfig,
) -> Option<(i64, i64)> {
    probes
        .map(|probe| probe.interval(at_ns, config))
        .reduce(|(low, high), (l, h)| (low.max(l), high.min(h)))
}

/// The line at the newest probe. Drops the oldest probes while they contradict the newer ones.
pub(super) fn fit(probes: &mut VecDeque<Probe>, config: &ClockConfig) -> Option<Line> {
    let at_ns = probes.back()?.at_ns;
    let (low, high) = loop {
        let (low, high) = overlap(probes.iter(), at_ns, config)?;
        if low <= high {
            break (low, high);
        }
        if probes.len() == 1 {
            break (high, low);
        }
        probes.pop_front();
    };
    let (offset_ns, drift) = regress(probes, at_ns, config);
    let offset_ns = offset_ns.clamp(low, high);
    let bound_ns = offset_ns
        .saturating_sub(low)
        .max(high.saturating_sub(offset_ns));
    Some(Line {
        at_ns,
        offset_ns,
        bound_ns,
        drift,
    })
}

/// Offset at `at_ns` and drift: weighted least squares, a probe counting less the longer it was under way.
fn regress(probes: &VecDeque<Probe>, at_ns: i64, config: &ClockConfig) -> (i64, f64) {
    let (Some(oldest), Some(newest)) = (probes.front(), probes.back()) else {
        return (0, 0.0);
    };
    let best_ns = probes.iter().map(|p| p.half_ns).min().unwrap_or(0);
    let with_drift = probes.len() >= MIN_FOR_DRIFT
        && at_ns.saturating_sub(oldest.at_ns) >= seconds_to_ns(config.slope_after_s);
    let (mut s, mut st, mut stt, mut so, mut sto) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for probe in probes {
        let age_ns = at_ns.saturating_sub(probe.at_ns);
        let mut sigma = BEST_NS + BEST_SHARE * best_ns as f64 + (probe.half_ns - best_ns) as f64;
        if !with_drift {
            sigma += drifted_ns(age_ns, config) as f64;
        }
        let weight = 1.0 / (sigma * sigma);
        let t = -(age_ns as f64);
        let o = probe.offset_ns.saturating_sub(newest.offset_ns) as f64;
        s += weight;
        st += weight * t;
        stt += weight * t * t;
        so += weight * o;
        sto += weight * t * o;
    }
    let limit = config.max_drift_ppm * 1e-6;
    let drift = if with_drift {
        let prior = 1.0 / (USUAL_DRIFT * USUAL_DRIFT);
        ((sto - st * so / s) / (stt - st * st / s + prior)).clamp(-limit, limit)
    } else {
        0.0
    };
    let offset = (so - drift * st) / s;
    (
        newest.offset_ns.saturating_add(offset.round() as i64),
        drift,
    )
}
