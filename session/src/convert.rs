//! What a take holds to and from its bytes. Inputs come back bit for bit: a take is fused again to the same frames.

mod repair;

use std::sync::Arc;

use posefuse_fusion::{ClockSample, Input, Rejection};
use posefuse_proto::{
    calibration_from_wire, calibration_to_wire, observation_from_wire, observation_to_wire,
    room_frame_from_wire, sensor_info_from_wire, sensor_info_to_wire, v1,
};
use posefuse_skeleton::{AgentTime, JOINT_COUNT, Position, SensorId, Timestamp};
use prost::Message;
use v1::engine_input::Input as Wire;

use crate::error::ContentError;
use crate::{EngineState, Event, Recorded, RecordedRejection, Topic, TruePerson, Truth};

/// An input as a take holds it.
pub fn input_to_bytes(input: &Input) -> Vec<u8> {
    let wire = match input {
        Input::Sensor(info) => Wire::Sensor(sensor_info_to_wire(info)),
        Input::Observation(observation) => Wire::Observation(observation_to_wire(observation)),
        Input::ClockSample(sample) => Wire::ClockSample(clock_sample_to_wire(sample)),
        Input::Calibration(calibration) => Wire::Calibration(calibration_to_wire(calibration)),
        Input::Mute { sensor, muted } => Wire::Mute(v1::SensorMute {
            sensor: sensor.index() as u32,
            muted: *muted,
        }),
        Input::RepairModel(model) => Wire::RepairModel(repair::model_to_wire(model.as_ref())),
        Input::Repaired(answer) => Wire::Repaired(repair::answer_to_wire(answer)),
        Input::Tick(time) => Wire::TickNs(time.ns()),
    };
    v1::EngineInput { input: Some(wire) }.encode_to_vec()
}

/// An input from a take, checked. The error says what is wrong with it.
pub fn input_from_bytes(bytes: &[u8]) -> Result<Input, String> {
    match engine_input(bytes) {
        Ok(Recorded::Input(input)) => Ok(input),
        Ok(_) => Err("an engine's state is no input".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

pub(crate) fn state_to_bytes(state: &EngineState) -> Vec<u8> {
    let wire = v1::EngineState {
        build: state.build.clone(),
        state: state.state.clone(),
    };
    v1::EngineInput {
        input: Some(Wire::State(wire)),
    }
    .encode_to_vec()
}

pub(crate) fn rejection_to_bytes(rejection: &Rejection) -> Vec<u8> {
    v1::Rejection {
        sensor: rejection.sensor.index() as u32,
        time_ns: rejection.time.ns(),
        reason: rejection.reason.name().to_owned(),
        joint: rejection.joint.map(|joint| joint.name().to_owned()),
    }
    .encode_to_vec()
}

pub(crate) fn event_to_bytes(event: &Event) -> Vec<u8> {
    v1::Event {
        time_ns: event.time_ns,
        kind: event.kind.clone(),
        sensor: event.sensor.clone(),
        text: event.text.clone(),
        count: event.count,
    }
    .encode_to_vec()
}

pub(crate) fn truth_to_bytes(truth: &Truth) -> Vec<u8> {
    let person = |person: &TruePerson| v1::TruePerson {
        id: person.id,
        positions: person
            .joints
            .iter()
            .flat_map(|joint| joint.vector().data.0[0].map(|v| v as f32))
            .collect(),
    };
    v1::Truth {
        time_ns: truth.time.ns(),
        people: truth.people.iter().map(person).collect(),
    }
    .encode_to_vec()
}

/// A message of a topic, checked.
pub(crate) fn recorded(topic: Topic, bytes: &[u8]) -> Result<Recorded, ContentError> {
    Ok(match topic {
        Topic::Inputs => engine_input(bytes)?,
        Topic::Frames => Recorded::Frame(room_frame_from_wire(&v1::RoomFrame::decode(bytes)?)?),
        Topic::Rejections => Recorded::Rejection(rejection(v1::Rejection::decode(bytes)?)),
        Topic::Events => Recorded::Event(event(v1::Event::decode(bytes)?)),
        Topic::Truth => Recorded::Truth(truth(&v1::Truth::decode(bytes)?)?),
        Topic::Scene | Topic::Transforms => Recorded::View,
    })
}

fn engine_input(bytes: &[u8]) -> Result<Recorded, ContentError> {
    let wire = v1::EngineInput::decode(bytes)?
        .input
        .ok_or(ContentError::Empty)?;
    Ok(Recorded::Input(match wire {
        Wire::Sensor(info) => Input::Sensor(sensor_info_from_wire(&info)?),
        Wire::Observation(seen) => Input::Observation(observation_from_wire(&seen)?),
        Wire::ClockSample(sample) => Input::ClockSample(clock_sample_from_wire(&sample)?),
        Wire::Calibration(wire) => Input::Calibration(Arc::new(calibration_from_wire(&wire)?)),
        Wire::Mute(wire) => Input::Mute {
            sensor: SensorId::new(wire.sensor as usize).map_err(posefuse_proto::WireError::from)?,
            muted: wire.muted,
        },
        Wire::RepairModel(wire) => Input::RepairModel(repair::model_from_wire(wire)),
        Wire::Repaired(wire) => Input::Repaired(Box::new(repair::answer_from_wire(&wire)?)),
        Wire::TickNs(ns) => Input::Tick(Timestamp::from_ns(ns)),
        Wire::State(v1::EngineState { build, state }) => {
            return Ok(Recorded::State(EngineState { build, state }));
        }
    }))
}

fn clock_sample_to_wire(sample: &ClockSample) -> v1::ClockSample {
    v1::ClockSample {
        sensor: sample.sensor.index() as u32,
        sent_ns: sample.sent.ns(),
        returned_ns: sample.returned.ns(),
        agent_received_ns: sample.agent_received.ns(),
        agent_sent_ns: sample.agent_sent.ns(),
    }
}

fn clock_sample_from_wire(wire: &v1::ClockSample) -> Result<ClockSample, ContentError> {
    let sensor = SensorId::new(wire.sensor as usize);
    Ok(ClockSample {
        sensor: sensor.map_err(posefuse_proto::WireError::from)?,
        sent: Timestamp::from_ns(wire.sent_ns),
        returned: Timestamp::from_ns(wire.returned_ns),
        agent_received: AgentTime::from_ns(wire.agent_received_ns),
        agent_sent: AgentTime::from_ns(wire.agent_sent_ns),
    })
}

fn rejection(wire: v1::Rejection) -> RecordedRejection {
    RecordedRejection {
        sensor: wire.sensor,
        time: Timestamp::from_ns(wire.time_ns),
        reason: wire.reason,
        joint: wire.joint,
    }
}

fn event(wire: v1::Event) -> Event {
    Event {
        time_ns: wire.time_ns,
        kind: wire.kind,
        sensor: wire.sensor,
        text: wire.text,
        count: wire.count,
    }
}

fn truth(wire: &v1::Truth) -> Result<Truth, ContentError> {
    let person = |person: &v1::TruePerson| {
        let found = person.positions.len();
        if found != 3 * JOINT_COUNT {
            let problem = format!("person {}: 75 numbers are needed, found {found}", person.id);
            return Err(ContentError::Value(problem));
        }
        let at = |joint: usize, axis: usize| f64::from(person.positions[3 * joint + axis]);
        let joints =
            std::array::from_fn(|joint| Position::new(at(joint, 0), at(joint, 1), at(joint, 2)));
        Ok(TruePerson {
            id: person.id,
            joints,
        })
    };
    Ok(Truth {
        time: Timestamp::from_ns(wire.time_ns),
        people: wire.people.iter().map(person).collect::<Result<_, _>>()?,
    })
}
