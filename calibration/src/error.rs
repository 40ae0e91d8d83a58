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
    /// What was set of the floor by hand is not possible.
    #[error("the floor that was set by hand cannot be used: {0}; correct it or leave it out")]
    HandFloor(String),
    /// A sensor saw nobody at all.
    #[error(
        "{} saw nobody during the walk; check that the sensor tracks people, point it at the walking area, or leave it out",
        list(.sensors)
    )]
    NobodySeen {
        /// The sensors that saw nobody.
        sensors: Vec<String>,
    },
    /// A sensor's people are no people: its unit is not the metre.
    #[error(
        "`{sensor}` sees people {times} times as large as they are; it seems to send {unit} for metres: set its unit, \
         then repeat"
    )]
    WrongUnit {
        /// The sensor.
        sensor: String,
        /// How many times, in figures.
        times: String,
        /// The unit that would explain it.
        unit: &'static str,
    },
    /// Nothing joins all sensors: they share no view, or do not agree on what they saw.
    #[error("nothing joins these groups of sensors: {}; {cause}", in_brackets(.groups))]
    Disconnected {
        /// Sensors that could be joined, by name; two groups or more.
        groups: Vec<Vec<String>>,
        /// Why, as far as that is known.
        cause: Cause,
    },
}

/// Why sensors do not agree, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Cause {
    /// They never saw somebody at the same time.
    #[error(
        "walk where a sensor of one group and a sensor of another see you at the same time, or turn sensors until \
         their views overlap, then repeat"
    )]
    Apart,
    /// A sensor's frames are too far apart to say where somebody was between them.
    #[error(
        "`{sensor}` sends {:.1} frames a second, and 10 or more are needed: check its agent, its cable and the network, \
         then repeat",
        *.per_minute as f64 / 60.0
    )]
    Sparse {
        /// The sensor.
        sensor: String,
        /// Frames a minute.
        per_minute: u64,
    },
    /// Left and right of a sensor's picture are exchanged.
    #[error(
        "the picture of {} is mirrored: turn mirroring off in its driver or agent, then repeat",
        either(.sensors)
    )]
    Mirrored {
        /// The sensor; of two, each of which could be the one, both.
        sensors: Vec<String>,
    },
    /// A clock is off by more than is searched.
    #[error(
        "the clock of `{sensor}` is {} s {}: restart its agent so that its clock is measured again, then repeat",
        seconds(*.ahead_ms),
        if *.ahead_ms > 0 { "ahead" } else { "behind" }
    )]
    Clock {
        /// The sensor.
        sensor: String,
        /// How far ahead of the others, ms; negative: behind.
        ahead_ms: i64,
    },
    /// They saw somebody at the same time and agree on nothing.
    #[error(
        "`{}` and `{}` both saw somebody for {shared_s} s, but not the same motion: let one person walk alone where \
         both see them whole, check that neither sensor was moved, then repeat",
        .sensors[0], .sensors[1]
    )]
    Strangers {
        /// The two sensors that shared most.
        sensors: [String; 2],
        /// For how long, seconds.
        shared_s: u64,
    },
}

fn seconds(ms: i64) -> String {
    format!("{:.1}", ms.unsigned_abs() as f64 * 1e-3)
}

fn list(names: &[String]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn either(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(" or ")
}

fn in_brackets(groups: &[Vec<String>]) -> String {
    groups
        .iter()
        .map(|names| format!("({})", list(names)))
        .collect::<Vec<_>>()
        .join(" and ")
}
