//! A body that a tool can use: joint rotations against a rest pose, bones of constant length, feet that stand still.
//!
//! Pure: no I/O, no clock. Room axes throughout (X forward, Y left, Z up), metres, radians. See [`Rig`] for what a
//! rotation means.
//!
//! - [`Body`]: the measures of a person, learned from fused tracks; [`Body::rig`] is their rig in the T-pose.
//! - [`Solver`]: one person's tracks, frame by frame, to poses of that rig.
//! - [`Crowd`]: everybody in a room, live: rigs that settle in the first seconds, poses, hands, feet.
//! - [`HandFilter`]: sensors' votes on a hand as a state that does not flicker.
//! - [`Config`]: every function of it, on or off.

mod angles;
mod body;
mod bones;
mod config;
mod crowd;
mod direct;
mod feet;
mod fit;
mod grip;
mod hands;
mod look;
mod posture;
mod range;
mod rig;
mod solved;
mod solver;
mod speeds;
mod steady;

pub use angles::Angle;
pub use body::{Arm, Body, Learner, Leg};
pub use config::{
    Config, ConfigError, ExtraConfig, FeetConfig, FitConfig, HandsConfig, HoldConfig, LimitsConfig,
    LookAt, LookConfig, Start,
};
pub use crowd::{Crowd, Figure};
pub use feet::Contact;
pub use hands::{HandFilter, HandState};
pub use rig::{Bone, Rig, RigPose};
pub use solved::Solved;
pub use solver::Solver;
