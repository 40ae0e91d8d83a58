//! How good fused people are: the yardstick behind `posefuse evaluate`.
//!
//! - [`compare`]: one fused frame against the truth of its instant.
//! - [`Truth`]: what is known of the truth; [`SimulatedTruth`] and [`RecordedTruth`].
//! - [`Judge`]: counts what a run's frames are worth, with or without truth, in a [`Tally`] that runs can be pooled
//!   in; shown as [`Metrics`].
//! - [`leave_one_out`], [`left_out_alike`]: whether a sensor agrees with what the others make of its people.
//! - [`SimulatedRoom`]: a simulated room as the engine's inputs; [`fuse`] lets an engine have them.
//! - [`Method`]: the configurations that are compared.
//! - [`suite`]: many simulated rooms, all methods on the same inputs.
//! - [`repair_pairs`]: what occlusion models are asked in a simulated room, beside the truth, to train on.
//! - [`repair`]: how well occlusion models fill in what no sensor saw.
//! - [`bodytrack`]: how good the body tracker is on rendered depth, one sensor alone and several together.
//! - [`kinematics`]: bodies made of fused people, beside the people as fused.
//! - [`Report`]: the result, as rows of text ([`table`]), JSON or a page; [`aims`]: what is to be reached.
//!
//! No I/O. Units are in the names; a field without one is a share or a count. Every definition stands where the
//! number is made.

pub mod aims;
mod alone;
mod beside;
pub mod bodytrack;
mod compare;
mod fuse;
mod histogram;
mod judge;
pub mod kinematics;
mod measure;
mod methods;
mod metrics;
mod pairs;
mod parallel;
pub mod repair;
mod report;
mod room;
mod series;
pub mod suite;
pub mod table;
mod tally;
mod truth;
mod versus;

pub use alone::{LeftOut, leave_one_out, left_out_alike};
pub use beside::{Beside, RepairEffect};
pub use compare::{Comparison, FURTHEST_MATCH_M, Pair, compare};
pub use fuse::fuse;
pub use histogram::Histogram;
pub use judge::{Judge, Judged};
pub use methods::{Method, ModelBeside, PRESETS, REFERENCE, preset};
pub use metrics::{ErrorSpread, Metrics};
pub use pairs::{Pair as RepairPair, pairs as repair_pairs};
pub use parallel::in_parallel;
pub use report::{Group, Report, Run};
pub use room::{SimulatedRoom, observed_body, perfect_calibration};
pub use tally::Tally;
pub use truth::{RecordedTruth, SimulatedTruth, Truth};
pub use versus::{Versus, versus};
