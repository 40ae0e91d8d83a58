//! The JSON that `--json` prints: plain names and SI units, the same from a server and from a folder.

use std::collections::BTreeMap;

use posefuse_calibration::{PairRow, Reason, Solution};
use posefuse_proto::{calibration_to_wire, v1};
use posefuse_session::TakeInfo;
use posefuse_skeleton::{Provenance, RoomFrame, Track};
use serde::Serialize;

/// A take.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TakeView {
    pub(crate) name: String,
    pub(crate) slate: String,
    pub(crate) notes: String,
    /// `recording`, `complete`, `recovered` or `damaged`.
    pub(crate) state: &'static str,
    pub(crate) started: String,
    pub(crate) seconds: f64,
    pub(crate) bytes: u64,
    pub(crate) frames: u64,
    pub(crate) people: u32,
    pub(crate) sensors: Vec<String>,
    pub(crate) dropped: u64,
    pub(crate) trouble: String,
    /// The file, where it is known to be on this machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) path: Option<String>,
}

/// A take of the wire and one of a folder have the same fields, but for the state.
macro_rules! take_view {
    ($take:expr, $state:expr) => {
        TakeView {
            name: $take.name.clone(),
            slate: $take.slate.clone(),
            notes: $take.notes.clone(),
            state: $state,
            started: $take.started.clone(),
            seconds: $take.duration_ns as f64 * 1e-9,
            bytes: $take.size_bytes,
            frames: $take.frames,
            people: $take.people,
            sensors: $take.sensors.clone(),
            dropped: $take.dropped,
            trouble: $take.trouble.clone(),
            path: None,
        }
    };
}

impl From<&v1::Take> for TakeView {
    fn from(take: &v1::Take) -> Self {
        let state = match take.state() {
            v1::TakeState::Recording => "recording",
            v1::TakeState::Complete => "complete",
            v1::TakeState::Recovered => "recovered",
            v1::TakeState::Damaged | v1::TakeState::Unspecified => "damaged",
        };
        take_view!(take, state)
    }
}

impl From<&TakeInfo> for TakeView {
    fn from(take: &TakeInfo) -> Self {
        take_view!(take, take.state.name())
    }
}

/// One fused frame.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FrameView {
    pub(crate) number: u64,
    /// The instant the poses belong to, server clock.
    pub(crate) time_s: f64,
    pub(crate) people: Vec<PersonView>,
}

/// One fused person.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PersonView {
    pub(crate) id: u64,
    /// Since when this person has been followed, server clock.
    pub(crate) since_s: f64,
    pub(crate) sensors: Vec<String>,
    pub(crate) joints: BTreeMap<&'static str, JointView>,
}

/// One joint of a person; a joint that is missing is absent.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct JointView {
    /// Room frame: x forward, y left, z up.
    pub(crate) position_m: [f64; 3],
    pub(crate) sigma_mm: f64,
    pub(crate) confidence: f64,
    /// `measured`, `predicted` or `repaired`.
    pub(crate) provenance: &'static str,
}

impl FrameView {
    /// The frame, with its sensors by name.
    pub(crate) fn new(frame: &RoomFrame, name: impl Fn(usize) -> String) -> Self {
        let person = |track: &Track| PersonView {
            id: track.id.0,
            since_s: track.since.seconds(),
            sensors: track.sensors.iter().map(|id| name(id.index())).collect(),
            joints: track
                .skeleton
                .iter()
                .map(|(joint, state)| {
                    let p = state.position.vector();
                    let view = JointView {
                        position_m: [p.x, p.y, p.z].map(|v| (v * 1e5).round() / 1e5),
                        sigma_mm: (state.sigma_m() * 1e5).round() / 100.0,
                        confidence: (f64::from(state.confidence.get()) * 1e3).round() / 1e3,
                        provenance: provenance(state.provenance),
                    };
                    (joint.name(), view)
                })
                .collect(),
        };
        Self {
            number: frame.number,
            time_s: frame.time.seconds(),
            people: frame.tracks.iter().map(person).collect(),
        }
    }
}

fn provenance(provenance: Provenance) -> &'static str {
    match provenance {
        Provenance::Measured(_) => "measured",
        Provenance::Predicted(_) => "predicted",
        Provenance::Repaired => "repaired",
    }
}

/// The outcome of a calibration.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CalibrationView {
    /// `passed`, `weak` or `failed`.
    pub(crate) verdict: &'static str,
    pub(crate) reasons: Vec<String>,
    pub(crate) in_force: bool,
    pub(crate) sensors: Vec<SensorPoseView>,
    pub(crate) pairs: Vec<PairView>,
    /// The calibration file that was written, if one was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<String>,
}

/// Where one sensor stands.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SensorPoseView {
    pub(crate) sensor: String,
    pub(crate) position_m: [f64; 3],
    pub(crate) orientation_xyzw: [f64; 4],
    pub(crate) time_offset_ms: f64,
    pub(crate) residual_median_mm: f64,
    pub(crate) residual_p95_mm: f64,
    pub(crate) samples: u64,
}

/// How far two sensors' joints lie apart on frames the solver never used.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PairView {
    pub(crate) a: String,
    pub(crate) b: String,
    pub(crate) before_mm: f64,
    pub(crate) after_mm: f64,
    pub(crate) after_p95_mm: f64,
    pub(crate) samples: u64,
}

impl From<&v1::CalibrateResult> for CalibrationView {
    fn from(result: &v1::CalibrateResult) -> Self {
        let poses = result
            .calibration
            .iter()
            .flat_map(|calibration| &calibration.sensors);
        Self {
            verdict: match result.verdict() {
                v1::Verdict::Passed => "passed",
                v1::Verdict::Weak => "weak",
                v1::Verdict::Failed | v1::Verdict::Unspecified => "failed",
            },
            reasons: result.reasons.clone(),
            in_force: result.in_force,
            sensors: poses.map(SensorPoseView::from).collect(),
            pairs: result.pairs.iter().map(PairView::from).collect(),
            file: None,
        }
    }
}

impl CalibrationView {
    /// The outcome of a calibration that was solved here.
    pub(crate) fn of_solution(solution: &Solution) -> Self {
        let calibration = calibration_to_wire(&solution.calibration);
        let report = &solution.report;
        let reason = |reason: &Reason| format!("{}: {}", reason.what, reason.remedy);
        let pair = |row: &PairRow| PairView {
            a: row.a.clone(),
            b: row.b.clone(),
            before_mm: row.rms_before_mm,
            after_mm: row.median_mm,
            after_p95_mm: row.p95_mm,
            samples: row.samples,
        };
        Self {
            verdict: report.verdict.name(),
            reasons: report.reasons.iter().map(reason).collect(),
            in_force: false,
            sensors: calibration
                .sensors
                .iter()
                .map(SensorPoseView::from)
                .collect(),
            pairs: report.pairs.iter().map(pair).collect(),
            file: None,
        }
    }
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
            position_m: [t.x, t.y, t.z],
            orientation_xyzw: [q.x, q.y, q.z, q.w],
            time_offset_ms: pose.time_offset_ns as f64 * 1e-6,
            residual_median_mm: pose.residual_median_m * 1e3,
            residual_p95_mm: pose.residual_p95_m * 1e3,
            samples: pose.samples,
        }
    }
}

impl From<&v1::PairResidual> for PairView {
    fn from(pair: &v1::PairResidual) -> Self {
        Self {
            a: pair.a.clone(),
            b: pair.b.clone(),
            before_mm: pair.before_rms_m * 1e3,
            after_mm: pair.after_median_m * 1e3,
            after_p95_mm: pair.after_p95_m * 1e3,
            samples: pair.samples,
        }
    }
}
