//! The channels, and a frame as each one's message.

use std::sync::{Arc, OnceLock};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use posefuse_proto::foxglove::{scene_of, transforms_of};
use posefuse_proto::schema_of;

use super::protocol::Advertised;
use crate::LiveFrame;
use crate::bone_frames::bones_of;

/// What a client can subscribe to. The names are those of the topics in takes, so that one layout shows both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    Scene = 1,
    Transforms = 2,
    Frames = 3,
}

impl Channel {
    pub(super) const ALL: [Self; 3] = [Self::Scene, Self::Transforms, Self::Frames];

    pub(super) fn of_id(id: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| *channel as u32 == id)
    }

    pub(super) fn advertised(self) -> Advertised {
        let (topic, schema_name) = match self {
            Self::Scene => ("/scene", "foxglove.SceneUpdate"),
            Self::Transforms => ("/tf", "foxglove.FrameTransforms"),
            Self::Frames => ("/frames", "posefuse.v1.RoomFrame"),
        };
        Advertised {
            id: self as u32,
            topic,
            encoding: "protobuf",
            schema_name,
            schema: STANDARD.encode(schema_of(schema_name)),
            schema_encoding: "protobuf",
        }
    }
}

/// A frame, and its messages once somebody wants them.
pub(super) struct Prepared {
    pub(super) live: Arc<LiveFrame>,
    encoded: [OnceLock<Vec<u8>>; 3],
}

impl Prepared {
    pub(super) fn new(live: Arc<LiveFrame>) -> Self {
        Self {
            live,
            encoded: Default::default(),
        }
    }

    /// Capture time, nanoseconds since 1970.
    pub(super) fn unix_ns(&self) -> u64 {
        u64::try_from(self.live.unix_ns).unwrap_or_default()
    }

    pub(super) fn message(&self, channel: Channel) -> &[u8] {
        self.encoded[channel as usize - 1].get_or_init(|| {
            let frame = &self.live.frame;
            match channel {
                Channel::Scene => scene_of(frame, self.unix_ns()),
                Channel::Transforms => {
                    let figures = self.live.figures.iter();
                    transforms_of(figures.flat_map(bones_of), self.unix_ns())
                }
                Channel::Frames => self.live.to_wire(),
            }
        })
    }
}
