//! OpenCV's `cv::FileStorage` YAML: a list `sensors`, each with `name`, `R` (3x3, or 3x1 as `cv::Rodrigues` has it) and
//! `t` (3x1, metres).
//!
//! As everywhere in OpenCV, extrinsics take room coordinates to the sensor's: `x_sensor = R x_room + t`, so that
//! `cv::projectPoints` takes them as they are. The sensor stands at `-R^T t`.

use std::collections::BTreeMap;
use std::fmt::Write;

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_skeleton::Calibration;
use posefuse_skeleton::calibration_text::CalibrationFileError;
use serde::Deserialize;

use super::{Foreign, FormatError, foreign, number, quoted};

const CONVENTION: &str = "sensor_from_room";
/// How far R may be from orthonormal, each element of R^T R (three decimals typed by hand).
const ORTHONORMAL: f64 = 4e-3;

pub(super) fn write(calibration: &Calibration) -> String {
    let mut text = format!(
        "%YAML:1.0\n---\n# Posefuse: x_sensor = R x_room + t, metres; the room is x forward, y left, z up.\n\
         convention: {CONVENTION}\nsensors:\n"
    );
    for (name, pose) in &calibration.sensors {
        let sensor_from_room = pose.room_from_sensor.inverse();
        let rotation = sensor_from_room.rotation().to_rotation_matrix();
        // OpenCV writes row by row.
        let r: Vec<f64> = rotation.matrix().transpose().iter().copied().collect();
        let t: Vec<f64> = sensor_from_room
            .isometry()
            .translation
            .vector
            .as_slice()
            .to_vec();
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "   -\n      name: {}\n{}{}      time_offset_ms: {}\n",
            quoted(name),
            matrix("R", 3, &r),
            matrix("t", 1, &t),
            number(pose.time_offset_ns as f64 * 1e-6)
        );
    }
    text
}

fn matrix(key: &str, columns: usize, data: &[f64]) -> String {
    let rows: Vec<String> = data
        .chunks(3)
        .map(|row| {
            row.iter()
                .map(|v| number(*v))
                .collect::<Vec<_>>()
                .join(", ")
        })
        .collect();
    format!(
        "      {key}: !!opencv-matrix\n         rows: 3\n         cols: {columns}\n         dt: d\n         data: [ {} ]\n",
        rows.join(",\n             ")
    )
}

/// What else stands in the file (intrinsics, image sizes) is left aside.
#[derive(Deserialize)]
struct File {
    convention: Option<String>,
    sensors: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    #[serde(rename = "R", alias = "rvec")]
    r: Matrix,
    #[serde(alias = "T", alias = "tvec")]
    t: Matrix,
    #[serde(default)]
    time_offset_ms: f64,
}

#[derive(Deserialize)]
struct Matrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

pub(super) fn read(text: &str) -> Result<Calibration, FormatError> {
    let file: File = serde_saphyr::from_str(text).map_err(|error| syntax(error.to_string()))?;
    let is_inverse = match file.convention.as_deref() {
        None | Some(CONVENTION) => false,
        Some("room_from_sensor") => true,
        Some(other) => {
            return Err(syntax(format!(
                "`convention` must be {CONVENTION} (OpenCV's own) or room_from_sensor, found `{other}`"
            )));
        }
    };
    let mut poses = BTreeMap::new();
    for entry in file.sensors {
        let given = Isometry3::from_parts(
            vector(&entry.name, "t", &entry.t)?.into(),
            rotation(&entry.name, &entry.r)?,
        );
        let pose = Foreign {
            room_from_sensor: if is_inverse { given } else { given.inverse() },
            time_offset_ms: entry.time_offset_ms,
        };
        if poses.insert(entry.name.clone(), pose).is_some() {
            let name = entry.name;
            return Err(syntax(format!(
                "sensor `{name}` stands there twice; delete one"
            )));
        }
    }
    if poses.is_empty() {
        return Err(CalibrationFileError::Empty.into());
    }
    foreign(poses)
}

fn syntax(problem: String) -> FormatError {
    FormatError::Syntax {
        form: "OpenCV YAML",
        problem,
    }
}

fn vector(sensor: &str, key: &str, matrix: &Matrix) -> Result<Vector3<f64>, FormatError> {
    match (matrix.rows, matrix.cols, matrix.data.as_slice()) {
        (3, 1, [x, y, z]) | (1, 3, [x, y, z]) => Ok(Vector3::new(*x, *y, *z)),
        (rows, columns, data) => Err(syntax(format!(
            "sensor `{sensor}`: `{key}` must be 3x1, found {rows}x{columns} with {} numbers",
            data.len()
        ))),
    }
}

/// From a matrix, or a vector as `cv::Rodrigues` has it.
fn rotation(sensor: &str, matrix: &Matrix) -> Result<UnitQuaternion<f64>, FormatError> {
    if matrix.rows.min(matrix.cols) == 1 {
        return Ok(UnitQuaternion::from_scaled_axis(vector(
            sensor, "R", matrix,
        )?));
    }
    if (matrix.rows, matrix.cols, matrix.data.len()) != (3, 3, 9) {
        let (rows, columns, numbers) = (matrix.rows, matrix.cols, matrix.data.len());
        return Err(syntax(format!(
            "sensor `{sensor}`: `R` must be 3x3, found {rows}x{columns} with {numbers} numbers"
        )));
    }
    let r = Matrix3::from_row_slice(&matrix.data);
    let refused = |found: String| FormatError::Rotation {
        sensor: sensor.to_owned(),
        found,
    };
    let off = (r.transpose() * r - Matrix3::identity()).abs().max();
    if off > ORTHONORMAL || !off.is_finite() {
        return Err(refused(format!("columns that are off by {off:.3}")));
    }
    if r.determinant() < 0.0 {
        return Err(refused(
            "a reflection (determinant -1): one axis is turned round".to_owned(),
        ));
    }
    let mut rotation = Rotation3::from_matrix_unchecked(r);
    rotation.renormalize();
    Ok(UnitQuaternion::from_rotation_matrix(&rotation))
}
