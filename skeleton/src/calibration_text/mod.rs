//! A calibration as text: TOML that a person can read and edit, one table per sensor. The one format for files and
//! for the calibration that a take carries.
//!
//! `orientation_xyzw` is the unit quaternion of the rotation part of `room_from_sensor`, `position_m` where the
//! sensor stands in the room. Roll, pitch and yaw stand beside it as a comment and are not read.

mod file;

use std::fmt::Write;

use serde::Deserialize;
use thiserror::Error;

use crate::{Calibration, FloorSource, SensorPose};

pub use file::{CalibrationFile, SensorEntry};

/// The version this build writes and reads.
pub const VERSION: i64 = 1;

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
    check_version(version_of(text)?)?;
    let file: CalibrationFile = toml::from_str(text).map_err(syntax)?;
    file.calibration()
}

/// Refuses a version that this build does not read.
pub fn check_version(found: i64) -> Result<(), CalibrationFileError> {
    if found == VERSION {
        return Ok(());
    }
    Err(CalibrationFileError::Version {
        found,
        expected: VERSION,
    })
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
