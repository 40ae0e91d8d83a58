//! Pure solvers that put every sensor of a room into one frame, from one person's walk.
//!
//! [`Collector`] gathers a [`Walk`] while it happens and says how much of the room is covered; [`solve`] turns
//! the walk into a [`Calibration`](posefuse_skeleton::Calibration) and a [`Report`] whose verdict rests on frames
//! the solver never used; [`to_toml`] and [`from_toml`], the skeleton crate's, keep it in a file that a person can read;
//! [`formats`] has the forms of other programs; [`compare`] says how two calibrations differ.
//!
//! Steps of [`solve`]: tracks and a common time grid (`tracks`), a robust start for each pair of sensors (`pair`),
//! the best spanning tree (`graph`), the bundle of all sensors at once (`refine`, `bundle`), floor and heading (`floor`),
//! held-out residuals (`residual`) and the verdict (`verdict`), with what explains it: each sensor's frames alone (`look`),
//! each sensor against the others (`against`), and what is tried where sensors disagree (`diagnose`).
//!
//! No I/O and no clock: strings and data in, data out. Metres, radians and nanoseconds unless a name says otherwise.

mod against;
mod beliefs;
mod bundle;
mod collector;
mod compare;
mod coverage;
mod diagnose;
mod error;
mod floor;
pub mod formats;
mod graph;
mod honest;
mod kabsch;
mod linear;
mod look;
mod matching;
mod monitor;
mod noise;
mod normal;
mod options;
mod pair;
mod people;
mod posterior;
mod refine;
mod report;
mod residual;
mod room_frame;
mod solve;
mod stats;
mod tracks;
mod validate;
mod verdict;
mod walk;

pub use collector::Collector;
pub use compare::{Change, SensorMove, compare};
pub use coverage::{Coverage, Goals, SensorCoverage};
pub use error::{CalibrationError, Cause};
pub use kabsch::{Degenerate, PointPair, RigidFit, kabsch};
pub use monitor::{DriftMonitor, DriftOptions, SensorDrift};
pub use options::{HandFloor, Options, Thresholds};
pub use posefuse_skeleton::calibration_text::{CalibrationFileError, from_toml, to_toml};
pub use report::{
    FloorRow, PairRow, Reason, Report, SensorCovariance, SensorRow, Solution, Verdict,
};
pub use room_frame::moved;
pub use solve::solve;
pub use walk::{SensorWalk, Walk, WalkBody, WalkFrame, WalkJoint};
