//! How good fused people are: the yardstick behind `posefuse evaluate`.
//!
//! - [`compare`]: one fused frame against the truth of its instant.
//! - [`Truth`]: what is known of the truth; [`SimulatedTruth`] and [`RecordedTruth`].
//! - [`measure`]: a run's frames against the truth, gathered in a [`Tally`] that runs can be pooled in, shown as
//!   [`Metrics`].
//! - [`SimulatedRoom`]: a simulated room as the engine's inputs; [`fuse`] lets an engine have them.
//! - [`Method`]: the configurations that are compared.
//! - [`suite`]: many simulated rooms, all methods on the same inputs.
//!
//! No I/O. Units are in the names; a field without one is a share or a count. Every definition stands where the
//! number is made.

mod compare;
mod fuse;
mod histogram;
mod measure;
mod methods;
mod metrics;
mod room;
mod series;
pub mod suite;
pub mod table;
mod tally;
mod truth;

pub use compare::{Comparison, FURTHEST_MATCH_M, Pair, compare};
pub use fuse::{Fused, fuse};
pub use histogram::Histogram;
pub use measure::measure;
pub use methods::{Method, PRESETS, REFERENCE, preset};
pub use metrics::{ErrorSpread, Metrics};
pub use room::{SimulatedRoom, perfect_calibration};
pub use tally::Tally;
pub use truth::{RecordedTruth, SimulatedTruth, Truth};
