//! A walk for the solver out of engine inputs: times mapped by the engine itself, as a server does it.

use posefuse_calibration::{Collector, Walk};
use posefuse_fusion::{Config, Engine, Input, Output};
use posefuse_session::TakeReader;
use posefuse_skeleton::SensorInfo;

/// Frames kept per sensor: ten minutes at 30 Hz.
const FRAMES: usize = 18_000;

/// Gathers a walk from inputs as they go by.
pub(crate) struct WalkTap {
    engine: Engine,
    collector: Collector,
}

impl WalkTap {
    /// Gathers from these sensors, with the clock mapping of this configuration.
    pub(crate) fn new<'a>(
        sensors: impl IntoIterator<Item = &'a SensorInfo>,
        config: Config,
    ) -> Self {
        let sensors: Vec<&SensorInfo> = sensors.into_iter().collect();
        let names = sensors.iter().map(|s| (s.id, s.name.clone()));
        let mut collector = Collector::with_limit(names, FRAMES);
        for sensor in sensors {
            collector.set_joint_set(sensor.id, sensor.joint_set);
        }
        Self {
            engine: Engine::new(config),
            collector,
        }
    }

    /// Takes in one input, in the order the engine would.
    pub(crate) fn add(&mut self, input: &Input) {
        match input {
            Input::Observation(observation) => {
                if let Some(time) = self
                    .engine
                    .map_time(observation.sensor, observation.captured)
                {
                    self.collector
                        .add(observation.sensor, time, &observation.bodies);
                }
            }
            // Poses play no part in mapping clocks, and without them nothing is fused, which saves the time.
            Input::Calibration(_)
            | Input::Mute { .. }
            | Input::RepairModel(_)
            | Input::Repaired(_)
            | Input::Tick(_) => {}
            Input::Sensor(_) | Input::ClockSample(_) => {
                self.engine.handle(input.clone());
                while !matches!(self.engine.poll(), Output::WakeAt(_)) {}
            }
        }
    }

    /// What has been gathered.
    pub(crate) fn walk(&self) -> Walk {
        self.collector.walk()
    }
}

/// The walk in a take.
pub(crate) fn walk_of(reader: &TakeReader) -> anyhow::Result<Walk> {
    let (_, preamble) = reader.beginning()?;
    let sensors = reader.sensors()?;
    let mut tap = WalkTap::new(&sensors, Config::default());
    preamble.iter().for_each(|input| tap.add(input));
    for input in reader.inputs() {
        tap.add(&input?);
    }
    Ok(tap.walk())
}
