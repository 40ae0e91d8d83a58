//! A small room for tests: four sensors around people who walk in circles, the engine, and a recorder.
#![allow(dead_code, unreachable_pub, clippy::new_without_default)]

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_fusion::{ClockSample, Config, Engine, Input, Output};
use posefuse_proto::{agent_body, bodies_from_agent};
use posefuse_session::{EngineState, Storage, TakeHeader, TakeInfo, TakeOptions, TakeWriter};
use posefuse_skeleton::{
    AgentTime, Calibration, Confidence, FloorSource, Joint, JointSet, Observation, Position,
    RawJoint, Room, RoomFrame, Sensor, SensorId, SensorInfo, SensorPose, TimecodeRate,
    TimecodeZone, Timestamp, Transform, calibration_text,
};

/// 2026-01-01T00:00:00Z minus the server clock's start.
pub const UNIX_OFFSET_NS: i64 = 1_767_225_600_000_000_000;
pub const BUILD: &str = "test-build";
const SENSORS: usize = 4;
const PERIOD_NS: i64 = 33_333_333;

/// A joint's place in a person who stands at the origin and looks along x, metres.
fn rest(joint: Joint) -> Vector3<f64> {
    use Joint::*;
    let (y, z) = match joint {
        SpineBase => (0.0, 0.95),
        SpineMid => (0.0, 1.15),
        SpineShoulder => (0.0, 1.4),
        Neck => (0.0, 1.48),
        Head => (0.0, 1.65),
        ShoulderLeft => (0.18, 1.38),
        ElbowLeft => (0.22, 1.1),
        WristLeft => (0.24, 0.86),
        HandLeft => (0.24, 0.78),
        HandTipLeft => (0.24, 0.7),
        ThumbLeft => (0.2, 0.8),
        HipLeft => (0.09, 0.9),
        KneeLeft => (0.1, 0.5),
        AnkleLeft => (0.1, 0.1),
        FootLeft => (0.1, 0.03),
        right => return rest(right.mirrored()).component_mul(&Vector3::new(1.0, -1.0, 1.0)),
    };
    Vector3::new(0.0, y, z)
}

pub fn person_at(person: usize, time: Timestamp, joint: Joint) -> Position<Room> {
    let phase = time.seconds() * 0.8 + person as f64 * 3.1;
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, phase + 1.57);
    let centre = Vector3::new(0.9 * phase.cos(), 0.9 * phase.sin(), 0.0);
    let swing = Vector3::new(0.1 * (5.0 * phase + joint as u8 as f64).sin(), 0.0, 0.0);
    Position::from_vector(centre + turn * (rest(joint) + swing))
}

pub fn sensor(index: usize) -> SensorId {
    SensorId::new(index).unwrap()
}

/// Sensors at the corners of a square, 3 m from its middle, looking in.
pub fn calibration() -> Calibration {
    let pose = |index: usize| {
        let angle = std::f64::consts::FRAC_PI_2 * index as f64 + 0.4;
        let back = Vector3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.2);
        // Optical axes in a level room: z looks at the middle, x right, y down.
        let level = UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix(
            &nalgebra::Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
        ));
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, angle + std::f64::consts::PI);
        SensorPose {
            room_from_sensor: Transform::from_parts(back, turn * level),
            time_offset_ns: 0,
            residual_median_m: 0.01 + index as f64 * 1e-3,
            residual_p95_m: 0.03,
            samples: 500,
            ..SensorPose::default()
        }
    };
    Calibration {
        created: "2026-01-01T00:00:00Z".into(),
        method: "test".into(),
        floor: FloorSource::Walk,
        sensors: (0..SENSORS)
            .map(|index| (format!("cam{index}"), pose(index)))
            .collect(),
        ..Calibration::default()
    }
}

/// A calibration as a take's attachment gives it back.
pub fn as_file(calibration: &Calibration) -> Calibration {
    calibration_text::from_toml(&calibration_text::to_toml(calibration)).unwrap()
}

fn observation(index: usize, sequence: u64, time: Timestamp, people: usize) -> Observation {
    let room_from_sensor: Transform<Room, Sensor> =
        calibration().sensors[&format!("cam{index}")].room_from_sensor;
    let body = |person: usize| {
        let joints = Joint::ALL.map(|joint| {
            // Each sensor misses a joint now and then.
            let missing = (sequence as usize + 7 * joint as usize + 3 * index).is_multiple_of(29);
            let confidence = Confidence::new(if joint as usize % 5 == index {
                0.5
            } else {
                1.0
            })
            .unwrap();
            let position = room_from_sensor
                .inverse()
                .apply(person_at(person, time, joint));
            (!missing).then_some(RawJoint {
                position,
                confidence,
            })
        });
        agent_body(person as u64, &joints)
    };
    let bodies: Vec<_> = (0..people).map(body).collect();
    Observation {
        sensor: sensor(index),
        sequence,
        captured: AgentTime::from_ns(time.ns() + offset_ns(index)),
        received: time.plus_ns(9_000_000 + 500_000 * index as i64),
        bodies: bodies_from_agent(sensor(index), JointSet::KinectV2, &bodies).unwrap(),
    }
}

/// Agent clock minus server clock.
fn offset_ns(index: usize) -> i64 {
    1_000_000_000 * (index as i64 * 37 - 50)
}

/// What arrives at a server in `seconds`, in order of arrival, ticks left out.
pub fn arrivals(seconds: f64, people: usize) -> Vec<Input> {
    let mut arrivals: Vec<(i64, Input)> = Vec::new();
    for index in 0..SENSORS {
        let info = SensorInfo {
            id: sensor(index),
            name: format!("cam{index}"),
            model: "Kinect v2".into(),
            joint_set: JointSet::KinectV2,
        };
        arrivals.push((0, Input::Sensor(info)));
        for second in 0..=(seconds * 4.0) as i64 {
            let sent = Timestamp::from_ns(second * 250_000_000 + 1_000 * index as i64);
            let agent = AgentTime::from_ns(sent.ns() + 400_000 + offset_ns(index));
            let returned = sent.plus_ns(800_000);
            arrivals.push((
                returned.ns(),
                Input::ClockSample(ClockSample {
                    sensor: sensor(index),
                    sent,
                    returned,
                    agent_received: agent,
                    agent_sent: agent,
                }),
            ));
        }
        let frames = (seconds * 1e9) as i64 / PERIOD_NS;
        for sequence in 1..frames {
            let time = Timestamp::from_ns(sequence * PERIOD_NS + 7_000_000 * index as i64);
            let seen = observation(index, sequence as u64, time, people);
            arrivals.push((seen.received.ns(), Input::Observation(seen)));
        }
    }
    arrivals.push((1, Input::Calibration(Arc::new(calibration()))));
    arrivals.sort_by_key(|(time, _)| *time);
    arrivals.into_iter().map(|(_, input)| input).collect()
}

pub fn time_of(input: &Input) -> Timestamp {
    match input {
        Input::Observation(seen) => seen.received,
        Input::ClockSample(sample) => sample.returned,
        Input::Tick(time) => *time,
        Input::Repaired(answer) => answer.received,
        _ => Timestamp::ZERO,
    }
}

pub fn header(name: &str, start: Timestamp) -> TakeHeader {
    TakeHeader {
        name: name.into(),
        slate: "12A".into(),
        notes: "two turns,\n\"then\" a wave".into(),
        started: "2026-01-01T10:00:00Z".into(),
        start: Some(start),
        unix_offset_ns: UNIX_OFFSET_NS,
        timecode: Some(TimecodeZone {
            rate: TimecodeRate::Fps29Drop,
            utc_offset_s: -3600,
        }),
        config_toml: toml::to_string_pretty(&Config::default()).unwrap(),
        calibration: Some(calibration()),
        build: BUILD.into(),
    }
}

/// What a live room consumed and gave.
#[derive(Default)]
pub struct Live {
    pub inputs: Vec<Input>,
    pub frames: Vec<RoomFrame>,
    pub info: Option<TakeInfo>,
}

/// A room that records `name` from server time `from` on; `from` 0 is before everything.
pub struct Recorder {
    pub engine: Engine,
    pub writer: Option<TakeWriter>,
    pub live: Live,
}

impl Recorder {
    pub fn new() -> Self {
        Self {
            engine: Engine::new(Config::default()),
            writer: None,
            live: Live::default(),
        }
    }

    pub fn begin(
        &mut self,
        storage: &Arc<dyn Storage>,
        name: &str,
        now: Timestamp,
        options: TakeOptions,
    ) {
        let state = EngineState {
            build: BUILD.into(),
            state: self.engine.state().unwrap(),
        };
        let preamble = self.engine.preamble();
        let writer =
            TakeWriter::create_with(storage, header(name, now), &preamble, Some(&state), options);
        self.writer = Some(writer.unwrap());
    }

    /// Gives an input and what the engine asks for before it.
    pub fn arrive(&mut self, input: Input) {
        let now = time_of(&input);
        while let Output::WakeAt(Some(wake)) = self.engine.poll() {
            if wake > now {
                break;
            }
            self.give(Input::Tick(wake));
        }
        self.give(input);
    }

    /// What the engine consumes when `input` arrives, and the frames it gives after each; nothing is recorded.
    pub fn steps(&mut self, input: Input) -> Vec<(Input, Vec<RoomFrame>)> {
        let now = time_of(&input);
        let mut steps = Vec::new();
        while let Output::WakeAt(Some(wake)) = self.engine.poll() {
            if wake > now {
                break;
            }
            steps.push(self.step(Input::Tick(wake)));
        }
        steps.push(self.step(input));
        steps
    }

    fn step(&mut self, input: Input) -> (Input, Vec<RoomFrame>) {
        self.engine.handle(input.clone());
        let mut frames = Vec::new();
        loop {
            match self.engine.poll() {
                Output::Frame(frame) => frames.push(frame),
                Output::Rejected(_) | Output::Repair(_) => {}
                Output::WakeAt(_) => return (input, frames),
            }
        }
    }

    fn give(&mut self, input: Input) {
        if let Some(writer) = &mut self.writer {
            writer.input(&input).unwrap();
            self.live.inputs.push(input.clone());
        }
        let now = time_of(&input);
        self.engine.handle(input);
        loop {
            match self.engine.poll() {
                Output::Frame(frame) => {
                    if let Some(writer) = &mut self.writer {
                        writer.frame(&frame).unwrap();
                        self.live.frames.push(frame);
                    }
                }
                Output::Rejected(rejection) => {
                    if let Some(writer) = &mut self.writer {
                        writer.rejection(&rejection).unwrap();
                    }
                }
                Output::Repair(_) => {}
                Output::WakeAt(_) => break,
            }
        }
        if let Some(writer) = &mut self.writer {
            writer.flush(now).unwrap();
        }
    }
}

/// Records `seconds` of `people`, the recorder switched on at server time `from`.
pub fn record(
    storage: &Arc<dyn Storage>,
    name: &str,
    from: f64,
    seconds: f64,
    people: usize,
) -> Live {
    let options = TakeOptions {
        min_free_bytes: 0,
        ..TakeOptions::default()
    };
    let mut recorder = Recorder::new();
    let from = Timestamp::from_seconds(from);
    for input in arrivals(seconds, people) {
        if recorder.writer.is_none() && time_of(&input) >= from {
            recorder.begin(storage, name, from, options);
        }
        recorder.arrive(input);
    }
    let info = recorder.writer.take().unwrap().finish().unwrap();
    recorder.live.info = Some(info);
    recorder.live
}
