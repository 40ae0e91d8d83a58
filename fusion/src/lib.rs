//! The fusion engine: pure, synchronous, without a clock of its own.
//!
//! Inputs carry their time; outputs are fused frames, rejections and the next deadline. Live, a thread loops over
//! a queue and the deadline; offline, a `for` loop over a recorded take. It is the same code.
//!
//! ```
//! use posefuse_fusion::{Config, Engine, Input, Output};
//! use posefuse_skeleton::Timestamp;
//!
//! let mut engine = Engine::new(Config::default());
//! engine.handle(Input::Tick(Timestamp::from_seconds(1.0)));
//! loop {
//!     match engine.poll() {
//!         Output::Frame(frame) => println!("{} people", frame.tracks.len()),
//!         Output::Rejected(rejection) => println!("{}", rejection.reason),
//!         Output::Repair(request) => println!("person {} has gaps", request.track),
//!         Output::WakeAt(deadline) => break assert_eq!(deadline, None),
//!     }
//! }
//! ```
//!
//! A frame's way: `clock` (agent time to server time), `gate` (joints that cannot be true), `sensors` (into the
//! room), `people` (whose body is it, left and right), `intake` (when a frame is due), `fuse`, `stages`.

mod body;
mod clock;
mod config;
mod config_check;
mod correct;
mod diagnostics;
mod engine;
mod fuse;
mod gate;
mod input;
mod intake;
mod ledger;
mod length;
mod noise;
mod output;
mod people;
mod repair;
mod sensors;
mod snapshot;
mod stages;
mod toml_text;

pub use clock::ClockEstimate;
pub use config::{
    AssociateConfig, ClockConfig, Config, FuseConfig, FuseMethod, IntakeConfig, IntakeMode,
};
pub use diagnostics::{BodyLabels, SensorDiagnostics};
pub use engine::Engine;
pub use input::{ClockSample, Input};
pub use ledger::Contribution;
pub use output::{Output, Rejection, RejectionReason};
pub use repair::{
    Fill, MAX_AGE_S, ModelError, Needs, OcclusionModel, RepairAnswer, RepairConfig, RepairCounts,
    RepairModel, RepairRequest, SimpleModel, Window, WindowJoint,
};
pub use snapshot::{BUILD, SnapshotError};
pub use stages::{BonesConfig, GateConfig, SmoothConfig, SmoothFilter, Stage};
pub use toml_text::{ConfigError, nearest_name, parse_toml};
