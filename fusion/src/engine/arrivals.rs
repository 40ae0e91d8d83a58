//! What comes in: greetings, calibrations, clock probes, and observations on their way to the people.

use std::sync::Arc;

use posefuse_skeleton::{Calibration, Observation, SensorId, SensorInfo};

use super::{Engine, put};
use crate::ledger::Ledger;
use crate::sensors::SensorState;
use crate::{ClockSample, Output, Rejection, RejectionReason};

impl Engine {
    pub(super) fn sensor(&self, id: SensorId) -> Option<&SensorState> {
        self.state.sensors.get(id.index())?.as_ref()
    }

    fn sensor_mut(&mut self, id: SensorId) -> Option<&mut SensorState> {
        self.state.sensors.get_mut(id.index())?.as_mut()
    }

    pub(super) fn greet(&mut self, info: SensorInfo) {
        let id = info.id;
        if self.state.sensors.len() <= id.index() {
            self.state.sensors.resize(id.index() + 1, None);
        }
        match &mut self.state.sensors[id.index()] {
            Some(known) if known.info.name == info.name => known.info = info,
            slot => {
                *slot = Some(SensorState::new(info, self.state.calibration.as_deref()));
                self.state.people.forget_sensor(id);
            }
        }
        self.note_origins();
    }

    pub(super) fn calibrate(&mut self, calibration: Arc<Calibration>) {
        let mut moved = false;
        for sensor in self.state.sensors.iter_mut().flatten() {
            let was_placed = sensor.place.is_some();
            moved |= sensor.put(Some(&calibration)) && was_placed;
        }
        self.state.calibration = Some(calibration);
        if moved {
            self.release(0);
            self.state.people.uproot();
            self.state.pipeline.restart_all();
            self.repair(|repair, at, out| repair.restart(None, at, out));
        }
        self.note_origins();
    }

    pub(super) fn mute(&mut self, id: SensorId, muted: bool) {
        if let Some(sensor) = self.sensor_mut(id) {
            sensor.muted = muted;
            sensor.ledger = Ledger::default();
            if muted {
                self.state.people.forget_sensor(id);
            }
        }
    }

    pub(super) fn probe(&mut self, sample: &ClockSample) {
        self.advance(sample.returned);
        let config = self.config.clock;
        if let Some(sensor) = self.sensor_mut(sample.sensor) {
            sensor.clock.add(sample, &config);
        }
    }

    pub(super) fn observe(&mut self, mut observation: Observation) {
        self.advance(observation.received);
        let id = observation.sensor;
        let clock = self.config.clock;
        let admitted = match self.sensor_mut(id) {
            Some(sensor) => sensor.admit(&observation, &clock),
            None => Err(RejectionReason::UnknownSensor),
        };
        let (time, place) = match admitted {
            Ok(admitted) => admitted,
            Err(reason) => return self.reject_frame(&observation, reason),
        };
        let muted = self.sensor(id).is_some_and(|sensor| sensor.muted);
        let intake = &mut self.state.intake;
        // Nobody waits for a sensor that is left out.
        if !muted {
            intake.arrived(id, time, observation.received, &self.config.intake);
        }
        if intake.is_late(time, &self.config.intake) {
            return self.reject_frame(&observation, RejectionReason::Late);
        }
        let Some(sensor) = self
            .state
            .sensors
            .get_mut(id.index())
            .and_then(Option::as_mut)
        else {
            return;
        };
        let outputs = &mut self.state.outputs;
        let mut rejected = [0_u64; crate::diagnostics::REASONS];
        let fresh = sensor.place_bodies(
            &mut observation,
            time,
            &place,
            &self.config,
            &mut self.placed,
            &mut |rejection| {
                rejected[crate::diagnostics::reason_index(rejection.reason)] += 1;
                put(outputs, Output::Rejected(rejection));
            },
        );
        for (total, new) in sensor.rejected.iter_mut().zip(rejected) {
            *total = total.saturating_add(new);
        }
        if !fresh || muted {
            return;
        }
        let origin = place.room_from_sensor.origin().vector();
        self.state
            .people
            .observe(id, origin, time, &self.placed, &self.config);
        self.state.people.watch(id, &place.room_from_sensor, time);
        let now = observation.received;
        self.state
            .intake
            .delivered(id, time, now, &self.config.intake);
    }

    fn reject_frame(&mut self, observation: &Observation, reason: RejectionReason) {
        if let Some(sensor) = self.sensor_mut(observation.sensor) {
            sensor.count(reason);
        }
        let rejection = Rejection {
            sensor: observation.sensor,
            time: observation.received,
            reason,
            joint: None,
        };
        put(&mut self.state.outputs, Output::Rejected(rejection));
    }
}
