//! The content of a calibration file: what TOML and JSON hold alike, in the units that people read, and the checks that
//! refuse what no sensor can have.

use std::collections::BTreeMap;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::{CalibrationFileError, VERSION};
use crate::{
    Calibration, FloorSource, Joint, JointMap, JointSet, PoseSigma, SensorPose, Transform,
};

/// How far the length of a hand-edited quaternion may be from 1 (three decimals typed by hand).
const UNIT_TOLERANCE: f64 = 2e-3;
/// No sensor stands further than this from its room's origin, metres: beyond, somebody typed millimetres.
const MAX_POSITION_M: f64 = 100.0;
/// Largest time offset that a file may state, milliseconds.
const MAX_OFFSET_MS: f64 = 10_000.0;
/// No tracker's joint is further from where it should be, millimetres.
const MAX_JOINT_OFFSET_MM: f64 = 500.0;

/// A calibration file's content. Unknown keys are refused when it is read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationFile {
    /// The version of this format.
    pub version: i64,
    /// Civil time it was made, RFC 3339 (UTC).
    #[serde(default)]
    pub created: String,
    /// How it was made.
    #[serde(default)]
    pub method: String,
    /// Where floor, up and heading came from.
    pub floor: FloorSource,
    /// The verdict it got; empty where nobody judged it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub verdict: String,
    /// One entry per sensor, by name.
    #[serde(default)]
    pub sensors: BTreeMap<String, SensorEntry>,
    /// How far trackers report each joint nearer to their sensor than it is, mm.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub ray_bias_mm: BTreeMap<String, f64>,
    /// What is added to each joint of a joint set, in its local axes, mm.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_offsets_mm: BTreeMap<JointSet, BTreeMap<String, [f64; 3]>>,
}

/// One sensor's place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorEntry {
    /// Where it stands in the room, metres.
    pub position_m: [f64; 3],
    /// The unit quaternion that turns its optical axes into the room's.
    pub orientation_xyzw: [f64; 4],
    /// Added to its capture times, ms.
    #[serde(default)]
    pub time_offset_ms: f64,
    /// Median distance of its joints to the other sensors', mm.
    #[serde(default)]
    pub residual_median_mm: f64,
    /// 95th percentile of the same, mm.
    #[serde(default)]
    pub residual_p95_mm: f64,
    /// Joint pairs that were used.
    #[serde(default)]
    pub samples: u64,
    /// How well the position is known, mm; all three sigmas are there or none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_mm: Option<f64>,
    /// How well the rotation is known, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_deg: Option<f64>,
    /// How well the time offset is known, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_ms: Option<f64>,
}

impl From<&Calibration> for CalibrationFile {
    fn from(calibration: &Calibration) -> Self {
        let sensors = calibration.sensors.iter();
        let offsets = calibration.joint_offsets_m.iter();
        Self {
            version: VERSION,
            created: calibration.created.clone(),
            method: calibration.method.clone(),
            floor: calibration.floor,
            verdict: calibration.verdict.clone(),
            sensors: sensors
                .map(|(name, pose)| (name.clone(), SensorEntry::from(pose)))
                .collect(),
            ray_bias_mm: named(&calibration.ray_bias_m, |metres| metres * 1e3),
            joint_offsets_mm: offsets
                .map(|(set, offsets)| (*set, named(offsets, |offset| (offset * 1e3).into())))
                .collect(),
        }
    }
}

fn named<T, V>(joints: &JointMap<T>, value: impl Fn(&T) -> V) -> BTreeMap<String, V> {
    let entries = joints.iter();
    entries
        .map(|(joint, found)| (joint.name().to_owned(), value(found)))
        .collect()
}

impl From<&SensorPose> for SensorEntry {
    fn from(pose: &SensorPose) -> Self {
        let sigma = |of: fn(&PoseSigma) -> f64| pose.sigma.as_ref().map(of);
        Self {
            position_m: pose.room_from_sensor.origin().vector().into(),
            orientation_xyzw: pose.room_from_sensor.rotation().coords.into(),
            time_offset_ms: pose.time_offset_ns as f64 * 1e-6,
            residual_median_mm: pose.residual_median_m * 1e3,
            residual_p95_mm: pose.residual_p95_m * 1e3,
            samples: pose.samples,
            sigma_mm: sigma(|sigma| sigma.position_m * 1e3),
            sigma_deg: sigma(|sigma| sigma.rotation_rad.to_degrees()),
            sigma_ms: sigma(|sigma| sigma.time_s * 1e3),
        }
    }
}

impl CalibrationFile {
    /// The calibration it holds, checked: a value that no sensor can have is refused.
    pub fn calibration(self) -> Result<Calibration, CalibrationFileError> {
        if self.sensors.is_empty() {
            return Err(CalibrationFileError::Empty);
        }
        let sensors = self
            .sensors
            .into_iter()
            .map(|(name, entry)| Ok((name.clone(), pose(&name, &entry)?)))
            .collect::<Result<_, CalibrationFileError>>()?;
        let offsets = self.joint_offsets_mm.into_iter().map(|(set, offsets)| {
            let metres = |mm| Vector3::from(mm) * 1e-3;
            let offsets = joints(offsets, metres, |mm| Vector3::from(*mm).norm())?;
            Ok((set, offsets))
        });
        Ok(Calibration {
            created: self.created,
            method: self.method,
            floor: self.floor,
            verdict: self.verdict,
            sensors,
            ray_bias_m: joints(self.ray_bias_mm, |mm| mm * 1e-3, |mm| mm.abs())?,
            joint_offsets_m: offsets.collect::<Result<_, CalibrationFileError>>()?,
        })
    }
}

/// A table by joint; `length_mm` of a value must be that of a body's part.
fn joints<V: std::fmt::Debug, T>(
    table: BTreeMap<String, V>,
    value: impl Fn(V) -> T,
    length_mm: impl Fn(&V) -> f64,
) -> Result<JointMap<T>, CalibrationFileError> {
    let entry = |(name, found): (String, V)| {
        let joint: Joint = name.parse().map_err(CalibrationFileError::Syntax)?;
        if length_mm(&found) <= MAX_JOINT_OFFSET_MM {
            Ok((joint, value(found)))
        } else {
            Err(CalibrationFileError::Joint {
                joint: name,
                found: format!("{found:?}"),
            })
        }
    };
    table.into_iter().map(entry).collect()
}

fn pose(sensor: &str, entry: &SensorEntry) -> Result<SensorPose, CalibrationFileError> {
    let check = |valid: bool, key, expected, found: &dyn std::fmt::Debug| {
        valid
            .then_some(())
            .ok_or_else(|| CalibrationFileError::Value {
                sensor: sensor.to_owned(),
                key,
                expected,
                found: format!("{found:?}"),
            })
    };
    let position = Vector3::from(entry.position_m);
    check(
        position.iter().all(|c| c.abs() <= MAX_POSITION_M),
        "position_m",
        "three numbers in metres, each at most 100 (thousands are millimetres: divide them by 1000)",
        &entry.position_m,
    )?;
    let [x, y, z, w] = entry.orientation_xyzw;
    let quaternion = Quaternion::new(w, x, y, z);
    check(
        (quaternion.norm() - 1.0).abs() <= UNIT_TOLERANCE,
        "orientation_xyzw",
        "a pure rotation, a quaternion x, y, z, w of length 1",
        &entry.orientation_xyzw,
    )?;
    check(
        entry.time_offset_ms.abs() <= MAX_OFFSET_MS,
        "time_offset_ms",
        "within 10 000 ms of 0",
        &entry.time_offset_ms,
    )?;
    for (key, value) in [
        ("residual_median_mm", entry.residual_median_mm),
        ("residual_p95_mm", entry.residual_p95_mm),
    ] {
        let valid = (0.0..1e6).contains(&value);
        check(valid, key, "a length in mm, 0 or more", &value)?;
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok(SensorPose {
        room_from_sensor: Transform::from_parts(position, rotation),
        time_offset_ns: (entry.time_offset_ms * 1e6).round() as i64,
        residual_median_m: entry.residual_median_mm * 1e-3,
        residual_p95_m: entry.residual_p95_mm * 1e-3,
        samples: entry.samples,
        sigma: sigma(sensor, entry)?,
    })
}

/// The standard deviations, all three or none.
fn sigma(sensor: &str, entry: &SensorEntry) -> Result<Option<PoseSigma>, CalibrationFileError> {
    let found = [entry.sigma_mm, entry.sigma_deg, entry.sigma_ms];
    if found == [None; 3] {
        return Ok(None);
    }
    match found.map(|value| value.filter(|value| (0.0..1e6).contains(value))) {
        [Some(mm), Some(deg), Some(ms)] => Ok(Some(PoseSigma {
            position_m: mm * 1e-3,
            rotation_rad: deg.to_radians(),
            time_s: ms * 1e-3,
        })),
        _ => Err(CalibrationFileError::Value {
            sensor: sensor.to_owned(),
            key: "sigma_mm, sigma_deg, sigma_ms",
            expected: "all three there, each 0 or more, or none",
            found: format!("{found:?}"),
        }),
    }
}
