//! Every input comes back bit for bit.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use posefuse_fusion::{ClockSample, Fill, Input, Needs, RepairAnswer, RepairModel};
use posefuse_proto::{bodies_from_agent, v1};
use posefuse_session::{input_from_bytes, input_to_bytes};
use posefuse_skeleton::{
    AgentTime, Calibration, FloorSource, Joint, JointMap, JointSet, Observation, SensorId,
    SensorInfo, SensorPose, Timestamp, Transform,
};
use proptest::collection::{btree_map, vec};
use proptest::prelude::*;

fn sensor() -> impl Strategy<Value = SensorId> {
    (0..SensorId::MAX_SENSORS).prop_map(|index| SensorId::new(index).unwrap())
}

/// Any float a tracker could send, NaN and infinity among them.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![8 => -9.0f32..9.0, 1 => any::<f32>()]
}

fn body() -> impl Strategy<Value = v1::Body> {
    let confidence = prop_oneof![Just(0.0f32), 0.0f32..=1.0];
    let parts = (
        any::<u64>(),
        vec(coordinate(), 75),
        vec(confidence, 25),
        vec(-1.0f32..1.0, 100),
        any::<bool>(),
        prop_oneof![Just(Vec::new()), vec(-1.0f32..1.0, 2)],
    );
    parts.prop_map(
        |(tracking_id, positions, confidences, orientations, turned, hands_closed)| v1::Body {
            tracking_id,
            positions,
            confidences,
            hands_closed,
            orientations: if turned { orientations } else { Vec::new() },
        },
    )
}

fn observation() -> impl Strategy<Value = Input> {
    let parts = (
        sensor(),
        any::<u64>(),
        any::<i64>(),
        any::<i64>(),
        vec(body(), 0..5),
    );
    parts.prop_map(|(sensor, sequence, captured, received, bodies)| {
        Input::Observation(Observation {
            sensor,
            sequence,
            captured: AgentTime::from_ns(captured),
            received: Timestamp::from_ns(received),
            bodies: bodies_from_agent(sensor, JointSet::KinectV2, &bodies).unwrap(),
        })
    })
}

fn pose() -> impl Strategy<Value = SensorPose> {
    let finite = -1e3..1e3f64;
    let parts = (
        vec(finite, 3),
        vec(-1.0..1.0f64, 4),
        any::<i64>(),
        0.0..1.0f64,
        any::<u64>(),
    );
    parts.prop_map(|(at, turn, time_offset_ns, residual, samples)| {
        let turn = Quaternion::new(turn[0] + 2.0, turn[1], turn[2], turn[3]);
        SensorPose {
            room_from_sensor: Transform::from_parts(
                Vector3::new(at[0], at[1], at[2]),
                UnitQuaternion::new_normalize(turn),
            ),
            time_offset_ns,
            residual_median_m: residual,
            residual_p95_m: residual * 2.1,
            samples,
            ..SensorPose::default()
        }
    })
}

fn calibration() -> impl Strategy<Value = Input> {
    let parts = (
        ".*",
        ".*",
        0..3,
        btree_map("[a-z][a-z0-9_.-]{0,20}", pose(), 0..6),
    );
    parts.prop_map(|(created, method, floor, sensors)| {
        let floor = [FloorSource::Walk, FloorSource::Manual, FloorSource::Assumed][floor as usize];
        Input::Calibration(Arc::new(Calibration {
            created,
            method,
            floor,
            sensors,
            ..Calibration::default()
        }))
    })
}

fn fill() -> impl Strategy<Value = Fill> {
    let parts = (any::<[f64; 3]>(), any::<f64>(), any::<bool>(), -3.0..3.0f64);
    parts.prop_map(|(position, sigma_m, turned, angle)| Fill {
        position: position.into(),
        sigma_m,
        rotation: turned.then(|| UnitQuaternion::new(Vector3::new(angle, 0.3, -0.7 * angle))),
    })
}

fn answer() -> impl Strategy<Value = Input> {
    let pose = btree_map(0..Joint::ALL.len(), fill(), 0..25).prop_map(|fills| -> JointMap<Fill> {
        let fills = fills.into_iter();
        fills
            .map(|(joint, fill)| (Joint::ALL[joint], fill))
            .collect()
    });
    (any::<u64>(), any::<i64>(), vec(pose, 0..3)).prop_map(|(number, received, fills)| {
        Input::Repaired(Box::new(RepairAnswer {
            number,
            received: Timestamp::from_ns(received),
            fills,
        }))
    })
}

fn model() -> impl Strategy<Value = Input> {
    let parts = ("[a-z0-9-]{1,20}", 0..200usize, 0..200usize, 1.0..120.0f64);
    let there = parts.prop_map(|(name, before, after, rate_hz)| {
        let needs = Needs {
            before,
            after,
            rate_hz,
        };
        Input::RepairModel(Some(RepairModel { name, needs }))
    });
    prop_oneof![3 => there, 1 => Just(Input::RepairModel(None))]
}

fn input() -> impl Strategy<Value = Input> {
    let clock = (sensor(), any::<[i64; 4]>()).prop_map(|(sensor, [a, b, c, d])| {
        Input::ClockSample(ClockSample {
            sensor,
            sent: Timestamp::from_ns(a),
            returned: Timestamp::from_ns(b),
            agent_received: AgentTime::from_ns(c),
            agent_sent: AgentTime::from_ns(d),
        })
    });
    let greeting = (
        sensor(),
        "[a-zA-Z0-9_-]{1,64}",
        ".*",
        0..JointSet::ALL.len(),
    );
    let greeting = greeting.prop_map(|(id, name, model, joint_set)| {
        Input::Sensor(SensorInfo {
            id,
            name,
            model,
            joint_set: JointSet::ALL[joint_set],
        })
    });
    let tick = any::<i64>().prop_map(|ns| Input::Tick(Timestamp::from_ns(ns)));
    prop_oneof![
        3 => observation(),
        1 => calibration(),
        1 => clock,
        1 => greeting,
        1 => tick,
        2 => answer(),
        1 => model(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn an_input_comes_back_bit_for_bit(input in input()) {
        let bytes = input_to_bytes(&input);
        let back = input_from_bytes(&bytes).unwrap();
        // Text tells -0 from 0 and takes NaN for equal, which `==` does not.
        prop_assert_eq!(format!("{:?}", &back), format!("{:?}", &input));
        prop_assert_eq!(input_to_bytes(&back), bytes);
    }

    #[test]
    fn no_bytes_panic(bytes in vec(any::<u8>(), 0..300)) {
        let _ = input_from_bytes(&bytes);
    }
}
