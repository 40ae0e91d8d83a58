//! Room planning: how much of a room its sensors see, which of them disturb each other, where the next one should stand.
//!
//! Pure geometry of cones in an empty room: people and furniture that hide others are not in it. Room frame (x forward,
//! y left, z up, metres), sensors look along their own z. A place counts as seen where it lies within a sensor's field
//! of view and range; a person of 1.8 m is seen whole where foot and head are, since a cone holds what is between two
//! points that it holds.

mod area;
mod coverage;
mod interference;
mod models;
mod plan;
mod suggest;
mod view;

pub use area::{Area, AreaError};
pub use coverage::{Coverage, HEIGHTS_M, Layer};
pub use interference::{Interference, Severity};
pub use models::{Light, MODELS, Model, USUAL};
pub use plan::{MAX_PLACED, Plan, Request, plan};
pub use suggest::Suggestion;
pub use view::{View, look_at};
