//! The figures of one or more runs, as people and scripts read them.

use std::collections::BTreeMap;

use posefuse_skeleton::Joint;
use serde::Serialize;

use crate::beside::RepairEffect;
use crate::histogram::Histogram;
use crate::tally::Tally;

/// How a distance is spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorSpread {
    /// Mean, mm: of joints the mean per-joint position error (MPJPE). `None` where there is nothing, as in all others.
    pub mean_mm: Option<f64>,
    /// Median, mm.
    pub median_mm: Option<f64>,
    /// 95th percentile, mm.
    pub p95_mm: Option<f64>,
    /// Root mean square, mm.
    pub rms_mm: Option<f64>,
    /// How many joints.
    pub joints: u64,
}

/// The figures of one or more runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// Distance of fused joints from where they truly are.
    pub error: ErrorSpread,
    /// Of joints that at least one sensor truly sees. Where nobody knows: that count as measured.
    pub error_visible: ErrorSpread,
    /// Of all others.
    pub error_occluded: ErrorSpread,
    /// The same three, from the truth displaced by the bias of the body, which no sensor can see.
    pub own_error: ErrorSpread,
    /// See `own_error`.
    pub own_error_visible: ErrorSpread,
    /// See `own_error`.
    pub own_error_occluded: ErrorSpread,
    /// Mean own error of each joint, mm.
    pub by_joint_mm: BTreeMap<&'static str, f64>,
    /// Share of the joints of followed people that were not fused at all.
    pub joints_missing: Option<f64>,
    /// By how much fused people trail behind their own time stamps, ms.
    pub lag_ms: Option<f64>,
    /// How long frames were held back to look ahead, ms.
    pub look_ahead_ms: Option<f64>,
    /// Root mean square of the acceleration of the error, m/s^2. Without truth: of what a fit over 0.4 s leaves.
    pub jitter_mps2: Option<f64>,
    /// Standard deviation of a bone's length, mean over bones and people, mm.
    pub bone_sigma_mm: Option<f64>,
    /// Menard's mean absolute difference of the wrists, cm.
    pub wrist_absolute_cm: Option<f64>,
    /// Menard's shortest distance of the wrists, cm.
    pub wrist_shortest_cm: Option<f64>,
    /// Times per minute and person that a joint jumps by more than 10 cm within four frames and should not.
    pub spikes_per_min: Option<f64>,
    /// Times per minute and person that a joint stays more than 20 cm off for a third of a second or longer.
    pub deviations_per_min: Option<f64>,
    /// How often a person's track was another one than before.
    pub id_switches: u64,
    /// Share of people in sight, over all frames, that no track follows.
    pub people_missed: Option<f64>,
    /// Share of tracks, over all frames, that follow nobody.
    pub tracks_extra: Option<f64>,
    /// Share of followed people, over all frames, whose left and right are right.
    pub sides_right: Option<f64>,
    /// Share of people's bodies in sensors' frames whose left and right, of arms and of legs, the engine took for
    /// exchanged exactly where they were; from the first frame on, as soon as somebody is followed.
    pub swaps_right: Option<f64>,
    /// Leave-one-sensor-out: how far a sensor's trusted joints are from what the other sensors make of them.
    pub left_out: ErrorSpread,
    /// The median of that for each sensor of each run, mean over them, mm.
    pub left_out_median_mm: Option<f64>,
    /// Share of a left-out sensor's bodies on whose left and right it and the others agree.
    pub left_out_sides: Option<f64>,
    /// The noise bound B of the rooms, root mean square, mm.
    pub noise_bound_mm: Option<f64>,
    /// Fused frames.
    pub frames: u64,
    /// Seconds that people were followed, all together.
    pub person_seconds: f64,
    /// What the engine needs for a fused frame, microseconds.
    pub engine_us_per_frame: Option<f64>,
    /// How many times faster than live it went.
    pub times_real_time: Option<f64>,
    /// What repair does, beside the same method without it.
    pub repair: Option<RepairEffect>,
}

impl From<&Tally> for Metrics {
    fn from(tally: &Tally) -> Self {
        let share = |part: u64, whole: u64| (whole > 0).then(|| part as f64 / whole as f64);
        let per_minute = |count: u64| {
            (tally.person_seconds > 0.0).then(|| count as f64 * 60.0 / tally.person_seconds)
        };
        let both = |a: &Histogram, b: &Histogram| {
            let mut all = a.clone();
            all.merge(b);
            spread(&all)
        };
        let scaled = |value: Option<f64>, by: f64| value.map(|value| value * by);
        let busy = (tally.busy_s > 0.0).then_some(tally.busy_s);
        Self {
            error: both(&tally.visible, &tally.occluded),
            error_visible: spread(&tally.visible),
            error_occluded: spread(&tally.occluded),
            own_error: both(&tally.own_visible, &tally.own_occluded),
            own_error_visible: spread(&tally.own_visible),
            own_error_occluded: spread(&tally.own_occluded),
            by_joint_mm: Joint::ALL
                .into_iter()
                .filter_map(|joint| {
                    let mean = tally.by_joint[joint as usize].mean()?;
                    Some((joint.name(), mean * 1e3))
                })
                .collect(),
            joints_missing: tally.joints.mean().map(|there| 1.0 - there),
            lag_ms: scaled(tally.lag.mean(), 1e3),
            look_ahead_ms: scaled(tally.look_ahead.mean(), 1e3),
            jitter_mps2: tally.jitter.mean().map(f64::sqrt),
            bone_sigma_mm: scaled(tally.bone_sigma.mean(), 1e3),
            wrist_absolute_cm: scaled(tally.wrist.mean(), 1e2),
            wrist_shortest_cm: scaled(tally.wrist_shortest.mean(), 1e2),
            spikes_per_min: per_minute(tally.spikes),
            deviations_per_min: per_minute(tally.deviations),
            id_switches: tally.id_switches,
            people_missed: share(tally.missed, tally.people_frames),
            tracks_extra: share(tally.extra, tally.track_frames),
            sides_right: tally.sides_right.mean(),
            swaps_right: tally.swaps_right.mean(),
            left_out: spread(&tally.left_out),
            left_out_median_mm: mean(&tally.left_out_medians).map(|metres| metres * 1e3),
            left_out_sides: tally.left_out_sides.mean(),
            noise_bound_mm: tally.bound.mean().map(|square| square.sqrt() * 1e3),
            frames: tally.frames,
            person_seconds: tally.person_seconds,
            engine_us_per_frame: busy
                .filter(|_| tally.frames > 0)
                .map(|busy| busy * 1e6 / tally.frames as f64),
            times_real_time: busy.map(|busy| tally.live_s / busy),
            repair: tally.repair.effect(),
        }
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn spread(distances: &Histogram) -> ErrorSpread {
    let mm = |metres: Option<f64>| metres.map(|metres| metres * 1e3);
    ErrorSpread {
        mean_mm: mm(distances.mean_m()),
        median_mm: mm(distances.quantile_m(0.5)),
        p95_mm: mm(distances.quantile_m(0.95)),
        rms_mm: mm(distances.rms_m()),
        joints: distances.count(),
    }
}
