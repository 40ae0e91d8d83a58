//! What a solver answers.

use posefuse_skeleton::{JointMap, JointState, Position, Room};

use crate::feet::Contact;
use crate::hands::HandState;
use crate::rig::RigPose;

/// The body of one person at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// The pose of [`crate::Solver::rig`].
    pub pose: RigPose,
    /// All canonical joints as the pose has them, room metres.
    pub joints: JointMap<Position<Room>>,
    /// What of the left and the right foot stands on the floor.
    pub contacts: [Contact; 2],
    /// The left and the right hand, where somebody voted.
    pub hands: [Option<HandState>; 2],
    /// How far the pose's joints are from the fused ones, root mean square, metres; `None` where none was fused.
    pub residual_m: Option<f64>,
}

/// Root mean square of the distances of `joints` from where they were seen, metres.
pub(crate) fn residual(
    joints: &JointMap<Position<Room>>,
    seen: &JointMap<JointState<Room>>,
) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (joint, state) in seen.iter() {
        if let Some(at) = joints[joint] {
            sum += at.distance(state.position).powi(2);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| (sum / count).sqrt())
}
