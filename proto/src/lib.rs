//! The wire of Posefuse, package `posefuse.v1`: generated code and its conversions to the vocabulary.
//!
//! The generated code is checked in; `cargo xtask generate` makes it anew from `proto/posefuse/v1/*.proto`.
//! Conversions into the vocabulary validate once, here; behind them nothing needs to look again.

mod convert;
pub mod foxglove;
mod schema;

/// The generated messages, clients and servers.
#[allow(missing_docs, unreachable_pub, clippy::all)]
pub mod v1 {
    include!("generated/posefuse.v1.rs");
}

pub use convert::calibration::{
    calibration_from_wire, calibration_to_wire, pose_from_wire, pose_to_wire,
};
pub use convert::observation::{
    agent_body, bodies_from_agent, hands_to_wire, observation_from_wire, observation_to_wire,
    sensor_info_from_wire, sensor_info_to_wire,
};
pub use convert::room_frame::{room_frame_from_wire, room_frame_to_wire};
pub use convert::{WireError, check_sensor_name};
pub use schema::schema_of;

/// The version of the protocol that `Hello` names.
pub const PROTOCOL: u32 = 1;

/// The serialised `FileDescriptorSet` of all .proto files of the wire.
pub const DESCRIPTORS: &[u8] = include_bytes!("generated/descriptors.bin");
