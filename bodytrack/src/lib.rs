//! Depth images to skeletons: the people in a depth image, followed over time and measured joint by joint.
//!
//! For sensors that bring no body tracker. Positions are metres in the sensor's optical frame (x right, y down, z
//! forward); left and right are the person's own.

mod background;
mod body;
mod checks;
mod claims;
mod confidence;
mod config;
pub mod crop;
mod estimate;
mod facing;
mod flesh;
mod floor;
mod grip;
pub mod hand;
mod lens;
mod looks;
mod people;
mod segments;
mod sight;
mod steps;
mod tracker;

pub use body::{Facing, TrackedBody};
pub use config::{TrackerConfig, TrackerError};
pub use posefuse_models::{BackendChoice, Config as ModelsConfig, Runtime};
pub use steps::{Step, Steps};
pub use tracker::BodyTracker;
