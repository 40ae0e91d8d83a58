//! The outcome: a calibration, whether to trust it, why, what to do, and the table behind it.

use posefuse_skeleton::{Calibration, FloorSource};
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
    /// From the first to the last frame, seconds.
    pub duration_s: f64,
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
