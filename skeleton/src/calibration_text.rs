//! A calibration as text: TOML that a person can read and edit, one table per sensor. The one format for files and
//! for the calibration that a take carries.
//!
//! `orientation_xyzw` is the unit quaternion of the rotation part of `room_from_sensor`, `position_m` where the
//! sensor stands in the room. Roll, pitch and yaw stand beside it as a comment and are not read.

use std::collections::BTreeMap;
use std::fmt::Write;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;
use thiserror::Error;

use crate::{
    Calibration, FloorSource, Joint, JointMap, JointSet, PoseSigma, SensorPose, Transform,
};

/// The version this build writes and reads.
const VERSION: i64 = 1;
/// How far the length of a hand-edited quaternion may be from 1 (three decimals typed by hand).
const UNIT_TOLERANCE: f64 = 2e-3;
/// No sensor stands further than this from its room's origin, metres: beyond, somebody typed millimetres.
const MAX_POSITION_M: f64 = 100.0;
/// Largest time offset that a file may state, milliseconds.
const MAX_OFFSET_MS: f64 = 10_000.0;
/// No tracker's joint is further from where it should be, millimetres.
const MAX_JOINT_OFFSET_MM: f64 = 500.0;

/// A calibration file that is not taken. The calibration in force stays in force.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CalibrationFileError {
    /// Not TOML, a wrong type, a missing or an unknown key.
    #[error("this is not a calibration file of Posefuse: {0}\nmend that line, or calibrate again")]
    Syntax(String),
    /// A version this build does not read.
    #[error(
        "the calibration file has version {found}, this build reads version {expected}; calibrate again, or use the build that wrote it"
    )]
    Version {
        /// The version in the file.
        found: i64,
        /// The version this build reads.
        expected: i64,
    },
    /// A value that no sensor can have.
    #[error(
        "sensor `{sensor}`: {key} must be {expected}, found {found}; mend the value, or calibrate again"
    )]
    Value {
        /// The sensor's name.
        sensor: String,
        /// The key.
        key: &'static str,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// A joint offset that no body has.
    #[error(
        "joint `{joint}`: its offset must be within 500 mm of 0, found {found}; mend the value, or calibrate again"
    )]
    Joint {
        /// The joint.
        joint: String,
        /// What it is.
        found: String,
    },
    /// No sensor in it.
    #[error("the calibration file names no sensor; calibrate again")]
    Empty,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[allow(dead_code, reason = "read ahead of everything else, see `version_of`")]
    version: i64,
    #[serde(default)]
    created: String,
    #[serde(default)]
    method: String,
    floor: FloorSource,
    #[serde(default)]
    verdict: String,
    #[serde(default)]
    sensors: BTreeMap<String, Entry>,
    #[serde(default)]
    ray_bias_mm: BTreeMap<String, f64>,
    #[serde(default)]
    joint_offsets_mm: BTreeMap<JointSet, BTreeMap<String, [f64; 3]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    position_m: [f64; 3],
    orientation_xyzw: [f64; 4],
    #[serde(default)]
    time_offset_ms: f64,
    #[serde(default)]
    residual_median_mm: f64,
    #[serde(default)]
    residual_p95_mm: f64,
    #[serde(default)]
    samples: u64,
    sigma_mm: Option<f64>,
    sigma_deg: Option<f64>,
    sigma_ms: Option<f64>,
}

/// The file's text. [`from_toml`] gives the same calibration back, poses to 1e-9.
pub fn to_toml(calibration: &Calibration) -> String {
    let mut text =
        String::from("# Where each sensor stands: room x forward, y left, z up, metres.\n");
    text += "# The sensor looks along its own z, its x is to the right and its y down.\n";
    let floor = match calibration.floor {
        FloorSource::Walk => "walk",
        FloorSource::Manual => "manual",
        FloorSource::Assumed => "assumed",
    };
    let created = quoted(&calibration.created);
    let method = quoted(&calibration.method);
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "version = {VERSION}\ncreated = {created}\nmethod = {method}\nfloor = \"{floor}\" # walk, manual or assumed\n"
    );
    if !calibration.verdict.is_empty() {
        let _ = writeln!(text, "verdict = {}", quoted(&calibration.verdict));
    }
    for (name, pose) in &calibration.sensors {
        let _ = write_sensor(&mut text, name, pose);
    }
    let _ = write_joints(&mut text, calibration);
    text
}

/// What the calibration says of joints, one table each.
fn write_joints(text: &mut String, calibration: &Calibration) -> std::fmt::Result {
    if !calibration.ray_bias_m.is_empty() {
        *text += "\n# How far trackers report a joint nearer to their sensor than it is.\n[ray_bias_mm]\n";
        for (joint, metres) in calibration.ray_bias_m.iter() {
            writeln!(text, "{joint} = {:.6}", metres * 1e3)?;
        }
    }
    for (set, offsets) in &calibration.joint_offsets_m {
        *text += "\n# What is added to this joint set's joints, in their local axes.\n";
        writeln!(text, "[joint_offsets_mm.{set}]")?;
        for (joint, offset) in offsets.iter() {
            let [x, y, z]: [f64; 3] = (offset * 1e3).into();
            writeln!(text, "{joint} = [{x:.6}, {y:.6}, {z:.6}]")?;
        }
    }
    Ok(())
}

fn write_sensor(text: &mut String, name: &str, pose: &SensorPose) -> std::fmt::Result {
    let p = pose.room_from_sensor.origin().vector();
    let rotation = pose.room_from_sensor.rotation();
    let q = rotation.coords;
    let (roll, pitch, yaw) = rotation.euler_angles();
    // Adding zero makes -0 plain.
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(|angle| angle.to_degrees() + 0.0);
    write!(
        text,
        "\n[sensors.{}]\nposition_m = [{:.9}, {:.9}, {:.9}]\n",
        quoted(name),
        p.x,
        p.y,
        p.z
    )?;
    writeln!(
        text,
        "# roll {:.2}, pitch {:.2}, yaw {:.2} degrees",
        roll, pitch, yaw
    )?;
    writeln!(
        text,
        "orientation_xyzw = [{:.12}, {:.12}, {:.12}, {:.12}]",
        q.x, q.y, q.z, q.w
    )?;
    writeln!(
        text,
        "time_offset_ms = {:.6} # added to its capture times",
        pose.time_offset_ns as f64 * 1e-6
    )?;
    writeln!(
        text,
        "residual_median_mm = {:.6}\nresidual_p95_mm = {:.6}\nsamples = {}",
        pose.residual_median_m * 1e3,
        pose.residual_p95_m * 1e3,
        pose.samples
    )?;
    let Some(sigma) = pose.sigma else {
        return Ok(());
    };
    writeln!(
        text,
        "sigma_mm = {:.6}\nsigma_deg = {:.6}\nsigma_ms = {:.6}",
        sigma.position_m * 1e3,
        sigma.rotation_rad.to_degrees(),
        sigma.time_s * 1e3
    )
}

/// A TOML basic string: the one form that may also be a key, whatever is in it.
fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted += &format!("\\u{:04X}", u32::from(c)),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// Reads what [`to_toml`] wrote or a person edited. Refuses what no sensor can have, and every unknown key.
pub fn from_toml(text: &str) -> Result<Calibration, CalibrationFileError> {
    let found = version_of(text)?;
    if found != VERSION {
        return Err(CalibrationFileError::Version {
            found,
            expected: VERSION,
        });
    }
    let file: File = toml::from_str(text).map_err(syntax)?;
    if file.sensors.is_empty() {
        return Err(CalibrationFileError::Empty);
    }
    let sensors = file
        .sensors
        .into_iter()
        .map(|(name, entry)| Ok((name.clone(), pose(&name, &entry)?)))
        .collect::<Result<_, CalibrationFileError>>()?;
    Ok(Calibration {
        created: file.created,
        method: file.method,
        floor: file.floor,
        verdict: file.verdict,
        sensors,
        ray_bias_m: joints(file.ray_bias_mm, |mm| mm * 1e-3, |mm| mm.abs())?,
        joint_offsets_m: file
            .joint_offsets_mm
            .into_iter()
            .map(|(set, offsets)| {
                let metres = |mm| Vector3::from(mm) * 1e-3;
                Ok((
                    set,
                    joints(offsets, metres, |mm| Vector3::from(*mm).norm())?,
                ))
            })
            .collect::<Result<_, CalibrationFileError>>()?,
    })
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

/// The version comes first, so that an unknown key of a newer version is not taken for a typing error.
fn version_of(text: &str) -> Result<i64, CalibrationFileError> {
    #[derive(Deserialize)]
    struct Version {
        version: i64,
    }
    toml::from_str(text)
        .map(|Version { version }| version)
        .map_err(syntax)
}

fn syntax(error: toml::de::Error) -> CalibrationFileError {
    CalibrationFileError::Syntax(error.to_string())
}

fn pose(sensor: &str, entry: &Entry) -> Result<SensorPose, CalibrationFileError> {
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
        "three numbers in metres, each at most 100",
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
fn sigma(sensor: &str, entry: &Entry) -> Result<Option<PoseSigma>, CalibrationFileError> {
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
