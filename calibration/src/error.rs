//! Why there is no calibration.

use thiserror::Error;

/// No calibration could be computed at all. (A bad one that could be computed is a `Failed` verdict instead.)
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CalibrationError {
    /// No sensor.
    #[error("calibration needs a sensor that watches the walk, found none; start an agent")]
    NoSensor,
    /// A name occurs twice.
    #[error("two sensors are called `{0}`; give each agent a name of its own")]
    DuplicateSensor(String),
    /// The root is not in the walk.
    #[error("the root sensor `{root}` is not in this walk; its sensors are {}", list(.sensors))]
    UnknownRoot {
        /// The root that was asked for.
        root: String,
        /// The sensors there are.
        sensors: Vec<String>,
    },
    /// A sensor saw nobody at all.
    #[error(
        "{} saw nobody during the walk; check that the sensor tracks people, point it at the walking area, or leave it out",
        list(.sensors)
    )]
    NobodySeen {
        /// The sensors that saw nobody.
        sensors: Vec<String>,
    },
    /// No chain of shared views joins all sensors.
    #[error(
        "no shared view joins these groups of sensors: {}; walk where a sensor of one group and a sensor of another \
         see the person at the same time, or turn sensors until their views overlap, then repeat",
        in_brackets(.groups)
    )]
    Disconnected {
        /// Sensors that could be joined, by name; two groups or more.
        groups: Vec<Vec<String>>,
    },
}

fn list(names: &[String]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn in_brackets(groups: &[Vec<String>]) -> String {
    groups
        .iter()
        .map(|names| format!("({})", list(names)))
        .collect::<Vec<_>>()
        .join(" and ")
}
