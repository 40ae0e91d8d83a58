//! What sinks get.

use std::time::Instant;

use posefuse_kinematics::Figure;
use posefuse_proto::room_frame_to_wire;
use posefuse_skeleton::RoomFrame;
use prost::Message;

/// Everybody at one instant: joints as fused, and bodies as tools use them.
#[derive(Clone, Debug)]
pub struct LiveFrame {
    /// The fused frame.
    pub frame: RoomFrame,
    /// Those people whose trunk is known, as poses of their rigs, in the order of their ids.
    pub figures: Vec<Figure>,
    /// When the poses were captured: civil time, nanoseconds since 1970, UTC.
    pub unix_ns: i64,
    /// The room's timecode of that instant; empty: the room has none.
    pub timecode: String,
    /// When the fusion thread offered it: what a sink adds counts from here.
    pub(crate) offered: Instant,
}

impl LiveFrame {
    /// As `posefuse.v1.RoomFrame`.
    pub(crate) fn to_wire(&self) -> Vec<u8> {
        let mut wire = room_frame_to_wire(&self.frame);
        wire.unix_ns = self.unix_ns;
        wire.timecode.clone_from(&self.timecode);
        wire.encode_to_vec()
    }
}
