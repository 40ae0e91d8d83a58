//! Whatever comes in, nothing panics, and nothing but numbers a room can hold comes out.

#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use posefuse_fusion::{
    ClockSample, Config, Engine, Input, IntakeMode, Output, RejectionReason, Stage,
};
use posefuse_skeleton::{
    AgentTime, Body, Calibration, Confidence, Joint, JointSet, JointState, Observation, Position,
    Provenance, RoomFrame, SensorInfo, SensorPose, SensorSet, Skeleton, Timestamp, Transform,
};
use proptest::prelude::*;
use support::id;

/// Mostly sensible numbers, and every kind of senseless one.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -4.0..4.0_f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(f64::NEG_INFINITY),
        1 => any::<f64>(),
        1 => Just(1e308),
    ]
}

/// Mostly times within a few seconds, and every kind of absurd one.
fn time_ns() -> impl Strategy<Value = i64> {
    prop_oneof![
        12 => 0..5_000_000_000_i64,
        1 => any::<i64>(),
        1 => Just(i64::MAX),
        1 => Just(i64::MIN),
    ]
}

fn body() -> impl Strategy<Value = Body> {
    let joint = (number(), number(), number(), -0.5..1.5_f32);
    (
        0..4_u64,
        prop::collection::vec(prop::option::weighted(0.8, joint), 25),
    )
        .prop_map(|(tracking_id, joints)| Body {
            tracking_id,
            skeleton: Joint::ALL
                .into_iter()
                .zip(joints)
                .filter_map(|(joint, state)| {
                    let (x, y, z, confidence) = state?;
                    let state = JointState {
                        position: Position::new(x, y, z.abs()),
                        covariance: Matrix3::from_element(x),
                        confidence: Confidence::saturating(confidence),
                        provenance: Provenance::Measured(SensorSet::EMPTY),
                    };
                    Some((joint, state))
                })
                .collect::<Skeleton<_>>(),
            orientations: None,
            hands_closed: [None; 2],
        })
}

fn input() -> impl Strategy<Value = Input> {
    let sensor = 0..3_usize;
    let info = (sensor.clone(), 0..4_usize).prop_map(|(sensor, name)| {
        Input::Sensor(SensorInfo {
            id: id(sensor),
            name: format!("s{name}"),
            model: String::new(),
            joint_set: JointSet::ALL[0],
        })
    });
    let observation = (
        sensor.clone(),
        any::<u64>(),
        time_ns(),
        time_ns(),
        prop::collection::vec(body(), 0..3),
    )
        .prop_map(|(sensor, sequence, captured, received, bodies)| {
            Input::Observation(Observation {
                sensor: id(sensor),
                sequence,
                captured: AgentTime::from_ns(captured),
                received: Timestamp::from_ns(received),
                bodies,
            })
        });
    let probe =
        (sensor, time_ns(), time_ns(), time_ns(), time_ns()).prop_map(|(sensor, a, b, c, d)| {
            Input::ClockSample(ClockSample {
                sensor: id(sensor),
                sent: Timestamp::from_ns(a),
                returned: Timestamp::from_ns(b),
                agent_received: AgentTime::from_ns(c),
                agent_sent: AgentTime::from_ns(d),
            })
        });
    let calibration = (prop::collection::vec((number(), number(), number(), time_ns()), 0..4))
        .prop_map(|poses| {
            let sensors = poses
                .into_iter()
                .enumerate()
                .map(|(index, (x, y, z, offset))| {
                    let pose = SensorPose {
                        room_from_sensor: Transform::from_parts(
                            Vector3::new(x, y, z),
                            UnitQuaternion::identity(),
                        ),
                        time_offset_ns: offset,
                        residual_median_m: x,
                        residual_p95_m: y,
                        samples: 0,
                        ..SensorPose::default()
                    };
                    (format!("s{index}"), pose)
                });
            Input::Calibration(Arc::new(Calibration {
                sensors: sensors.collect(),
                ..Calibration::default()
            }))
        });
    prop_oneof![
        1 => info,
        10 => observation,
        2 => probe,
        1 => calibration,
        2 => time_ns().prop_map(|ns| Input::Tick(Timestamp::from_ns(ns))),
    ]
}

/// A working room of three sensors, so that the garbage after it gets everywhere.
fn warm_up() -> Vec<Input> {
    let mut inputs = Vec::new();
    for index in 0..3 {
        inputs.push(Input::Sensor(SensorInfo {
            id: id(index),
            name: format!("s{index}"),
            model: String::new(),
            joint_set: JointSet::ALL[0],
        }));
        inputs.push(Input::ClockSample(ClockSample {
            sensor: id(index),
            sent: Timestamp::from_ns(1000),
            returned: Timestamp::from_ns(2000),
            agent_received: AgentTime::from_ns(1400),
            agent_sent: AgentTime::from_ns(1500),
        }));
    }
    let pose = SensorPose {
        room_from_sensor: Transform::identity(),
        time_offset_ns: 0,
        residual_median_m: 0.0,
        residual_p95_m: 0.0,
        samples: 0,
        ..SensorPose::default()
    };
    let sensors = (0..3).map(|index| (format!("s{index}"), pose.clone()));
    inputs.push(Input::Calibration(Arc::new(Calibration {
        sensors: sensors.collect(),
        ..Calibration::default()
    })));
    inputs
}

fn check(frame: &RoomFrame, last: Option<Timestamp>) -> Result<(), TestCaseError> {
    prop_assert!(
        last.is_none_or(|last| frame.time > last),
        "frame times go back"
    );
    for track in &frame.tracks {
        for (joint, state) in track.skeleton.iter() {
            prop_assert!(
                state.position.is_finite(),
                "{joint} at {:?}",
                state.position
            );
            prop_assert!(
                state.position.vector().norm() < 1e3,
                "{joint} at {:?}",
                state.position
            );
            prop_assert!(state.covariance.iter().all(|c| c.is_finite()));
            prop_assert!(state.covariance.diagonal().iter().all(|c| *c > 0.0));
        }
    }
    Ok(())
}

fn configs() -> impl Strategy<Value = Config> {
    (any::<bool>(), any::<[bool; 3]>()).prop_map(|(window, on)| {
        let mut config = Config::default();
        config.intake.mode = if window {
            IntakeMode::Window
        } else {
            IntakeMode::Async
        };
        let set = |(stage, on): (&mut Stage, bool)| stage.set_enabled(on);
        config.stages.iter_mut().zip(on).for_each(set);
        config
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn garbage_never_gets_out(config in configs(), garbage in prop::collection::vec(input(), 1..120)) {
        let mut engine = Engine::new(config);
        let mut last = None;
        for input in warm_up().into_iter().chain(garbage) {
            engine.handle(input);
            for step in 0.. {
                prop_assert!(step < 10_000, "poll never ends");
                match engine.poll() {
                    Output::Frame(frame) => {
                        check(&frame, last)?;
                        last = Some(frame.time);
                    }
                    Output::Rejected(_) | Output::Repair(_) => {}
                    Output::WakeAt(_) => break,
                }
            }
        }
        engine.diagnostics();
        engine.state().unwrap();
    }

    #[test]
    fn a_damaged_snapshot_is_an_error_or_an_engine(bytes in prop::collection::vec(any::<u8>(), 0..200), at in 0..100_usize) {
        let mut engine = Engine::new(Config::default());
        warm_up().into_iter().for_each(|input| engine.handle(input));
        let mut state = engine.state().unwrap();
        let end = (at * state.len() / 100 + bytes.len()).min(state.len());
        let start = end - bytes.len().min(end);
        state[start..end].copy_from_slice(&bytes[..end - start]);
        if let Ok(mut engine) = Engine::restore(Config::default(), &state) {
            engine.handle(Input::Tick(Timestamp::from_ns(5)));
            while !matches!(engine.poll(), Output::WakeAt(_)) {}
        }
    }
}

#[test]
fn bodies_beyond_what_a_frame_may_have_are_cut_and_counted() {
    let mut engine = Engine::new(Config::default());
    warm_up().into_iter().for_each(|input| engine.handle(input));
    let joint = |joint: Joint| {
        let at = Position::new(0.0, 0.05 * f64::from(joint as u8), 2.0);
        let state = JointState::measured(at, 0.02, Confidence::FULL, id(0));
        (joint, state)
    };
    let body = |tracking_id| Body {
        tracking_id,
        skeleton: Joint::ALL.into_iter().map(joint).collect(),
        orientations: None,
        hands_closed: [None; 2],
    };
    let people = 40;
    engine.handle(Input::Observation(Observation {
        sensor: id(0),
        sequence: 0,
        captured: AgentTime::from_ns(1_000_000),
        received: Timestamp::from_ns(2_000_000),
        bodies: (0..people).map(body).collect(),
    }));
    let counted = &engine.diagnostics()[0].rejected;
    assert_eq!(counted, &[(RejectionReason::TooManyBodies, 1)]);
}

#[test]
fn outputs_nobody_polls_are_bounded() {
    let mut engine = Engine::new(Config::default());
    for sequence in 0..20_000 {
        engine.handle(Input::Observation(Observation {
            sensor: id(0),
            sequence,
            captured: AgentTime::ZERO,
            received: Timestamp::from_ns(sequence as i64),
            bodies: Vec::new(),
        }));
    }
    let mut count = 0;
    while !matches!(engine.poll(), Output::WakeAt(_)) {
        count += 1;
    }
    assert!(count <= 4096, "{count}");
}
