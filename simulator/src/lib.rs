//! Synthetic people, sensors and errors with ground truth, and loaders of recorded motion.
//!
//! - [`motion`]: people who move, procedural or recorded; [`motion::Performance`] says where everybody is when.
//! - [`load`]: recorded motion from BVH, ASF/AMC and exponential-map files.
//! - [`depth`]: what depth sensors see of them, as images.
//! - [`sensor`]: what simulated depth sensors and their trackers say of them, with switchable errors.
//!
//! A [`World`] made from a [`Scenario`] ties them together. It knows the truth; a [`SimSensor`]'s frames do not
//! carry it. Everything follows from the scenario's seed.
//!
//! ```
//! use std::sync::Arc;
//! use posefuse_simulator::{Scenario, SimSensor, World};
//!
//! let world = Arc::new(World::new(&Scenario { seed: 7, ..Scenario::default() })?);
//! let mut sensor = SimSensor::new(Arc::clone(&world), 0);
//! let frame = sensor.next_frame();
//! let truth = world.truth(frame.at_ns as f64 * 1e-9);
//! assert_eq!(truth.len(), 1);
//! # Ok::<(), posefuse_simulator::WorldError>(())
//! ```

pub mod depth;
pub mod load;
pub mod motion;
mod random;
mod scenario;
pub mod sensor;
mod world;

pub use motion::Situation;
pub use scenario::{Layout, Scenario, ScenarioError};
pub use sensor::{BodyTruth, SensorErrors, SimBody, SimClock, SimFrame, SimSensor};
pub use world::{TruePerson, World, WorldError};
