//! What a caller may choose, and the thresholds of the verdict with the reason for each.

use serde::{Deserialize, Serialize};

/// How to solve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Civil time for [`Calibration::created`](posefuse_skeleton::Calibration), RFC 3339 (UTC): this crate has no clock.
    pub created: String,
    /// The sensor towards which room X points, and whose clock is the one that offsets are searched around; the first by
    /// name if `None`. Relative poses do not depend on it.
    pub root: Option<String>,
    /// Whether to estimate a residual time offset per sensor.
    pub time_offsets: bool,
    /// Whether to estimate how far trackers report joints towards their own sensor (some 15 mm, the skin).
    pub ray_bias: bool,
    /// Largest residual time offset that is searched, seconds.
    pub max_time_offset_s: f64,
    /// Spacing of the instants at which sensors are compared, seconds.
    pub sample_spacing_s: f64,
    /// Every how many seconds one second is held out for the verdict.
    pub held_out_every: u32,
    /// Limits of the verdict.
    pub thresholds: Thresholds,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            created: String::new(),
            root: None,
            time_offsets: true,
            ray_bias: true,
            max_time_offset_s: 0.15,
            sample_spacing_s: 0.1,
            held_out_every: 5,
            thresholds: Thresholds::default(),
        }
    }
}

/// Limits of the verdict: beyond the first number of a pair it is at best `Weak`, beyond the second `Failed`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Thresholds {
    /// Held-out median distance of a sensor's joints to the other sensors', mm. Simulated rooms give 20 to 35;
    /// two real Kinect v2 agree to 20 mm side by side, 48 at 45 degrees and 64 at 90, where more cannot be had: so
    /// 60 is good and 64 still usable. Beyond 120 bodies of neighbouring people start to be mixed up.
    pub median_mm: [f64; 2],
    /// Share of shared frames in which most joints lie within 12 cm. A wrong pairing of people or a sensor that was
    /// moved half-way leaves half of the frames unexplained.
    pub agreeing_share: [f64; 2],
    /// Seconds shared with other sensors. Below 5 s the correlated errors of a tracker (0.4 s) are not averaged.
    pub shared_s: [f64; 2],
    /// Standard deviation of the person's place along the longer direction, m. A person who stands fills 0.05.
    pub spread_long_m: [f64; 2],
    /// The same across it, m. On one straight line the turn about that line is held by the body's size alone.
    pub spread_short_m: [f64; 2],
    /// Smallest over largest singular value of the joints' cloud: below 0.05 all joints lie near one plane, and the turn
    /// about its normal is the only one held well.
    pub singular_ratio: [f64; 2],
    /// Share of standing ankles between 5 cm below and 20 cm above the floor.
    pub floor_share: [f64; 2],
    /// How far a sensor's bone lengths may be off the others', as a share. Trackers differ by up to 10 %;
    /// more is a wrong unit or a mixture of people.
    pub bone_share: [f64; 2],
    /// How much a pair's residual may rise from the better to the worse half of the walk, mm: more is a sensor
    /// that was bumped half-way.
    pub halves_mm: [f64; 2],
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            median_mm: [60.0, 120.0],
            agreeing_share: [0.7, 0.5],
            shared_s: [10.0, 3.0],
            spread_long_m: [0.35, 0.15],
            spread_short_m: [0.15, 0.02],
            singular_ratio: [0.05, 0.01],
            floor_share: [0.95, 0.7],
            bone_share: [0.12, 0.3],
            halves_mm: [40.0, 100.0],
        }
    }
}
