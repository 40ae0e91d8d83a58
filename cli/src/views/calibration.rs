//! Calibrations as `--json` prints them and the tables show them.

use posefuse_calibration::{PairRow, Reason, SensorRow, Solution};
use posefuse_proto::{calibration_to_wire, v1};
use serde::Serialize;

/// The outcome of a calibration.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CalibrationView {
    /// `passed`, `weak` or `failed`.
    pub(crate) verdict: &'static str,
    pub(crate) reasons: Vec<String>,
    pub(crate) in_force: bool,
    pub(crate) sensors: Vec<SensorPoseView>,
    pub(crate) pairs: Vec<PairView>,
    /// How far trackers place joints in front of where they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) ray_bias_mm: Option<f64>,
    /// The calibration file that was written, if one was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<String>,
}

/// Where one sensor stands, and how well that is known. The pose is absent when the calibration failed; what only a
/// calibration that has just been made knows, otherwise.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct SensorPoseView {
    pub(crate) sensor: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) position_m: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) orientation_xyzw: Option<[f64; 4]>,
    pub(crate) time_offset_ms: f64,
    pub(crate) residual_median_mm: f64,
    pub(crate) residual_p95_mm: f64,
    pub(crate) samples: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) sigma_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) sigma_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) sigma_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) clock_drift_ppm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bone_scale: Option<f64>,
}

/// How far two sensors' joints lie apart on frames the solver never used.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PairView {
    pub(crate) a: String,
    pub(crate) b: String,
    /// Root mean square and median, as if both stood in the same place.
    pub(crate) before_mm: f64,
    pub(crate) before_median_mm: f64,
    pub(crate) after_mm: f64,
    pub(crate) after_p95_mm: f64,
    pub(crate) agreeing_share: f64,
    pub(crate) mirrored_share: f64,
    pub(crate) samples: u64,
    pub(crate) weakest: bool,
}

/// A calibration that is kept.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct KeptView {
    pub(crate) name: String,
    pub(crate) in_force: bool,
    pub(crate) created: String,
    pub(crate) verdict: String,
    pub(crate) method: String,
    pub(crate) floor: String,
    pub(crate) sensors: Vec<String>,
    pub(crate) trouble: String,
}

/// How far a sensor stands from where another calibration has it; absent: it is missing in one of the two.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct MoveView {
    pub(crate) sensor: String,
    pub(crate) moved_mm: Option<f64>,
    pub(crate) moved_deg: Option<f64>,
    pub(crate) moved_ms: Option<f64>,
    pub(crate) missing_in: String,
}

impl From<&v1::CalibrateResult> for CalibrationView {
    fn from(result: &v1::CalibrateResult) -> Self {
        let mut view = Self {
            verdict: match result.verdict() {
                v1::Verdict::Passed => "passed",
                v1::Verdict::Weak => "weak",
                v1::Verdict::Failed | v1::Verdict::Unspecified => "failed",
            },
            reasons: result.reasons.clone(),
            in_force: result.in_force,
            sensors: poses(result.calibration.as_ref()),
            pairs: result.pairs.iter().map(PairView::from).collect(),
            ray_bias_mm: result.ray_bias_mm,
            file: None,
        };
        view.complete(result.sensors.iter().map(SensorPoseView::from));
        view
    }
}

impl CalibrationView {
    /// The outcome of a calibration that was solved here.
    pub(crate) fn of_solution(solution: &Solution) -> Self {
        let report = &solution.report;
        let reason = |reason: &Reason| format!("{}: {}", reason.what, reason.remedy);
        let mut view = Self {
            verdict: report.verdict.name(),
            reasons: report.reasons.iter().map(reason).collect(),
            in_force: false,
            sensors: poses(Some(&calibration_to_wire(&solution.calibration))),
            pairs: report.pairs.iter().map(PairView::from).collect(),
            ray_bias_mm: report.ray_bias_mm,
            file: None,
        };
        view.complete(report.sensors.iter().map(SensorPoseView::from));
        view
    }

    /// Adds what only the table of the verdict says; its sensors are all there is when the calibration failed.
    fn complete(&mut self, rows: impl Iterator<Item = SensorPoseView>) {
        for row in rows {
            match self.sensors.iter_mut().find(|s| s.sensor == row.sensor) {
                Some(pose) => {
                    pose.residual_median_mm = row.residual_median_mm;
                    pose.residual_p95_mm = row.residual_p95_mm;
                    pose.sigma_mm = pose.sigma_mm.or(row.sigma_mm);
                    pose.sigma_deg = pose.sigma_deg.or(row.sigma_deg);
                    pose.sigma_ms = pose.sigma_ms.or(row.sigma_ms);
                    pose.clock_drift_ppm = row.clock_drift_ppm;
                    pose.bone_scale = row.bone_scale;
                }
                None => self.sensors.push(row),
            }
        }
    }
}

/// The poses of a calibration.
fn poses(calibration: Option<&v1::Calibration>) -> Vec<SensorPoseView> {
    let poses = calibration.iter().flat_map(|found| &found.sensors);
    poses.map(SensorPoseView::from).collect()
}

impl From<&v1::SensorPose> for SensorPoseView {
    fn from(pose: &v1::SensorPose) -> Self {
        let place = pose.room_from_sensor.unwrap_or_default();
        let (t, q) = (
            place.translation.unwrap_or_default(),
            place.rotation.unwrap_or_default(),
        );
        Self {
            sensor: pose.sensor.clone(),
            position_m: Some([t.x, t.y, t.z]),
            orientation_xyzw: Some([q.x, q.y, q.z, q.w]),
            time_offset_ms: pose.time_offset_ns as f64 * 1e-6,
            residual_median_mm: pose.residual_median_m * 1e3,
            residual_p95_mm: pose.residual_p95_m * 1e3,
            samples: pose.samples,
            sigma_mm: pose.sigma.map(|sigma| sigma.position_m * 1e3),
            sigma_deg: pose.sigma.map(|sigma| sigma.rotation_deg),
            sigma_ms: pose.sigma.map(|sigma| sigma.time_ms),
            ..Self::default()
        }
    }
}

impl From<&v1::SensorResult> for SensorPoseView {
    fn from(row: &v1::SensorResult) -> Self {
        Self {
            sensor: row.sensor.clone(),
            time_offset_ms: row.time_offset_ms,
            residual_median_mm: row.median_m * 1e3,
            residual_p95_mm: row.p95_m * 1e3,
            samples: row.samples,
            sigma_mm: row.sigma.map(|sigma| sigma.position_m * 1e3),
            sigma_deg: row.sigma.map(|sigma| sigma.rotation_deg),
            sigma_ms: row.sigma.map(|sigma| sigma.time_ms),
            clock_drift_ppm: row.clock_drift_ppm,
            bone_scale: Some(row.bone_scale),
            ..Self::default()
        }
    }
}

impl From<&SensorRow> for SensorPoseView {
    fn from(row: &SensorRow) -> Self {
        Self {
            sensor: row.name.clone(),
            time_offset_ms: row.time_offset_ms,
            residual_median_mm: row.median_mm,
            residual_p95_mm: row.p95_mm,
            samples: row.samples,
            sigma_mm: row.sigma.map(|sigma| sigma.position_m * 1e3),
            sigma_deg: row.sigma.map(|sigma| sigma.rotation_rad.to_degrees()),
            sigma_ms: row.sigma.map(|sigma| sigma.time_s * 1e3),
            clock_drift_ppm: row.clock_drift_ppm,
            bone_scale: Some(row.bone_scale),
            ..Self::default()
        }
    }
}

impl From<&v1::PairResidual> for PairView {
    fn from(pair: &v1::PairResidual) -> Self {
        Self {
            a: pair.a.clone(),
            b: pair.b.clone(),
            before_mm: pair.before_rms_m * 1e3,
            before_median_mm: pair.before_median_m * 1e3,
            after_mm: pair.after_median_m * 1e3,
            after_p95_mm: pair.after_p95_m * 1e3,
            agreeing_share: pair.agreeing_share,
            mirrored_share: pair.mirrored_share,
            samples: pair.samples,
            weakest: pair.weakest,
        }
    }
}

impl From<&PairRow> for PairView {
    fn from(row: &PairRow) -> Self {
        Self {
            a: row.a.clone(),
            b: row.b.clone(),
            before_mm: row.rms_before_mm,
            before_median_mm: row.median_before_mm,
            after_mm: row.median_mm,
            after_p95_mm: row.p95_mm,
            agreeing_share: row.agreeing_share,
            mirrored_share: row.mirrored_share,
            samples: row.samples,
            weakest: row.weakest,
        }
    }
}

impl From<&v1::StoredCalibration> for KeptView {
    fn from(kept: &v1::StoredCalibration) -> Self {
        let calibration = kept.calibration.clone().unwrap_or_default();
        Self {
            name: kept.name.clone(),
            in_force: kept.in_force,
            created: calibration.created,
            verdict: calibration.verdict,
            method: calibration.method,
            floor: calibration.floor,
            sensors: calibration.sensors.into_iter().map(|s| s.sensor).collect(),
            trouble: kept.trouble.clone(),
        }
    }
}

impl From<&v1::SensorMove> for MoveView {
    fn from(row: &v1::SensorMove) -> Self {
        Self {
            sensor: row.sensor.clone(),
            moved_mm: row.moved_mm,
            moved_deg: row.moved_deg,
            moved_ms: row.moved_ms,
            missing_in: row.missing_in.clone(),
        }
    }
}
