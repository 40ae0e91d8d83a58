//! Left and right swapped: a tracker that sees a back takes it for a front.

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, JointMap, Position, RawJoint, Room, Sensor, Transform};

use super::noise::{Address, body_axes};
use crate::random::{Purpose, Stream};
use crate::scenario::Scenario;

/// A person shows their back when the cosine between where they face and where the sensor is falls below the
/// first, and no longer does when it rises above the second.
const BACK_BELOW: f64 = -0.3;
const FRONT_ABOVE: f64 = -0.1;

/// How far, and for how long, imperfectly swapped joints shake: metres per axis, seconds.
const WOBBLE_M: f64 = 0.04;
const WOBBLE_TAU_S: f64 = 0.3;

/// Which side of a person the sensor sees, and what the tracker makes of it.
#[derive(Default)]
pub(crate) struct Facing {
    back: bool,
    arms: bool,
    legs: bool,
    wobble: Vec<Vector3<f64>>,
}

impl Facing {
    /// On to the frame of `address`. Whether to swap is decided each time the back comes into sight.
    pub(crate) fn step(
        &mut self,
        scenario: &Scenario,
        address: Address,
        joints: &JointMap<Position<Sensor>>,
        sensor_from_room: &Transform<Sensor, Room>,
    ) {
        let cosine = facing_cosine(joints, sensor_from_room);
        if self.back && cosine > FRONT_ABOVE {
            *self = Self::default();
        } else if !self.back && cosine < BACK_BELOW {
            let mut stream = Stream::new(scenario.seed, Purpose::Swap, &address);
            let swapped = stream.chance(scenario.errors.swaps);
            let which = stream.uniform();
            let partly = scenario.errors.imperfect_swaps;
            self.back = true;
            self.arms = swapped && !(partly && which < 0.15);
            self.legs = swapped && !(partly && which > 0.7);
        }
        if scenario.errors.imperfect_swaps && (self.arms || self.legs) {
            let mut stream = Stream::new(scenario.seed, Purpose::SwapWobble, &address);
            let kept = (-1.0 / (scenario.rate_hz * WOBBLE_TAU_S)).exp();
            let fresh = (1.0 - kept * kept).sqrt() * WOBBLE_M;
            self.wobble.resize(Joint::ALL.len(), Vector3::zeros());
            for wobble in &mut self.wobble {
                *wobble = *wobble * kept + stream.normal3() * fresh;
            }
        }
    }

    /// Whether the labels of the arms, and of the legs, are exchanged.
    pub(crate) fn swapped(&self) -> [bool; 2] {
        [self.arms, self.legs]
    }

    /// Exchanges the labels.
    pub(crate) fn swap(&self, raw: &mut JointMap<RawJoint>) {
        if !self.arms && !self.legs {
            return;
        }
        let before = raw.clone();
        for joint in Joint::ALL {
            let swapped = if is_leg(joint) { self.legs } else { self.arms };
            if swapped && joint.mirrored() != joint {
                raw[joint] = before[joint.mirrored()];
                if let (Some(raw), Some(wobble)) =
                    (&mut raw[joint], self.wobble.get(joint as usize))
                {
                    raw.position = raw.position.moved(*wobble);
                }
            }
        }
    }
}

fn is_leg(joint: Joint) -> bool {
    use Joint::*;
    matches!(
        joint,
        HipLeft | KneeLeft | AnkleLeft | FootLeft | HipRight | KneeRight | AnkleRight | FootRight
    )
}

/// Cosine between where a person faces and where the sensor is, both flat on the floor: 1 sees a face, -1 a back.
pub(crate) fn facing_cosine(
    joints: &JointMap<Position<Sensor>>,
    sensor_from_room: &Transform<Sensor, Room>,
) -> f64 {
    let Some(chest) = joints[Joint::SpineShoulder] else {
        return 1.0;
    };
    let up = sensor_from_room.rotate(Vector3::z());
    let flat = |v: Vector3<f64>| {
        (v - up * up.dot(&v))
            .try_normalize(1e-9)
            .unwrap_or_default()
    };
    let forwards: Vector3<f64> = body_axes(joints).column(0).into();
    flat(forwards).dot(&flat(-chest.vector()))
}
