//! What the engine knows of each sensor, and the way of a frame from its arrival to bodies placed in the room.

use std::collections::VecDeque;

use nalgebra::Vector3;
use posefuse_skeleton::{
    AgentTime, Body, Calibration, Observation, Room, Sensor, SensorInfo, Skeleton, Timestamp,
    Transform,
};
use serde::{Deserialize, Serialize};

use crate::clock::{ClockFilter, Mapped};
use crate::config::{ClockConfig, Config, FuseMethod, ms_to_ns};
use crate::correct::Corrections;
use crate::diagnostics::{REASONS, reason_index};
use crate::gate::{Gate, GateConfig, sanitise};
use crate::ledger::Ledger;
use crate::people::{Placed, median};
use crate::stages::Stage;
use crate::{Rejection, RejectionReason};

/// Frame residuals remembered: 10 s at 30 Hz.
const MAX_RESIDUALS: usize = 300;
/// Share of a new latency in the running one.
const LATENCY_GAIN: f64 = 0.05;

/// Where a sensor stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Place {
    pub(crate) room_from_sensor: Transform<Room, Sensor>,
    /// Added to capture times; never positive.
    time_offset_ns: i64,
    corrections: Corrections,
}

impl Place {
    /// Where `calibration` puts the sensor; `None` where it does not know it, or gives a pose that is
    /// none. Offsets say how sensors' times stand to each other. Taken so that the largest is 0, none moves a frame
    /// beyond the time at which it came.
    pub(crate) fn of(calibration: &Calibration, info: &SensorInfo) -> Option<Self> {
        let pose = calibration.sensors.get(&info.name)?;
        let offsets = calibration.sensors.values().map(|pose| pose.time_offset_ns);
        let largest_ns = offsets.max().unwrap_or(0);
        pose.room_from_sensor.is_finite().then_some(Self {
            room_from_sensor: pose.room_from_sensor,
            time_offset_ns: pose.time_offset_ns.saturating_sub(largest_ns),
            corrections: Corrections::of(calibration, info.joint_set),
        })
    }

    /// Puts right what the tracker is known to report otherwise than meant, as far as `method` does. The mean is
    /// Menard's (2014), who takes joints where the trackers report them along the ray.
    fn correct(&self, skeleton: &mut Skeleton<Sensor>, method: FuseMethod) {
        let rays = method != FuseMethod::Average;
        self.corrections.apply(skeleton, rays);
    }
}

/// One sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SensorState {
    pub(crate) info: SensorInfo,
    pub(crate) clock: ClockFilter,
    pub(crate) place: Option<Place>,
    /// Left out of fusing by a person.
    pub(crate) muted: bool,
    pub(crate) frames: u64,
    pub(crate) used: u64,
    pub(crate) rejected: [u64; REASONS],
    pub(crate) latency_ns: Option<f64>,
    gate: Gate,
    last_captured: Option<AgentTime>,
    last_time: Option<Timestamp>,
    residuals: VecDeque<f32>,
    /// What it contributes to fusing.
    pub(crate) ledger: Ledger,
}

impl SensorState {
    pub(crate) fn new(info: SensorInfo, calibration: Option<&Calibration>) -> Self {
        let mut sensor = Self {
            info,
            clock: ClockFilter::default(),
            place: None,
            muted: false,
            frames: 0,
            used: 0,
            rejected: [0; REASONS],
            latency_ns: None,
            gate: Gate::default(),
            last_captured: None,
            last_time: None,
            residuals: VecDeque::new(),
            ledger: Ledger::default(),
        };
        sensor.put(calibration);
        sensor
    }

    /// Looks itself up in `calibration`; whether it now stands elsewhere.
    pub(crate) fn put(&mut self, calibration: Option<&Calibration>) -> bool {
        let place = calibration.and_then(|c| Place::of(c, &self.info));
        let moved = place != self.place;
        if moved {
            self.residuals.clear();
        }
        self.place = place;
        moved
    }

    /// Where the lens is, room frame, metres.
    pub(crate) fn origin(&self) -> Option<Vector3<f64>> {
        Some(self.place?.room_from_sensor.origin().vector())
    }

    /// The capture time of `observation` in the server's clock, or why the frame cannot be used.
    pub(crate) fn admit(
        &mut self,
        observation: &Observation,
        config: &ClockConfig,
    ) -> Result<(Timestamp, Place), RejectionReason> {
        self.frames += 1;
        let captured = observation.captured;
        let back_ns = self.last_captured.map_or(0, |last| last.since_ns(captured));
        let time = match self.clock.map_frame(captured, observation.received, config) {
            Mapped::At(time) => time,
            Mapped::Unknown => return Err(RejectionReason::ClockUnknown),
            Mapped::Stepped => return Err(RejectionReason::ClockStep),
        };
        let place = self.place.ok_or(RejectionReason::Uncalibrated)?;
        let time = time.plus_ns(place.time_offset_ns);
        if self.last_time.is_some_and(|last| time <= last) {
            let stepped = back_ns >= ms_to_ns(config.step_ms);
            return Err(if stepped {
                RejectionReason::ClockStep
            } else {
                RejectionReason::OutOfOrder
            });
        }
        self.last_time = Some(time);
        self.last_captured = Some(captured);
        let latency_ns = observation.received.since_ns(time) as f64;
        let running = self.latency_ns.get_or_insert(latency_ns);
        *running += LATENCY_GAIN * (latency_ns - *running);
        Ok((time, place))
    }

    /// Cleans and gates the bodies of `observation` and puts what is left into the room. False if every body
    /// only repeated the last frame.
    pub(crate) fn place_bodies(
        &mut self,
        observation: &mut Observation,
        time: Timestamp,
        place: &Place,
        config: &Config,
        placed: &mut Vec<Placed>,
        reject: &mut dyn FnMut(Rejection),
    ) -> bool {
        let rejection = |reason, joint| Rejection {
            sensor: observation.sensor,
            time: observation.received,
            reason,
            joint,
        };
        let gate = gate(&config.stages);
        placed.clear();
        let mut fresh = observation.bodies.is_empty();
        if observation.bodies.len() > Observation::MAX_BODIES {
            observation.bodies.truncate(Observation::MAX_BODIES);
            reject(rejection(RejectionReason::TooManyBodies, None));
        }
        for body in &mut observation.bodies {
            sanitise(&mut body.skeleton, |reason, joint| {
                reject(rejection(reason, Some(joint)))
            });
            let passed = gate.is_none_or(|gate| {
                self.gate.pass(body, time, gate, |reason, joint| {
                    reject(rejection(reason, joint))
                })
            });
            if !passed {
                continue;
            }
            fresh = true;
            place.correct(&mut body.skeleton, config.fuse.method);
            let mut there = Placed {
                tracking_id: body.tracking_id,
                ..Placed::default()
            };
            for (joint, state) in body.skeleton.iter() {
                let position = place.room_from_sensor.apply(state.position).vector();
                there
                    .body
                    .set(joint as usize, position, state.confidence.get());
            }
            there.body.hands_closed = body.hands_closed.map(|closed| closed.map(|p| p.get()));
            placed.push(there);
        }
        self.used += u64::from(fresh);
        fresh
    }

    /// What [`Self::admit`] and [`Self::place_bodies`] would make of `observation`, but for what they refuse: its time
    /// and its bodies in the room.
    pub(crate) fn locate(
        &self,
        observation: &Observation,
        config: &Config,
    ) -> Option<(Timestamp, Vec<Skeleton<Room>>)> {
        let place = self.place?;
        let time = self.clock.map(observation.captured)?;
        let body = |body: &Body| {
            let mut skeleton = body.skeleton.clone();
            place.correct(&mut skeleton, config.fuse.method);
            skeleton.transformed(&place.room_from_sensor)
        };
        let bodies = observation.bodies.iter().map(body).collect();
        Some((time.plus_ns(place.time_offset_ns), bodies))
    }

    pub(crate) fn count(&mut self, reason: RejectionReason) {
        let count = &mut self.rejected[reason_index(reason)];
        *count = count.saturating_add(1);
    }

    /// Adds one frame's median distance to the fused person, metres.
    pub(crate) fn add_residual(&mut self, residual_m: f64) {
        if self.residuals.len() == MAX_RESIDUALS {
            self.residuals.pop_front();
        }
        self.residuals.push_back(residual_m as f32);
    }

    /// Median of the remembered frames' medians, metres.
    pub(crate) fn residual_m(&self) -> Option<f64> {
        let mut values: Vec<f64> = self.residuals.iter().map(|v| f64::from(*v)).collect();
        median(&mut values)
    }
}

/// The gate's settings, if it is on.
fn gate(stages: &[Stage]) -> Option<&GateConfig> {
    stages.iter().find_map(|stage| match stage {
        Stage::Gate(gate) if gate.enabled => Some(gate),
        _ => None,
    })
}
