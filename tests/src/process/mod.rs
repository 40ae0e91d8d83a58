//! The real `posefuse` program: servers and agents as processes on this machine's loopback, which can be killed,
//! stopped and started again; and clients of theirs that do what a healthy client does not.

mod binary;
mod follow;
mod program;
mod raw;
mod room;
mod wire_agent;

pub use binary::posefuse;
pub use follow::{Follower, SeenFrame};
pub use program::Program;
pub use raw::send_raw;
pub use room::Room;
pub use wire_agent::WireAgent;
