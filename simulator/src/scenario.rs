//! What is simulated: people, sensors, their layout and their errors. Readable from TOML; unknown keys are refused.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::motion::Situation;
use crate::sensor::SensorErrors;

/// Everything a simulated room follows from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// All randomness comes from it.
    pub seed: u64,
    /// How many people, 0 to [`Scenario::MAX_PEOPLE`].
    pub people: usize,
    /// How many sensors, 1 to 64.
    pub sensors: usize,
    /// Where the sensors stand.
    pub layout: Layout,
    /// Whether pairs of people hug now and then.
    pub hugs: bool,
    /// What people do most.
    pub situation: Situation,
    /// How long somebody who leaves ([`Situation::Leaving`]) stays away: between half of it and this, seconds.
    pub away_s: f64,
    /// Side of the square that people walk in, around the origin, metres.
    pub area_m: f64,
    /// Frames per second of each sensor.
    pub rate_hz: f64,
    /// How many of the sensors (the first ones) see by structured light, and so disturb each other.
    pub structured_light: usize,
    /// How many of the sensors (the last ones) are of another model, whose tracker means other points by the joints'
    /// names: by [`SensorErrors::definition_mm`].
    pub other_models: usize,
    /// How many of the sensors (the first ones) have a desk before them, at the area's edge: 1.6 m wide, 0.9 m high. It
    /// hides the legs of who stands behind it.
    pub desks: usize,
    /// What is wrong with the sensors.
    pub errors: SensorErrors,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            seed: 1,
            people: 1,
            sensors: 4,
            layout: Layout::Ring,
            hugs: false,
            situation: Situation::Everyday,
            away_s: 1.8,
            area_m: 2.6,
            rate_hz: 30.0,
            structured_light: 0,
            other_models: 0,
            desks: 0,
            errors: SensorErrors::default(),
        }
    }
}

/// How the sensors are spread around the room. They look at its middle from 2.6 to 3.2 m, 0.7 to 1.9 m high.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// All around.
    #[default]
    Ring,
    /// Over 100 degrees, in front (room +x).
    Arc,
}

/// A scenario that cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("scenario: `{field}` must be {expected}, found {found}")]
pub struct ScenarioError {
    /// The field.
    pub field: &'static str,
    /// What it may be.
    pub expected: &'static str,
    /// What it is.
    pub found: String,
}

impl Scenario {
    /// Most people that find room in the area.
    pub const MAX_PEOPLE: usize = 8;

    /// Checks every field.
    pub fn validate(&self) -> Result<(), ScenarioError> {
        check(
            self.people <= Self::MAX_PEOPLE,
            "people",
            "0 to 8",
            self.people,
        )?;
        check(
            (1..=64).contains(&self.sensors),
            "sensors",
            "1 to 64",
            self.sensors,
        )?;
        check(
            self.structured_light <= self.sensors,
            "structured_light",
            "at most the number of sensors",
            self.structured_light,
        )?;
        check(
            (0.1..=60.0).contains(&self.away_s),
            "away_s",
            "0.1 to 60 (seconds)",
            self.away_s,
        )?;
        check(
            self.other_models <= self.sensors,
            "other_models",
            "at most the number of sensors",
            self.other_models,
        )?;
        check(
            self.desks <= self.sensors,
            "desks",
            "at most the number of sensors",
            self.desks,
        )?;
        check(
            (2.0..=20.0).contains(&self.area_m),
            "area_m",
            "2 to 20 (metres)",
            self.area_m,
        )?;
        check(
            (1.0..=240.0).contains(&self.rate_hz),
            "rate_hz",
            "1 to 240 (frames per second)",
            self.rate_hz,
        )?;
        self.errors.validate()
    }
}

pub(crate) fn check(
    holds: bool,
    field: &'static str,
    expected: &'static str,
    found: impl ToString,
) -> Result<(), ScenarioError> {
    let error = || ScenarioError {
        field,
        expected,
        found: found.to_string(),
    };
    holds.then_some(()).ok_or_else(error)
}
