//! What a caller may choose, and the thresholds of the verdict with the reason for each.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{JointMap, JointSet, SensorPose};
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
    /// Whether to estimate how much faster each clock runs, on walks of at least [`Options::DRIFT_FROM_S`].
    pub clock_drift: bool,
    /// Sensors that are held where they stand, by name: to place one sensor anew beside the others. The room's frame and
    /// clock are theirs, so that floor, origin and heading stay. Names that are not in the walk do not matter.
    pub fixed: BTreeMap<String, SensorPose>,
    /// Ray biases that are held, metres, as [`Calibration::ray_bias_m`](posefuse_skeleton::Calibration). Not empty: no
    /// ray bias is estimated, and that of a joint that is not in it is 0.
    pub held_ray_bias_m: JointMap<f64>,
    /// Offsets of joint definitions that are held, metres, as
    /// [`Calibration::joint_offsets_m`](posefuse_skeleton::Calibration). Those of joint sets that are in it are not
    /// estimated.
    pub held_joint_offsets_m: BTreeMap<JointSet, JointMap<Vector3<f64>>>,
    /// What is known of the floor by hand; what it leaves open comes from the walk. Not used with [`Options::fixed`].
    pub floor: Option<HandFloor>,
    /// Limits of the verdict.
    pub thresholds: Thresholds,
}

/// Floor, up, origin and heading as somebody measured them at one sensor. Each part may be left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HandFloor {
    /// The sensor's name.
    pub sensor: String,
    /// Which way is up, in the sensor's optical axes; (0, -1, 0) for a sensor that stands level. From a spirit level or
    /// the sensor's own accelerometer. Need not have length 1.
    pub up: Option<[f64; 3]>,
    /// How high the sensor's lens is above the floor, metres.
    pub height_m: Option<f64>,
    /// Where the point of the floor below the lens lies in the room (x, y), metres: sets the origin.
    pub at_m: Option<[f64; 2]>,
    /// Which way the sensor looks in the room, degrees from X towards Y: sets the heading.
    pub looks_deg: Option<f64>,
}

impl Options {
    /// Shortest walk that says how much faster a clock runs, seconds: a drift of 20 ppm, a usual one, shifts its ends
    /// by 1.2 ms, which is twice what is known of an offset.
    pub const DRIFT_FROM_S: f64 = 60.0;
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
            clock_drift: true,
            fixed: BTreeMap::new(),
            held_ray_bias_m: JointMap::empty(),
            held_joint_offsets_m: BTreeMap::new(),
            floor: None,
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
    /// How much the person turned, 0..=1: the share of bodies more than 30 degrees off the commonest direction. Even
    /// turning gives 0.67, common walks 0.1 to 0.5; who walks up and down a line without turning, under 0.04. There a narrow way
    /// ([`Thresholds::spread_short_m`]) leaves the sensors free to turn about it.
    pub turned: [f64; 2],
    /// Smallest over largest singular value of the joints' cloud: below 0.05 all joints lie near one plane, and the turn
    /// about its normal is the only one held well.
    pub singular_ratio: [f64; 2],
    /// Share of standing ankles between 5 cm below and 20 cm above the floor.
    pub floor_share: [f64; 2],
    /// How far a sensor's bone lengths may be off the others', as a share. Trackers differ by up to 10 %;
    /// more is a wrong unit or a mixture of people.
    pub bone_share: [f64; 2],
    /// How far a sensor's metre may be off the others', as a share, going by where people walked. Simulated sensors
    /// agree to 0.3 %; yards for metres are 9 % off.
    pub scale_share: [f64; 2],
    /// How far a sensor may seem to have moved during the walk, mm RMS over the people's joints, provided that
    /// [`Thresholds::moved_sigmas`] says so too.
    pub moved_mm: [f64; 2],
    /// The same in standard deviations of what it can be told to.
    pub moved_sigmas: [f64; 2],
    /// Share of bodies seen head down: a sensor hung upside down, whose tracker was made for upright people. Its pose
    /// may well be right, its joints hardly.
    pub hanging_share: [f64; 2],
    /// Share of the bodies that face a sensor (by coming towards it, or by their toes) that show it their backs by its
    /// labels of left and right. Nobody does; a sensor whose labels are mirrored throughout gives 0.9; one that swaps now
    /// and then, up to 0.6.
    pub backwards_share: [f64; 2],
    /// How well a sensor's place must be known beside the others', standard deviation in mm.
    pub sigma_mm: [f64; 2],
    /// The same of its direction, degrees.
    pub sigma_deg: [f64; 2],
    /// The same of its time offset, ms: somebody who walks moves 1 mm in each.
    pub sigma_ms: [f64; 2],
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
            turned: [0.05, 0.02],
            singular_ratio: [0.05, 0.01],
            floor_share: [0.95, 0.7],
            bone_share: [0.12, 0.3],
            scale_share: [0.02, 0.1],
            moved_mm: [25.0, 80.0],
            moved_sigmas: [2.5, 5.0],
            hanging_share: [0.7, 1.0],
            backwards_share: [0.75, 1.0],
            sigma_mm: [30.0, 150.0],
            sigma_deg: [0.6, 3.0],
            sigma_ms: [10.0, 50.0],
            halves_mm: [40.0, 100.0],
        }
    }
}
