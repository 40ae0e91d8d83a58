//! Repair: what no sensor saw, filled in, marked as made up, and blended in and out without a jump.

mod blend;
mod bones;
mod choice;
mod config;
mod gaussian;
mod history;
mod model;
mod person;
mod request;
mod simple;
mod step;
mod trust;

pub use config::RepairConfig;
pub use model::{Fill, MAX_AGE_S, ModelError, Needs, OcclusionModel, Window, WindowJoint};
pub(crate) use person::Joints;
pub use request::{RepairAnswer, RepairModel, RepairRequest};
pub use simple::SimpleModel;
pub use step::RepairCounts;
pub(crate) use step::{Circumstances, Outlet, Repair};
