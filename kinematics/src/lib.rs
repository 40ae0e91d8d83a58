//! A body that a tool can use: joint rotations against a rest pose, bones of constant length, feet that stand still.
//!
//! Pure: no I/O, no clock. Room axes throughout (X forward, Y left, Z up), metres, radians. See [`Rig`] for what a
//! rotation means.

mod rig;

pub use rig::{Bone, Rig, RigPose};
