//! The topics of a take and the message each one holds.

/// A topic of a take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    /// What the engine consumed, in that order: `posefuse.v1.EngineInput`.
    Inputs,
    /// Fused frames: `posefuse.v1.RoomFrame`.
    Frames,
    /// What the engine refused: `posefuse.v1.Rejection`.
    Rejections,
    /// What happened around the engine: `posefuse.v1.Event`.
    Events,
    /// True poses of simulated people: `posefuse.v1.Truth`.
    Truth,
    /// The people as a viewer draws them: `foxglove.SceneUpdate`.
    Scene,
    /// Where the sensors stand: `foxglove.FrameTransforms`.
    Transforms,
}

impl Topic {
    /// All topics.
    pub const ALL: [Self; 7] = [
        Self::Inputs,
        Self::Frames,
        Self::Rejections,
        Self::Events,
        Self::Truth,
        Self::Scene,
        Self::Transforms,
    ];

    /// The name in the file, e.g. `/frames`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inputs => "/inputs",
            Self::Frames => "/frames",
            Self::Rejections => "/rejections",
            Self::Events => "/events",
            Self::Truth => "/truth",
            Self::Scene => "/scene",
            Self::Transforms => "/tf",
        }
    }

    /// The topic of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }

    /// The full name of its protobuf message.
    pub fn schema(self) -> &'static str {
        match self {
            Self::Inputs => "posefuse.v1.EngineInput",
            Self::Frames => "posefuse.v1.RoomFrame",
            Self::Rejections => "posefuse.v1.Rejection",
            Self::Events => "posefuse.v1.Event",
            Self::Truth => "posefuse.v1.Truth",
            Self::Scene => "foxglove.SceneUpdate",
            Self::Transforms => "foxglove.FrameTransforms",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_has_a_schema() {
        for topic in Topic::ALL {
            assert!(
                !posefuse_proto::schema_of(topic.schema()).is_empty(),
                "{topic:?}"
            );
        }
    }
}
