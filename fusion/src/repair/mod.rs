//! Repair: what no sensor saw, filled in, marked as made up, and blended in and out without a jump.

mod config;
mod model;
mod request;

pub use config::RepairConfig;
pub use model::{Fill, MAX_AGE_S, ModelError, Needs, OcclusionModel, Window, WindowJoint};
pub use request::{RepairAnswer, RepairModel, RepairRequest};
