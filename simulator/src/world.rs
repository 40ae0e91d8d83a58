//! The simulated room: people, sensors, and the truth about both.

use posefuse_skeleton::{
    Calibration, FloorSource, JointMap, Position, Room, Sensor, SensorPose, Transform,
};
use thiserror::Error;

use std::sync::Arc;

use crate::motion::{Cast, Clip, Performance};
use crate::scenario::{Scenario, ScenarioError, check};
use crate::sensor::{SimClock, room_from_sensor};

/// A room that can be asked where everything truly is. Immutable; share it in an [`Arc`].
#[derive(Clone, Debug)]
pub struct World {
    scenario: Scenario,
    performance: Performance,
    sensors: Vec<Mount>,
}

#[derive(Clone, Debug)]
struct Mount {
    name: String,
    room_from_sensor: Transform<Room, Sensor>,
    clock: SimClock,
}

/// Why there is no such room.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WorldError {
    /// The scenario is not possible.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Where a person truly is.
#[derive(Clone, Debug, PartialEq)]
pub struct TruePerson {
    /// Who: 1 for the first person.
    pub id: u64,
    /// The joints, room metres.
    pub joints: JointMap<Position<Room>>,
}

impl World {
    /// A room with the scenario's procedural people.
    pub fn new(scenario: &Scenario) -> Result<Self, WorldError> {
        scenario.validate()?;
        let performance = Performance::procedural(Cast {
            seed: scenario.seed,
            people: scenario.people,
            area_m: scenario.area_m,
            hugs: scenario.hugs,
            situation: scenario.situation,
            away_s: scenario.away_s,
        });
        Ok(Self::with_performance(scenario, performance))
    }

    /// A room in which each clip is a person; what the scenario says of people is not used.
    pub fn with_clips(
        scenario: &Scenario,
        clips: impl IntoIterator<Item = Arc<Clip>>,
    ) -> Result<Self, WorldError> {
        scenario.validate()?;
        let performance = Performance::from_clips(clips);
        let people = performance.people();
        check(people <= Scenario::MAX_PEOPLE, "clips", "at most 8", people)?;
        Ok(Self::with_performance(scenario, performance))
    }

    fn with_performance(scenario: &Scenario, performance: Performance) -> Self {
        let mount = |index: usize| Mount {
            name: format!("sim{}", index + 1),
            room_from_sensor: room_from_sensor(scenario, index),
            clock: SimClock::new(scenario.seed, index, &scenario.errors),
        };
        Self {
            scenario: scenario.clone(),
            performance,
            sensors: (0..scenario.sensors).map(mount).collect(),
        }
    }

    /// What the room was made from.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The people's motion.
    pub fn performance(&self) -> &Performance {
        &self.performance
    }

    /// Everybody who is in the room `seconds` after the scenario's start, in order of their ids.
    pub fn truth(&self, seconds: f64) -> Vec<TruePerson> {
        let person = |index: usize| TruePerson {
            id: index as u64 + 1,
            joints: self.performance.pose(index, seconds),
        };
        (0..self.performance.people())
            .filter(|&index| self.performance.present(index, seconds))
            .map(person)
            .collect()
    }

    /// How many sensors the room has.
    pub fn sensor_count(&self) -> usize {
        self.sensors.len()
    }

    /// The name of sensor `index`: `sim1`, `sim2` ...
    ///
    /// # Panics
    /// Here and below if `index` is not below [`World::sensor_count`].
    pub fn sensor_name(&self, index: usize) -> &str {
        &self.sensors[index].name
    }

    /// The number of the sensor with this name.
    pub fn sensor_index(&self, name: &str) -> Option<usize> {
        self.sensors.iter().position(|mount| mount.name == name)
    }

    /// Where sensor `index` truly stands.
    pub fn room_from_sensor(&self, index: usize) -> Transform<Room, Sensor> {
        self.sensors[index].room_from_sensor
    }

    /// Where all sensors truly stand, as a calibration without a date.
    pub fn true_calibration(&self) -> Calibration {
        let pose = |mount: &Mount| {
            let pose = SensorPose {
                room_from_sensor: mount.room_from_sensor,
                time_offset_ns: 0,
                residual_median_m: 0.0,
                residual_p95_m: 0.0,
                samples: 0,
                ..SensorPose::default()
            };
            (mount.name.clone(), pose)
        };
        Calibration {
            created: String::new(),
            method: "truth".to_owned(),
            floor: FloorSource::Manual,
            sensors: self.sensors.iter().map(pose).collect(),
            ..Calibration::default()
        }
    }

    /// The clock of the agent of sensor `index`, as it truly is.
    pub fn sensor_clock(&self, index: usize) -> SimClock {
        self.sensors[index].clock
    }
}
