//! A rig: bones with a rest pose; and a pose of it.
//!
//! The rest pose is a T-pose that faces X: upright along Z, the left arm along Y, the palms down, the feet ahead. In it
//! the axes of every bone are the room's, so every rotation is the identity.

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_skeleton::{Joint, Position, Room};

/// One bone: a set of axes that turns about its origin, which a bone above it carries along.
#[derive(Clone, Debug, PartialEq)]
pub struct Bone {
    /// Its name, e.g. `LeftUpperArm`.
    pub name: String,
    /// The bone that carries it: an index below its own; `None` for the root, which is the first.
    pub parent: Option<usize>,
    /// From the parent's origin to its own in the rest pose, metres; for the root, from the floor below the person.
    pub offset: Vector3<f64>,
    /// The canonical joint at its origin, where there is one.
    pub joint: Option<Joint>,
}

/// The bones of one person, and their lengths: the same for all frames of the person.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Parents before children.
    pub bones: Vec<Bone>,
}

/// A rig at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct RigPose {
    /// Where the root's origin is.
    pub root: Position<Room>,
    /// For each bone its rotation against the parent's axes (the root's against the room's): `parent_from_bone`.
    pub rotations: Vec<UnitQuaternion<f64>>,
}

impl Rig {
    /// The rest pose with the root here: the T-pose, facing X.
    pub fn rest_pose(&self, root: Position<Room>) -> RigPose {
        RigPose {
            root,
            rotations: vec![UnitQuaternion::identity(); self.bones.len()],
        }
    }

    /// The origins of all bones in this pose, room metres, and their axes (`room_from_bone`), in the order of the bones.
    ///
    /// # Panics
    /// If the pose has fewer rotations than the rig has bones.
    pub fn place(&self, pose: &RigPose) -> Vec<(Position<Room>, UnitQuaternion<f64>)> {
        let mut placed: Vec<(Position<Room>, UnitQuaternion<f64>)> =
            Vec::with_capacity(self.bones.len());
        for (bone, rotation) in self.bones.iter().zip(&pose.rotations) {
            placed.push(match bone.parent {
                None => (pose.root, *rotation),
                Some(parent) => {
                    let (origin, axes) = placed[parent];
                    (
                        Position::from_vector(origin.vector() + axes * bone.offset),
                        axes * rotation,
                    )
                }
            });
        }
        placed
    }
}
