//! Closed hands: fingers that bend and a thumb that lies down on them, as far as the hand is closed.

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use crate::bones::{ARMS, BONES, SIDES};
use crate::config::HandsConfig;
use crate::hands::HandState;
use crate::posture::{Offsets, Placed, Posture};
use crate::rig::RigPose;

/// The thumb of a closed hand: towards the fingers, and towards the palm, degrees.
const THUMB_IN_DEG: f64 = 35.0;
const THUMB_DOWN_DEG: f64 = 30.0;

/// How far the left and the right hand are closed in the picture: 0 to 1, following what is known of them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Grips([f64; 2]);

impl Grips {
    /// Moves on to what is known now; hands of which nothing is known are as fitted.
    pub(crate) fn step(
        &mut self,
        hands: &[Option<HandState>; 2],
        config: &HandsConfig,
        elapsed: f64,
    ) {
        let most = elapsed / config.settle_s;
        for (grip, hand) in self.0.iter_mut().zip(hands) {
            let goal = f64::from(u8::from(hand.is_some_and(|hand| hand.closed)));
            *grip += (goal - *grip).clamp(-most, most);
        }
    }

    /// Bends fingers and thumbs, in the posture, in the pose and in the joints that are made of it.
    pub(crate) fn bend(
        &self,
        config: &HandsConfig,
        (offsets, placed): (&Offsets, &Placed),
        posture: &mut Posture,
        pose: &mut RigPose,
        joints: &mut JointMap<Position<Room>>,
    ) {
        for (side, bones) in ARMS.iter().enumerate() {
            let grip = self.0[side];
            if grip <= 0.0 || config.bend_deg <= 0.0 {
                continue;
            }
            let share = grip * grip * (3.0 - 2.0 * grip);
            let angle = &mut posture.angles[bones.fingers][0];
            *angle += (config.bend_deg.to_radians() - *angle) * share;
            pose.rotations[bones.fingers] = posture.rotation(bones.fingers);
            let turn = |axis: Vector3<f64>, degrees: f64| {
                UnitQuaternion::from_scaled_axis(axis * (degrees.to_radians() * share))
            };
            pose.rotations[bones.thumb] =
                turn(Vector3::z() * SIDES[side], THUMB_IN_DEG) * turn(Vector3::y(), THUMB_DOWN_DEG);
            for end in [bones.fingers_end, bones.thumb_end] {
                let carrier = BONES[end].parent;
                let line = placed.axes[bones.hand] * (pose.rotations[carrier] * offsets[end]);
                if let Some(joint) = BONES[end].joint {
                    put(joints, joint, placed.origins[carrier] + line);
                }
            }
        }
    }
}

fn put(joints: &mut JointMap<Position<Room>>, joint: Joint, at: Vector3<f64>) {
    joints[joint] = Some(Position::from_vector(at));
}
