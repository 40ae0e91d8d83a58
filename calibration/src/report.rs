//! The outcome: a calibration, whether to trust it, why, what to do, and the table behind it.

use posefuse_skeleton::{Calibration, FloorSource, PoseSigma};
use serde::{Deserialize, Serialize};

/// What [`solve`](crate::solve) gives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    /// The poses. Use them only as far as `report.verdict` allows.
    pub calibration: Calibration,
    /// How good they are.
    pub report: Report,
}

/// Whether a calibration can be trusted. The order is from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every check passed.
    Passed,
    /// Usable, with known weaknesses.
    Weak,
    /// Not to be used.
    Failed,
}

impl Verdict {
    /// `passed`, `weak` or `failed`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Weak => "weak",
            Self::Failed => "failed",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// The verdict and everything behind it. Residuals are of held-out frames, lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The worst of the reasons; `Passed` without any.
    pub verdict: Verdict,
    /// What is wrong, the worst first, and what else there is to know.
    pub reasons: Vec<Reason>,
    /// One row per sensor, by name.
    pub sensors: Vec<SensorRow>,
    /// One row per pair of sensors that saw somebody at the same time, by names.
    pub pairs: Vec<PairRow>,
    /// The floor.
    pub floor: FloorRow,
    /// How far trackers place joints in front of where they are, seen from their sensor: mean over the joints, mm.
    /// `None` where it was not estimated or what came out could not be skin, and so was not used.
    pub ray_bias_mm: Option<f64>,
    /// How well each sensor's pose is known beside the others', by name; empty for a lone sensor.
    #[serde(default)]
    pub covariance: Vec<SensorCovariance>,
    /// From the first to the last frame, seconds.
    pub duration_s: f64,
}

/// What the solver does not know of one sensor: the covariance of the small motion, in the room, that would take the
/// sensor from where it was put to where it stands.
///
/// Relative to all sensors: a motion and a delay that all of them share are no error (the mean of their turns, shifts and
/// offsets is taken to be 0), or to the sensors that were held where some were.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorCovariance {
    /// The sensor.
    pub name: String,
    /// By rows: turn about the room's X, Y and Z through its origin (rad), shift of what is at the origin (m), time
    /// offset (s).
    pub matrix: [[f64; 7]; 7],
}

/// One thing that is wrong, in plain words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reason {
    /// What this alone would make of the verdict: `Weak` or `Failed`; `Passed` for a mere note.
    pub severity: Verdict,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub remedy: String,
    /// The sensors it is about; empty for the room.
    pub sensors: Vec<String>,
}

/// One sensor against the others, on held-out frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorRow {
    /// The sensor.
    pub name: String,
    /// Median distance to the other sensors' joints, mm. 0 without samples (as for a lone sensor), as the next two.
    pub median_mm: f64,
    /// 95th percentile of the same, mm.
    pub p95_mm: f64,
    /// Root mean square of the same, mm.
    pub rms_mm: f64,
    /// Held-out joint pairs.
    pub samples: u64,
    /// Joint pairs the solver used.
    pub solved_samples: u64,
    /// How long it saw somebody together with another sensor (a lone one: at all), seconds.
    pub shared_s: f64,
    /// Standard deviations of the person's place on the floor in that time, m: along and across.
    pub spread_m: [f64; 2],
    /// What is added to its capture times, ms; 0 for the sensor whose times are the latest, negative for the others.
    pub time_offset_ms: f64,
    /// Its bone lengths over the median of all sensors'.
    pub bone_scale: f64,
    /// How well its pose and time offset are known; `None` for a lone sensor and one that was held.
    #[serde(default)]
    pub sigma: Option<PoseSigma>,
    /// How much faster than the other sensors' mean its clock runs, parts per million; `None` where the walk was too
    /// short to tell.
    #[serde(default)]
    pub clock_drift_ppm: Option<f64>,
}

/// One pair of sensors, on held-out frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairRow {
    /// The sensor that comes first by name.
    pub a: String,
    /// The other.
    pub b: String,
    /// Held-out joint pairs. 0 leaves the residuals 0.
    pub samples: u64,
    /// How long both saw somebody, seconds.
    pub shared_s: f64,
    /// Share of the solver's shared frames in which most joints lie within 12 cm.
    pub agreeing_share: f64,
    /// Share of frames in which left and right were exchanged between the two.
    pub mirrored_share: f64,
    /// Smallest over largest singular value of the shared joints' cloud.
    pub singular_ratio: f64,
    /// RMS distance as the recording came, both sensors taken to stand in the same place, mm.
    pub rms_before_mm: f64,
    /// Median distance as the recording came, mm.
    #[serde(default)]
    pub median_before_mm: f64,
    /// RMS distance under the calibration, mm.
    pub rms_after_mm: f64,
    /// Median distance under the calibration, mm.
    pub median_mm: f64,
    /// 95th percentile under the calibration, mm.
    pub p95_mm: f64,
    /// Median distance in the first and the second half of the walk (all frames), mm.
    pub halves_mm: [f64; 2],
    /// Whether this pair is part of the tree that holds the sensors together.
    pub in_tree: bool,
    /// Whether it is the weakest pair of that tree: without it the room would fall apart, and it agrees least.
    #[serde(default)]
    pub weakest: bool,
}

/// How the floor was found and whether it holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FloorRow {
    /// Where it came from.
    pub source: FloorSource,
    /// Standing ankles and feet that were used.
    pub samples: u64,
    /// Robust standard deviation of their heights, mm.
    pub sigma_mm: f64,
    /// Share of standing ankles between 5 cm below and 20 cm above the floor.
    pub share_in_band: f64,
    /// Share of bodies whose head is above their ankles.
    pub heads_up_share: f64,
    /// Sensors that would stand below the floor.
    pub sensors_below: Vec<String>,
}
