//! Repair: what no sensor saw, filled in, marked as made up, and blended in and out without a jump.
//!
//! A frame comes into `step` behind the stages. `trust` says how far each joint is measured, `history` keeps that and makes
//! windows of it, `choice` says who fills them in: a model of `simple` (the best is `gaussian`), or one outside the engine
//! (`request`). `person` puts the answer in, `bones` keeps lengths, `blend` the seams.

mod around;
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
mod waiting;

pub use around::RepairCounts;
pub(crate) use around::{Circumstances, Outlet};
pub use config::RepairConfig;
pub use model::{Fill, MAX_AGE_S, ModelError, Needs, OcclusionModel, Window, WindowJoint};
pub(crate) use person::Joints;
pub use request::{RepairAnswer, RepairModel, RepairRequest};
pub use simple::SimpleModel;
pub(crate) use step::Repair;
