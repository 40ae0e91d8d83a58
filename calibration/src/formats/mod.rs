//! A calibration in the forms that people have: our TOML and JSON, ROS static transforms, OpenCV file storage.
//!
//! Text in, text out. TOML and JSON hold everything; the other two hold poses (OpenCV also time offsets), so what comes
//! back from them has no verdict, no residuals and no joint offsets, its floor counts as set by hand, and `created` is
//! empty. Whatever the form, the same checks refuse what no sensor can have.
//!
//! | form | what a pose is | units |
//! |---|---|---|
//! | [`Format::Toml`], [`Format::Json`] | `room_from_sensor` as position and quaternion | m, ms |
//! | [`Format::Tf2Yaml`] | `room_from_sensor`: frame `posefuse_room`, child `<sensor>_optical` | m |
//! | [`Format::OpenCvYaml`] | `sensor_from_room` (OpenCV's extrinsics): `x_sensor = R x_room + t` | m, ms |

mod json;
mod opencv;
mod tf2;

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use posefuse_skeleton::calibration_text::{
    CalibrationFile, CalibrationFileError, SensorEntry, VERSION, from_toml, to_toml,
};
use posefuse_skeleton::{Calibration, FloorSource};
use thiserror::Error;

/// A form of calibration files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Our own, to read and edit.
    Toml,
    /// The same keys as JSON.
    Json,
    /// A `tf2_msgs/TFMessage` as `ros2 topic echo /tf_static` prints it.
    Tf2Yaml,
    /// OpenCV's `cv::FileStorage`.
    OpenCvYaml,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Toml, Self::Json, Self::Tf2Yaml, Self::OpenCvYaml];

    /// What the command line calls it: `toml`, `json`, `tf2` or `opencv`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Toml => "toml",
            Self::Json => "json",
            Self::Tf2Yaml => "tf2",
            Self::OpenCvYaml => "opencv",
        }
    }

    /// How names of such files end.
    pub fn file_ending(self) -> &'static str {
        match self {
            Self::Toml => ".toml",
            Self::Json => ".json",
            Self::Tf2Yaml => ".tf2.yaml",
            Self::OpenCvYaml => ".opencv.yaml",
        }
    }

    /// The form that `text` seems to have; `None`: none of them.
    pub fn detect(text: &str) -> Option<Self> {
        let text = text.trim_start_matches('\u{feff}').trim_start();
        let says = |part: &str| {
            text.lines()
                .map(str::trim_start)
                .any(|line| !line.starts_with('#') && line.contains(part))
        };
        if text.starts_with("%YAML:") || says("opencv-matrix") {
            Some(Self::OpenCvYaml)
        } else if says("child_frame_id") || says("transforms:") {
            Some(Self::Tf2Yaml)
        } else if text.starts_with('{') {
            Some(Self::Json)
        } else if says("=") {
            Some(Self::Toml)
        } else {
            None
        }
    }
}

/// A text that is not taken for a calibration.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FormatError {
    /// None of the forms.
    #[error(
        "this is none of the calibration files that are known: Posefuse's TOML or JSON, ROS static transforms (a list \
         `transforms:` with `child_frame_id`), OpenCV YAML (it begins with `%YAML:1.0`); export one to see how it looks"
    )]
    Unknown,
    /// Not what the form's syntax or keys ask for.
    #[error("this cannot be read as {form}: {problem}")]
    Syntax {
        /// The form.
        form: &'static str,
        /// Where and what.
        problem: String,
    },
    /// A matrix that does not turn.
    #[error(
        "sensor `{sensor}`: R must be a rotation (orthonormal, determinant +1), found {found}; mend the matrix, or \
         calibrate again"
    )]
    Rotation {
        /// The sensor's name.
        sensor: String,
        /// What it is.
        found: String,
    },
    /// Frames that do not hang together.
    #[error("the transforms do not place every sensor in one room: {0}")]
    Frames(String),
    /// What any calibration file may be refused for.
    #[error(transparent)]
    File(#[from] CalibrationFileError),
}

/// `calibration` in a form. [`import`] gives the same poses back, to 1e-9.
pub fn export(calibration: &Calibration, format: Format) -> String {
    match format {
        Format::Toml => to_toml(calibration),
        Format::Json => json::write(calibration),
        Format::Tf2Yaml => tf2::write(calibration),
        Format::OpenCvYaml => opencv::write(calibration),
    }
}

/// The calibration in `text`, in a form that is found out unless it is given.
pub fn import(text: &str, format: Option<Format>) -> Result<Calibration, FormatError> {
    let format = format.or_else(|| Format::detect(text));
    let text = text.trim_start_matches('\u{feff}');
    match format.ok_or(FormatError::Unknown)? {
        Format::Toml => Ok(from_toml(text)?),
        Format::Json => json::read(text),
        Format::Tf2Yaml => tf2::read(text),
        Format::OpenCvYaml => opencv::read(text),
    }
}

/// A pose that another program wrote.
struct Foreign {
    /// Metres; optical axes.
    room_from_sensor: Isometry3<f64>,
    time_offset_ms: f64,
}

/// The calibration of such poses, checked as any other.
fn foreign(poses: BTreeMap<String, Foreign>) -> Result<Calibration, FormatError> {
    let entry = |pose: Foreign| SensorEntry {
        position_m: pose.room_from_sensor.translation.vector.into(),
        orientation_xyzw: pose.room_from_sensor.rotation.coords.into(),
        time_offset_ms: pose.time_offset_ms,
        residual_median_mm: 0.0,
        residual_p95_mm: 0.0,
        samples: 0,
        sigma_mm: None,
        sigma_deg: None,
        sigma_ms: None,
    };
    let file = CalibrationFile {
        version: VERSION,
        created: String::new(),
        method: "import".to_owned(),
        floor: FloorSource::Manual,
        verdict: String::new(),
        sensors: poses
            .into_iter()
            .map(|(name, pose)| (name, entry(pose)))
            .collect(),
        ray_bias_mm: BTreeMap::new(),
        joint_offsets_mm: BTreeMap::new(),
    };
    Ok(file.calibration()?)
}

/// A number that every YAML reader takes for one: no exponent, a point in it, never `-0`.
fn number(value: f64) -> String {
    format!("{:.12}", value + 0.0)
}

/// A string as YAML and JSON quote it.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
