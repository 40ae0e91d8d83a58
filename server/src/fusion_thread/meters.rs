//! What the fusion thread measures of its own work and of each sensor.

use std::collections::VecDeque;

use posefuse_fusion::{
    ClockEstimate, Contribution, Engine, Input, Rejection, RejectionReason, SensorDiagnostics,
};
use posefuse_skeleton::{RoomFrame, SensorId, Timestamp};

use super::refusals::{Refusals, Unused};

/// Rates and medians are of the last two seconds.
pub(super) const WINDOW_NS: i64 = 2_000_000_000;
/// Times kept for a rate: more than two seconds of the fastest sensor.
pub(super) const MAX_TIMES: usize = 1024;
/// Samples kept for a median or percentile.
const MAX_SAMPLES: usize = 512;

/// The fusion thread's view, ten times a second.
#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshot {
    /// People in the latest frame.
    pub(crate) people: u32,
    /// Fused frames since the start, and per second.
    pub(crate) frames: u64,
    pub(crate) frames_per_second: f64,
    /// The thread's time per fused frame, microseconds.
    pub(crate) engine_us: f64,
    /// From the arrival of the newest observation behind a frame to its hand-over to the subscribers, milliseconds.
    pub(crate) latency_p50_ms: f64,
    pub(crate) latency_p99_ms: f64,
    /// By sensor number.
    pub(crate) sensors: Vec<SensorView>,
}

/// What the fusion thread knows of one sensor.
#[derive(Clone, Debug, Default)]
pub(crate) struct SensorView {
    pub(crate) frames_per_second: f64,
    /// From capture to arrival, milliseconds, median.
    pub(crate) latency_ms: Option<f64>,
    pub(crate) clock: Option<ClockEstimate>,
    pub(crate) residual_mm: Option<f64>,
    /// Its part in the fused people; `None` while nothing is fused.
    pub(crate) contribution: Option<Contribution>,
    /// Bodies in the latest frame.
    pub(crate) bodies: u32,
    /// What the engine refused, by reason.
    pub(crate) rejected: Vec<(RejectionReason, u64)>,
    /// Those of them that are `Uncalibrated` only because no calibration was in force yet.
    pub(crate) before_calibration: u64,
    /// Why most of its latest frames are not used, if that has gone on for a while.
    pub(crate) unused: Option<Unused>,
}

/// The running measurements.
#[derive(Debug, Default)]
pub(super) struct Meters {
    sensors: Vec<SensorMeter>,
    frame_times: VecDeque<Timestamp>,
    frames: u64,
    people: u32,
    newest_arrival: Option<Timestamp>,
    latencies_ns: Ring,
    worked_ns: i64,
    worked_frames: u32,
    engine_us: f64,
    calibrated: bool,
}

#[derive(Debug, Default)]
struct SensorMeter {
    times: VecDeque<Timestamp>,
    latencies_ns: Ring,
    bodies: u32,
    refusals: Refusals,
    before_calibration: u64,
}

/// The latest samples.
#[derive(Debug, Default)]
struct Ring(VecDeque<i64>);

impl Ring {
    fn push(&mut self, sample: i64) {
        if self.0.len() == MAX_SAMPLES {
            self.0.pop_front();
        }
        self.0.push_back(sample);
    }

    /// The sample below which `share` of them lie.
    fn quantile(&self, share: f64) -> Option<i64> {
        let mut sorted: Vec<i64> = self.0.iter().copied().collect();
        sorted.sort_unstable();
        let index = (share * sorted.len() as f64) as usize;
        sorted
            .get(index.min(sorted.len().saturating_sub(1)))
            .copied()
    }
}

impl Meters {
    fn sensor(&mut self, sensor: SensorId) -> &mut SensorMeter {
        if self.sensors.len() <= sensor.index() {
            self.sensors
                .resize_with(sensor.index() + 1, SensorMeter::default);
        }
        &mut self.sensors[sensor.index()]
    }

    pub(super) fn input(&mut self, input: &Input) {
        let observation = match input {
            Input::Observation(observation) => observation,
            Input::Calibration(_) => {
                self.calibrated = true;
                return;
            }
            _ => return,
        };
        self.newest_arrival = Some(observation.received);
        let meter = self.sensor(observation.sensor);
        remember(&mut meter.times, observation.received);
        meter.bodies = observation.bodies.len() as u32;
    }

    /// Something of a sensor was refused.
    pub(super) fn rejected(&mut self, rejection: &Rejection) {
        if rejection.joint.is_some() {
            return;
        }
        let is_early = !self.calibrated && rejection.reason == RejectionReason::Uncalibrated;
        let meter = self.sensor(rejection.sensor);
        meter.before_calibration += u64::from(is_early);
        meter.refusals.add(rejection.time, rejection.reason);
    }

    /// From capture to arrival.
    pub(super) fn latency(&mut self, sensor: SensorId, latency_ns: i64) {
        self.sensor(sensor).latencies_ns.push(latency_ns);
    }

    pub(super) fn frame(&mut self, frame: &RoomFrame, now: Timestamp) {
        self.frames += 1;
        self.people = frame.tracks.len() as u32;
        remember(&mut self.frame_times, now);
        if let Some(arrival) = self.newest_arrival {
            self.latencies_ns.push(now.since_ns(arrival));
        }
    }

    pub(super) fn worked(&mut self, before: Timestamp, after: Timestamp, frames: u32) {
        self.worked_ns += after.since_ns(before);
        self.worked_frames += frames;
    }

    /// The latest work per frame; work while nothing was fused belongs to no frame, and is forgotten.
    fn work_per_frame_us(&mut self) -> f64 {
        let (worked_ns, frames) = (
            std::mem::take(&mut self.worked_ns),
            std::mem::take(&mut self.worked_frames),
        );
        if frames > 0 {
            self.engine_us = worked_ns as f64 * 1e-3 / f64::from(frames);
        } else if self.frame_times.is_empty() {
            self.engine_us = 0.0;
        }
        self.engine_us
    }

    pub(super) fn snapshot(&mut self, engine: &Engine, now: Timestamp) -> Snapshot {
        let ms = |ns: Option<i64>| ns.map_or(0.0, |ns| ns as f64 * 1e-6);
        let diagnostics = engine.diagnostics();
        let view = |(index, meter): (usize, &mut SensorMeter)| {
            let found = diagnostics
                .iter()
                .find(|found| found.sensor.index() == index);
            let frames_per_second = rate(&mut meter.times, now);
            if frames_per_second == 0.0 {
                meter.latencies_ns.0.clear();
            }
            SensorView {
                frames_per_second,
                latency_ms: meter.latencies_ns.quantile(0.5).map(|ns| ns as f64 * 1e-6),
                clock: found.and_then(|found| found.clock),
                residual_mm: found.and_then(|found| Some(found.residual_m? * 1e3)),
                contribution: found.and_then(|found| found.contribution.clone()),
                bodies: meter.bodies,
                rejected: found.map_or_else(Vec::new, rejected),
                before_calibration: meter.before_calibration,
                unused: meter.refusals.main(meter.times.len(), now),
            }
        };
        let sensors = self.sensors.iter_mut().enumerate().map(view).collect();
        let frames_per_second = rate(&mut self.frame_times, now);
        let engine_us = self.work_per_frame_us();
        let is_silent = frames_per_second == 0.0;
        if is_silent {
            self.latencies_ns.0.clear();
        }
        Snapshot {
            people: if is_silent { 0 } else { self.people },
            frames: self.frames,
            frames_per_second,
            engine_us,
            latency_p50_ms: ms(self.latencies_ns.quantile(0.5)),
            latency_p99_ms: ms(self.latencies_ns.quantile(0.99)),
            sensors,
        }
    }
}

fn rejected(sensor: &SensorDiagnostics) -> Vec<(RejectionReason, u64)> {
    sensor.rejected.clone()
}

fn remember(times: &mut VecDeque<Timestamp>, time: Timestamp) {
    if times.len() == MAX_TIMES {
        times.pop_front();
    }
    times.push_back(time);
}

/// Events per second over the window, or since the first of them.
fn rate(times: &mut VecDeque<Timestamp>, now: Timestamp) -> f64 {
    let start = now.plus_ns(-WINDOW_NS);
    while times.front().is_some_and(|time| *time < start) {
        times.pop_front();
    }
    match (times.front(), times.back()) {
        (Some(first), Some(last)) if times.len() > 1 && last > first => {
            let spanned = (times.len() - 1) as f64 / last.since_seconds(*first);
            let window = times.len() as f64 / (WINDOW_NS as f64 * 1e-9);
            // While the window fills, what is in it spans less than it; once a source is silent, it thins out.
            let silent =
                now.since_ns(*last) > 2 * (last.since_ns(*first) / (times.len() as i64 - 1)).max(1);
            if silent { window.min(spanned) } else { spanned }
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_right_from_the_second_frame_on_and_falls_with_silence() {
        let mut times = VecDeque::new();
        let at = |i: i64| Timestamp::from_ns(i * 1_000_000_000 / 30);
        for i in 0..120 {
            remember(&mut times, at(i));
            let found = rate(&mut times, at(i));
            assert!(
                i == 0 || (29.9..=30.1).contains(&found),
                "{found} after {i}"
            );
        }
        let later = at(119).plus_ns(1_500_000_000);
        assert!(rate(&mut times, later) < 15.0);
        assert_eq!(rate(&mut times, at(119).plus_ns(2_100_000_000)), 0.0);
    }

    #[test]
    fn work_without_a_frame_belongs_to_no_frame() {
        let mut meters = Meters::default();
        let at = |ms: i64| Timestamp::from_ns(ms * 1_000_000);
        meters.worked(at(0), at(900), 0);
        assert_eq!(meters.work_per_frame_us(), 0.0);
        meters.worked(at(1000), at(1002), 1);
        meters.frame_times.push_back(at(1002));
        assert_eq!(meters.work_per_frame_us(), 2000.0);
        // Between two frames the last one's work still stands; after a silence there is none.
        assert_eq!(meters.work_per_frame_us(), 2000.0);
        meters.frame_times.clear();
        assert_eq!(meters.work_per_frame_us(), 0.0);
    }

    #[test]
    fn quantiles_are_of_the_latest_samples() {
        let mut ring = Ring::default();
        (0..10_000).for_each(|i| ring.push(i));
        assert_eq!(ring.0.len(), MAX_SAMPLES);
        let median = ring.quantile(0.5).unwrap();
        assert!(
            (median - (10_000 - MAX_SAMPLES as i64 / 2)).abs() <= 1,
            "{median}"
        );
        assert_eq!(Ring::default().quantile(0.5), None);
    }
}
