//! Repair: what no sensor saw, filled in, marked as made up, and blended in and out without a jump.

mod model;

pub use model::{Fill, MAX_AGE_S, ModelError, Needs, OcclusionModel, Window, WindowJoint};
