//! Whether a walk and what is asked of it can be solved at all.

use nalgebra::Vector3;

use crate::tracks::SensorTracks;
use crate::{CalibrationError, HandFloor, Options};

/// Refuses sensors that saw nobody.
pub(crate) fn all_saw_somebody(sensors: &[SensorTracks]) -> Result<(), CalibrationError> {
    let blind = sensors.iter().filter(|sensor| sensor.is_empty());
    let blind: Vec<String> = blind.map(|sensor| sensor.name.clone()).collect();
    if blind.is_empty() {
        Ok(())
    } else {
        Err(CalibrationError::NobodySeen { sensors: blind })
    }
}

/// The index of the root sensor among the sorted `names`.
pub(crate) fn validate(names: &[&str], options: &Options) -> Result<usize, CalibrationError> {
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(CalibrationError::DuplicateSensor(twice[0].to_owned()));
    }
    if names.is_empty() {
        return Err(CalibrationError::NoSensor);
    }
    if let Some(hand) = &options.floor {
        validate_floor(hand, names)?;
    }
    let Some(root) = &options.root else {
        return Ok(0);
    };
    names
        .iter()
        .position(|name| name == root)
        .ok_or_else(|| CalibrationError::UnknownRoot {
            root: root.clone(),
            sensors: names.iter().map(|name| (*name).to_owned()).collect(),
        })
}

/// Whether a floor set by hand can be one.
fn validate_floor(hand: &HandFloor, names: &[&str]) -> Result<(), CalibrationError> {
    let refused = |what: &str| Err(CalibrationError::HandFloor(what.to_owned()));
    if !names.contains(&hand.sensor.as_str()) {
        return refused("its `sensor` must be one of this walk");
    }
    let up = hand.up.map(Vector3::from);
    if up.is_some_and(|up| !(1e-6..1e6).contains(&up.norm())) {
        return refused("its `up` must be a direction, such as [0, -1, 0] for a level sensor");
    }
    let numbers = [hand.height_m, hand.looks_deg].into_iter().flatten();
    if numbers
        .chain(hand.at_m.into_iter().flatten())
        .any(|n| n.abs() > 1e4 || n.is_nan())
    {
        return refused(
            "its `height_m`, `at_m` and `looks_deg` must be lengths in metres and an angle in degrees",
        );
    }
    Ok(())
}
