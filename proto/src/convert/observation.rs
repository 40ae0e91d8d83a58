//! Frames of agents in any joint set -> canonical bodies; observations to and from the take.
//!
//! Positions travel as f32, and what the engine sees is rounded to f32 first, so that a recorded
//! observation is bit for bit the one that was fused.

use nalgebra::{Quaternion, UnitQuaternion};
use posefuse_skeleton::{
    AgentTime, Body, Confidence, Joint, JointMap, JointSet, JointState, Observation, Position,
    RawJoint, SensorId, SensorInfo, Skeleton, Timestamp,
};

use super::WireError;
use crate::v1;

/// Joints of the largest joint set.
const MAX_JOINTS: usize = 33;

/// What a joint is taken to be good for until the engine applies its sensor model, metres.
const NOMINAL_SIGMA_M: f64 = 0.02;

/// A body as an agent sends it: the joints in the order of its joint set, no orientations.
pub fn agent_body(tracking_id: u64, joints: &[Option<RawJoint>]) -> v1::Body {
    let mut body = v1::Body {
        tracking_id,
        ..Default::default()
    };
    for joint in joints {
        let (position, confidence) = match joint {
            Some(raw) => (
                raw.position.vector().map(|v| v as f32),
                raw.confidence.get(),
            ),
            None => (nalgebra::Vector3::zeros(), 0.0),
        };
        body.positions.extend(position.iter());
        body.confidences.push(confidence);
    }
    body
}

/// The bodies of an agent's frame as canonical bodies.
///
/// Confidence 0 means missing. Non-finite positions, and confidences that are none, pass as non-finite, for the engine's gate to reject and count joint by
/// joint; a quaternion that is none is dropped.
pub fn bodies_from_agent(
    sensor: SensorId,
    joint_set: JointSet,
    bodies: &[v1::Body],
) -> Result<Vec<Body>, WireError> {
    if bodies.len() > Observation::MAX_BODIES {
        return Err(WireError::TooManyBodies {
            found: bodies.len(),
        });
    }
    for (index, body) in bodies.iter().enumerate() {
        let twice = |other: &v1::Body| other.tracking_id == body.tracking_id;
        if let Some(first) = bodies[..index].iter().position(twice) {
            return Err(WireError::TrackingIdTwice {
                tracking_id: body.tracking_id,
                bodies: [first, index],
            });
        }
    }
    bodies
        .iter()
        .enumerate()
        .map(|(index, body)| body_from_wire(sensor, joint_set, index, body))
        .collect()
}

fn body_from_wire(
    sensor: SensorId,
    joint_set: JointSet,
    index: usize,
    body: &v1::Body,
) -> Result<Body, WireError> {
    let joints = joint_set.joint_count();
    let check = |field, found: usize, per_joint: usize| {
        let expected = joints * per_joint;
        let wrong = WireError::Length {
            body: index,
            field,
            found,
            expected,
            joint_set,
        };
        if found == expected {
            Ok(())
        } else {
            Err(wrong)
        }
    };
    check("positions", body.positions.len(), 3)?;
    check("confidences", body.confidences.len(), 1)?;
    if !body.orientations.is_empty() {
        check("orientations", body.orientations.len(), 4)?;
    }
    let mut raw = [None; MAX_JOINTS];
    for (joint, (xyz, &confidence)) in body
        .positions
        .chunks_exact(3)
        .zip(&body.confidences)
        .enumerate()
    {
        raw[joint] = raw_joint([xyz[0], xyz[1], xyz[2]], confidence);
    }
    let skeleton = joint_set
        .to_canonical(&raw[..joints])
        .map(|_, raw| measured(sensor, raw));
    let orientations = (!body.orientations.is_empty())
        .then(|| Box::new(orientations_from_wire(joint_set, &body.orientations)));
    Ok(Body {
        tracking_id: body.tracking_id,
        skeleton,
        orientations,
        hands_closed: hands_from_wire(&body.hands_closed, index)?,
    })
}

/// The left and the right hand, as the wire says whether they are closed: empty where neither is known.
pub fn hands_to_wire(closed: [Option<f32>; 2]) -> Vec<f32> {
    if closed == [None; 2] {
        return Vec::new();
    }
    closed.map(|closed| closed.unwrap_or(-1.0)).to_vec()
}

/// A probability that is none is as good as none.
fn hands_from_wire(closed: &[f32], index: usize) -> Result<[Option<Confidence>; 2], WireError> {
    match *closed {
        [] => Ok([None; 2]),
        [left, right] => Ok([left, right].map(|closed| Confidence::new(closed).ok())),
        _ => Err(WireError::Hands {
            body: index,
            found: closed.len(),
        }),
    }
}

/// A joint whose confidence says nothing is handed on as one that is nowhere, for the gate to reject and count.
fn raw_joint(xyz: [f32; 3], confidence: f32) -> Option<RawJoint> {
    let [x, y, z] = xyz.map(f64::from);
    let joint = |position, confidence| RawJoint {
        position,
        confidence,
    };
    match Confidence::new(confidence) {
        Ok(Confidence::NONE) => None,
        Ok(confidence) => Some(joint(Position::new(x, y, z), confidence)),
        Err(_) => Some(joint(
            Position::new(f64::NAN, f64::NAN, f64::NAN),
            Confidence::FULL,
        )),
    }
}

fn measured(sensor: SensorId, raw: &RawJoint) -> JointState<posefuse_skeleton::Sensor> {
    let rounded = Position::from_vector(raw.position.vector().map(|v| f64::from(v as f32)));
    JointState::measured(rounded, NOMINAL_SIGMA_M, raw.confidence, sensor)
}

fn orientations_from_wire(joint_set: JointSet, xyzw: &[f32]) -> JointMap<UnitQuaternion<f64>> {
    let orientation = |index: usize| {
        let q = &xyzw[4 * index..4 * index + 4];
        let norm = q.iter().map(|v| v * v).sum::<f32>().sqrt();
        let exact = |v: f32| f64::from(v);
        (0.9..=1.1).contains(&norm).then(|| {
            UnitQuaternion::new_unchecked(Quaternion::new(
                exact(q[3]),
                exact(q[0]),
                exact(q[1]),
                exact(q[2]),
            ))
        })
    };
    let single = joint_set
        .mappings()
        .iter()
        .filter(|mapping| mapping.from.len() == 1);
    single
        .filter_map(|mapping| Some((mapping.joint, orientation(mapping.from[0])?)))
        .collect()
}

/// An observation as a take holds it.
pub fn observation_to_wire(observation: &Observation) -> v1::Observation {
    v1::Observation {
        sensor: observation.sensor.index() as u32,
        sequence: observation.sequence,
        captured_ns: observation.captured.ns(),
        received_ns: observation.received.ns(),
        bodies: observation
            .bodies
            .iter()
            .map(canonical_body_to_wire)
            .collect(),
    }
}

/// An observation read from a take.
pub fn observation_from_wire(observation: &v1::Observation) -> Result<Observation, WireError> {
    let sensor = SensorId::new(observation.sensor as usize)?;
    Ok(Observation {
        sensor,
        sequence: observation.sequence,
        captured: AgentTime::from_ns(observation.captured_ns),
        received: Timestamp::from_ns(observation.received_ns),
        bodies: bodies_from_agent(sensor, JointSet::KinectV2, &observation.bodies)?,
    })
}

fn canonical_body_to_wire(body: &Body) -> v1::Body {
    let skeleton: &Skeleton<_> = &body.skeleton;
    let raw = Joint::ALL.map(|joint| {
        let state = skeleton[joint].as_ref()?;
        Some(RawJoint {
            position: state.position,
            confidence: state.confidence,
        })
    });
    let mut wire = agent_body(body.tracking_id, &raw);
    if let Some(orientations) = &body.orientations {
        for joint in Joint::ALL {
            let coordinates = orientations[joint].as_ref().map(|q| q.coords);
            wire.orientations
                .extend(coordinates.unwrap_or_default().iter().map(|v| *v as f32));
        }
    }
    wire.hands_closed = hands_to_wire(body.hands_closed.map(|closed| closed.map(Confidence::get)));
    wire
}

/// What is known of a sensor, as the wire says it.
pub fn sensor_info_to_wire(info: &SensorInfo) -> v1::SensorInfo {
    v1::SensorInfo {
        id: info.id.index() as u32,
        name: info.name.clone(),
        model: info.model.clone(),
        joint_set: info.joint_set.name().to_owned(),
    }
}

/// What is known of a sensor, checked.
pub fn sensor_info_from_wire(info: &v1::SensorInfo) -> Result<SensorInfo, WireError> {
    super::check_sensor_name(&info.name)?;
    Ok(SensorInfo {
        id: SensorId::new(info.id as usize)?,
        name: info.name.clone(),
        model: info.model.clone(),
        joint_set: info.joint_set.parse()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor() -> SensorId {
        SensorId::new(3).unwrap()
    }

    fn body(joint_set: JointSet) -> v1::Body {
        let count = joint_set.joint_count();
        v1::Body {
            tracking_id: 7,
            positions: (0..3 * count).map(|i| i as f32 * 0.1).collect(),
            confidences: vec![0.5; count],
            hands_closed: vec![-1.0, 0.25],
            orientations: [0.0, 0.6, 0.0, 0.8].repeat(count),
        }
    }

    #[test]
    fn every_joint_set_comes_through_a_take_unchanged() {
        for joint_set in JointSet::ALL {
            let bodies = bodies_from_agent(sensor(), joint_set, &[body(joint_set)]).unwrap();
            assert_eq!(bodies[0].skeleton.len(), joint_set.mappings().len());
            let closed = bodies[0].hands_closed.map(|hand| hand.map(Confidence::get));
            assert_eq!(closed, [None, Some(0.25)]);
            let seen = Observation {
                sensor: sensor(),
                sequence: 9,
                captured: AgentTime::from_ns(-5),
                received: Timestamp::from_ns(11),
                bodies,
            };
            assert_eq!(
                observation_from_wire(&observation_to_wire(&seen)).unwrap(),
                seen,
                "{joint_set}"
            );
        }
    }

    #[test]
    fn wrong_shapes_are_named() {
        let mut short = body(JointSet::Nite);
        short.positions.pop();
        let error = bodies_from_agent(sensor(), JointSet::Nite, &[short])
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("positions") && error.contains("45") && error.contains("nite"),
            "{error}"
        );

        let mut three_hands = body(JointSet::Nite);
        three_hands.hands_closed.push(1.0);
        assert_eq!(
            bodies_from_agent(sensor(), JointSet::Nite, &[three_hands]),
            Err(WireError::Hands { body: 0, found: 3 })
        );

        let crowd = vec![v1::Body::default(); Observation::MAX_BODIES + 1];
        let found = crowd.len();
        assert_eq!(
            bodies_from_agent(sensor(), JointSet::KinectV2, &crowd),
            Err(WireError::TooManyBodies { found })
        );

        let mut people = vec![body(JointSet::KinectV2); 3];
        people[0].tracking_id = 1;
        assert_eq!(
            bodies_from_agent(sensor(), JointSet::KinectV2, &people),
            Err(WireError::TrackingIdTwice {
                tracking_id: 7,
                bodies: [1, 2]
            })
        );
    }

    #[test]
    fn a_confidence_that_is_none_costs_its_joint_alone() {
        for none in [f32::NAN, f32::INFINITY, -0.1, 7.0] {
            let mut odd = body(JointSet::KinectV2);
            odd.confidences[Joint::ElbowLeft as usize] = none;
            let bodies = bodies_from_agent(sensor(), JointSet::KinectV2, &[odd]).unwrap();
            let finite = |joint: Joint| bodies[0].skeleton.position(joint).unwrap().is_finite();
            assert!(!finite(Joint::ElbowLeft), "{none} passed for a confidence");
            assert!(finite(Joint::WristLeft) && finite(Joint::ShoulderLeft));
        }
    }

    #[test]
    fn missing_joints_stay_missing_and_bad_quaternions_go() {
        let mut body = body(JointSet::KinectV2);
        body.confidences[Joint::Head as usize] = 0.0;
        body.orientations[4 * Joint::Neck as usize + 1] = f32::NAN;
        let bodies = bodies_from_agent(sensor(), JointSet::KinectV2, &[body]).unwrap();
        assert_eq!(bodies[0].skeleton[Joint::Head], None);
        let orientations = bodies[0].orientations.as_ref().unwrap();
        assert!(orientations[Joint::Neck].is_none() && orientations[Joint::SpineMid].is_some());
    }
}
