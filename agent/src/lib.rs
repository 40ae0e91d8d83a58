//! One agent per sensor: takes skeletons from a sensor and pushes them to the room's server.
//!
//! Two halves that share a bounded buffer and nothing else:
//!
//! - a [`SensorSource`] gives frames, stamped by its sensor's clock. It runs on a thread of its own, so a driver
//!   that blocks holds up nobody;
//! - the uplink connects, greets, sends, answers clock probes, and reconnects for ever. A frame stays in the buffer
//!   until the server has acknowledged it; when the buffer is full, the oldest goes and is counted.
//!
//! Positions are metres in the sensor's optical frame (x right, y down, z forward); times are nanoseconds of the
//! agent's clock, which is monotonic and has an epoch of its own. Clock, network and randomness come in through
//! [`Parts`], so that a simulated network can run a real agent.

mod clock;
mod config;
mod health;
mod run;
pub mod source;
mod uplink;
mod wire;

pub use clock::{Clock, SystemClock};
pub use config::{AgentConfig, parse_server};
pub use run::{AgentError, AgentReport, End, Parts, run, run_with};
pub use source::{
    Camera, DepthFrame, DepthPreview, DepthSource, Description, PreviewSlot, SensorSource,
    SourceBody, SourceConfig, SourceError, SourceFrame,
};
pub use uplink::buffer::BufferLimits;
pub use uplink::connect::{Connecting, Connector, Io, tcp_connector};
