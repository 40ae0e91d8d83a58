//! The real server and real agents in a simulated network: turmoil carries the bytes, time is simulated, and
//! everything random follows from a seed. A minute passes in a second.
//!
//! A [`Lab`] is one host `server`, one host `operator` (it watches all streams of the server and sends requests) and
//! one host for each agent, `cam1`, `cam2` ...

mod host;
mod lab;
mod log;
mod operator;
mod sensor;

pub use host::Disk;
pub use lab::{Asked, Lab, Plan, sensor_name, true_calibration};
pub use log::{Entry, Happening, Log};
pub use sensor::{CapturedFrame, Captures};
