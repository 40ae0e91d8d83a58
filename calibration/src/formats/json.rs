//! JSON with the keys of our TOML, see [`CalibrationFile`].

use posefuse_skeleton::Calibration;
use posefuse_skeleton::calibration_text::{CalibrationFile, check_version};
use serde::Deserialize;

use super::FormatError;

pub(super) fn write(calibration: &Calibration) -> String {
    // Strings and numbers only: it cannot fail, and a number that JSON does not have becomes null, which is refused.
    let mut text = serde_json::to_string_pretty(&CalibrationFile::from(calibration))
        .unwrap_or_else(|_| "null".to_owned());
    text.push('\n');
    text
}

pub(super) fn read(text: &str) -> Result<Calibration, FormatError> {
    /// Read first, so that an unknown key of a newer version is not taken for a typing error.
    #[derive(Deserialize)]
    struct Version {
        version: i64,
    }
    let Version { version } = serde_json::from_str(text).map_err(syntax)?;
    check_version(version)?;
    let file: CalibrationFile = serde_json::from_str(text).map_err(syntax)?;
    Ok(file.calibration()?)
}

fn syntax(error: serde_json::Error) -> FormatError {
    FormatError::Syntax {
        form: "Posefuse's JSON",
        problem: error.to_string(),
    }
}
