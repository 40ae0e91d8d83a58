//! One agent's clock against the server's, from answered probes.
//!
//! A probe gives an offset (server minus agent) and a hard bound: half its round trip. Bounds widen with age by
//! the largest drift two clocks may have; the true offset lies where all of them overlap. Within that overlap the
//! estimate is a least-squares line through the probes, those with the least delay weighing most. An answer
//! that fits no overlap is a step of the clock, believed once the next one confirms it.

mod fit;
mod probe;

use std::collections::VecDeque;

use posefuse_skeleton::{AgentTime, Timestamp};
use serde::{Deserialize, Serialize};

use crate::ClockSample;
use crate::config::{ClockConfig, ms_to_ns, seconds_to_ns};
use fit::{Line, fit};
use probe::Probe;

/// Most probes remembered.
const MAX_PROBES: usize = 128;
/// Most contradicting probes remembered.
const MAX_CANDIDATES: usize = 8;
/// Agreeing contradictions that prove a step too small to hold frames back for.
const SMALL_STEP_VOTES: usize = 4;
/// Latencies remembered to know what is usual.
const MAX_LATENCIES: usize = 16;
/// Stamps are rounded and queued for at least this long, ns.
const SLACK_NS: i64 = 200_000;

/// What is known of an agent's clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClockEstimate {
    /// Added to a present agent time gives server time, ns.
    pub offset_ns: i64,
    /// The offset is off by at most this, ns.
    pub error_ns: i64,
    /// How much faster the server's clock runs than the agent's, parts per million; 0 until it is known.
    pub drift_ppm: f64,
    /// Probes behind it.
    pub samples: usize,
    /// Shortest round trip among them, ns.
    pub min_round_trip_ns: i64,
    /// How often the clock was seen to step.
    pub steps: u64,
    /// The latest sign contradicts the estimate: frames are held back until it is settled.
    pub suspect: bool,
}

/// What an agent's frame time means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mapped {
    /// Captured then, in the server's clock.
    At(Timestamp),
    /// No probe was answered yet.
    Unknown,
    /// The clock has stepped, or may have.
    Stepped,
}

/// Follows one agent's clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClockFilter {
    probes: VecDeque<Probe>,
    candidates: VecDeque<Probe>,
    line: Option<Line>,
    suspect: bool,
    steps: u64,
    refused: u64,
    latencies: VecDeque<i64>,
    /// Since when frames have been held back for coming faster than the road allows.
    too_fast_since: Option<Timestamp>,
}

impl ClockFilter {
    /// Takes an answered probe. One that contradicts itself is counted and not used.
    pub(crate) fn add(&mut self, sample: &ClockSample, config: &ClockConfig) {
        // An answer may come twice: one that contradicts must not confirm itself.
        let newest = self.probes.back().into_iter().chain(self.candidates.back());
        let newest_ns = newest.map(|newest| newest.at_ns).max();
        let probe = Probe::new(sample).filter(|p| newest_ns.is_none_or(|newest| p.at_ns > newest));
        let Some(probe) = probe else {
            self.refused += 1;
            return;
        };
        match self.disagreement_ns(&probe, config) {
            0 => self.agree(probe, config),
            off_ns => self.contradict(probe, off_ns, config),
        }
    }

    /// The agent time in the server's clock.
    pub(crate) fn map(&self, time: AgentTime) -> Option<Timestamp> {
        Some(self.line.as_ref()?.map(time))
    }

    /// What a frame captured at `captured` and received at `received` is to be stamped with.
    pub(crate) fn map_frame(
        &mut self,
        captured: AgentTime,
        received: Timestamp,
        config: &ClockConfig,
    ) -> Mapped {
        let Some(line) = &self.line else {
            return Mapped::Unknown;
        };
        if self.suspect {
            return Mapped::Stepped;
        }
        let at = line.map(captured);
        let latency_ns = received.since_ns(at);
        let tolerance_ns = line
            .error_ns(received.ns(), config)
            .saturating_add(10_000_000);
        if latency_ns < -tolerance_ns {
            return Mapped::Stepped;
        }
        // Nothing arrives much faster than it ever did, unless its stamp is false.
        let usual = self.latencies.iter().min();
        if usual.is_some_and(|usual| latency_ns < usual.saturating_sub(ms_to_ns(config.step_ms))) {
            self.too_fast_since.get_or_insert(received);
            return Mapped::Stepped;
        }
        if self.latencies.len() == MAX_LATENCIES {
            self.latencies.pop_front();
        }
        self.latencies.push_back(latency_ns);
        Mapped::At(at.min(received))
    }

    /// What is known at `now`.
    pub(crate) fn estimate(&self, now: Timestamp, config: &ClockConfig) -> Option<ClockEstimate> {
        let line = self.line.as_ref()?;
        Some(ClockEstimate {
            offset_ns: line.offset_at_ns(now.ns()),
            error_ns: line.error_ns(now.ns(), config),
            drift_ppm: line.drift * 1e6,
            samples: self.probes.len(),
            min_round_trip_ns: self.probes.iter().map(|p| 2 * p.half_ns).min().unwrap_or(0),
            steps: self.steps,
            suspect: self.suspect,
        })
    }

    /// The answered probes still remembered, oldest first.
    pub(crate) fn samples(&self) -> impl Iterator<Item = &ClockSample> {
        self.probes.iter().map(|probe| &probe.sample)
    }

    /// Probe answers that contradicted themselves or came in the wrong order.
    pub(crate) fn refused(&self) -> u64 {
        self.refused
    }

    /// How far `probe` is from anything the remembered ones allow, ns; 0 if it fits.
    fn disagreement_ns(&self, probe: &Probe, config: &ClockConfig) -> i64 {
        let Some((low, high)) = fit::overlap(self.probes.iter(), probe.at_ns, config) else {
            return 0;
        };
        let (own_low, own_high) = probe.interval(probe.at_ns, config);
        let gap = own_low
            .saturating_sub(high)
            .max(low.saturating_sub(own_high));
        (gap - SLACK_NS).max(0)
    }

    fn agree(&mut self, probe: Probe, config: &ClockConfig) {
        self.candidates.clear();
        self.suspect = false;
        let sent = probe.sample.sent;
        let oldest_ns = probe.at_ns.saturating_sub(seconds_to_ns(config.window_s));
        self.probes.push_back(probe);
        while self.probes.len() > MAX_PROBES
            || self.probes.front().is_some_and(|p| p.at_ns < oldest_ns)
        {
            self.probes.pop_front();
        }
        // The clock is right, so what came too fast came over a faster road.
        if self.too_fast_since.is_some_and(|since| sent >= since) {
            self.latencies.clear();
            self.too_fast_since = None;
        }
        self.line = fit(&mut self.probes, config);
    }

    fn contradict(&mut self, probe: Probe, off_ns: i64, config: &ClockConfig) {
        let agrees = |known: &Probe| {
            let (low, high) = known.interval(probe.at_ns, config);
            let (own_low, own_high) = probe.interval(probe.at_ns, config);
            own_low <= high.saturating_add(SLACK_NS) && low <= own_high.saturating_add(SLACK_NS)
        };
        self.candidates.retain(agrees);
        if self.candidates.len() == MAX_CANDIDATES {
            self.candidates.pop_front();
        }
        self.candidates.push_back(probe);
        let large = off_ns >= ms_to_ns(config.step_ms);
        self.suspect |= large;
        let votes = if large { 2 } else { SMALL_STEP_VOTES };
        if self.candidates.len() >= votes {
            self.probes = std::mem::take(&mut self.candidates);
            self.latencies.clear();
            self.too_fast_since = None;
            self.suspect = false;
            self.steps += 1;
            self.line = fit(&mut self.probes, config);
        }
    }
}

#[cfg(test)]
mod tests;
