//! The room as viewers that know Foxglove's message schemas draw it: in takes and live.

mod scene;

/// Foxglove's messages, as far as they are used.
#[allow(missing_docs, unreachable_pub, clippy::all)]
mod messages {
    include!("generated/foxglove.rs");
}

pub use scene::{Child, ROOM, deletions_of, entity_id, scene_of, sensors_of, transforms_of};

/// The serialised `FileDescriptorSet` of these messages.
pub const DESCRIPTORS: &[u8] = include_bytes!("generated/descriptors.bin");
