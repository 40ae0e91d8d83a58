//! A made-up limb keeps the person's own bone lengths.

use nalgebra::Vector3;
use posefuse_skeleton::{BONES, JOINT_COUNT, Joint, JointState, Provenance, Room, Skeleton};
use serde::{Deserialize, Serialize};

use crate::length::Length;

/// Rounds over all bones; a made-up chain between two measured joints needs a few.
const ROUNDS: usize = 4;
/// A bone found shorter than this has no direction, metres.
const SHORTEST_M: f64 = 1e-3;

/// A person's bone lengths, in the order of [`BONES`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Lengths([Length; BONES.len()]);

impl Lengths {
    /// Learns from a pose as it was measured.
    pub(super) fn learn(&mut self, skeleton: &Skeleton<Room>) {
        let measured = |joint: Joint| -> Option<&JointState<Room>> {
            let state = skeleton[joint].as_ref()?;
            matches!(state.provenance, Provenance::Measured(_)).then_some(state)
        };
        for (bone, length) in BONES.iter().zip(&mut self.0) {
            if let (Some(a), Some(b)) = (measured(bone.parent), measured(bone.child)) {
                length.learn(a.position.distance(b.position));
            }
        }
    }

    /// Moves the joints of `places` that may move, by `free` (how much, any unit; 0 for not at all), until bones have
    /// their lengths.
    pub(super) fn keep(
        &self,
        places: &mut [Option<Vector3<f64>>; JOINT_COUNT],
        free: &[f64; JOINT_COUNT],
    ) {
        for _ in 0..ROUNDS {
            for (bone, length) in BONES.iter().zip(&self.0) {
                let (a, b) = (bone.parent as usize, bone.child as usize);
                let both = free[a] + free[b];
                let (Some(from), Some(to), Some(length_m)) = (places[a], places[b], length.known())
                else {
                    continue;
                };
                let along = to - from;
                let found_m = along.norm();
                if both == 0.0 || found_m < SHORTEST_M {
                    continue;
                }
                let excess = along * ((found_m - length_m) / (found_m * both));
                places[a] = Some(from + excess * free[a]);
                places[b] = Some(to - excess * free[b]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::{Confidence, Position, SensorId};

    use super::*;

    #[test]
    fn a_made_up_knee_and_ankle_get_their_bones_and_the_hip_stays() {
        let sensor = SensorId::new(0).unwrap();
        let pose: Skeleton<Room> = [
            (Joint::HipLeft, [0.0, 0.1, 0.9]),
            (Joint::KneeLeft, [0.0, 0.1, 0.5]),
            (Joint::AnkleLeft, [0.0, 0.1, 0.1]),
        ]
        .into_iter()
        .map(|(joint, [x, y, z])| {
            let place = Position::new(x, y, z);
            let state = JointState::measured(place, 0.01, Confidence::FULL, sensor);
            (joint, state)
        })
        .collect();
        let mut lengths = Lengths::default();
        (0..60).for_each(|_| lengths.learn(&pose));
        let mut places = Joint::ALL.map(|joint| pose.position(joint).map(|p| p.vector()));
        places[Joint::KneeLeft as usize] = Some(Vector3::new(0.3, 0.1, 0.6));
        places[Joint::AnkleLeft as usize] = Some(Vector3::new(0.3, 0.2, 0.0));
        let mut free = [0.0; JOINT_COUNT];
        free[Joint::KneeLeft as usize] = 0.01;
        free[Joint::AnkleLeft as usize] = 0.02;
        lengths.keep(&mut places, &free);
        let [hip, knee, ankle] = [Joint::HipLeft, Joint::KneeLeft, Joint::AnkleLeft]
            .map(|joint| places[joint as usize].unwrap());
        assert_eq!(hip, Vector3::new(0.0, 0.1, 0.9));
        assert!(((knee - hip).norm() - 0.4).abs() < 0.005);
        assert!(((ankle - knee).norm() - 0.4).abs() < 0.005);
    }
}
