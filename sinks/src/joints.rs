//! Which positions positional streams send.

use posefuse_kinematics::Figure;
use posefuse_skeleton::{Joint, Position, Room, Track};
use serde::{Deserialize, Serialize};

use crate::LiveFrame;

/// Which positions are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Joints {
    /// Joints as fused. One that is not known is missing.
    #[default]
    Fused,
    /// Those of the body that was fitted to them: bones of constant length, feet that stand. Nobody has one in their first
    /// third of a second.
    Body,
}

impl Joints {
    /// Those who have them, each with their body where there is one.
    pub(crate) fn people(self, frame: &LiveFrame) -> Vec<(&Track, Option<&Figure>)> {
        let tracks = frame.frame.tracks.iter();
        let people = tracks.map(|track| {
            let figure = frame.figures.iter().find(|figure| figure.id == track.id);
            (track, figure)
        });
        people
            .filter(|(_, figure)| self == Self::Fused || figure.is_some())
            .collect()
    }

    /// Where a joint is.
    pub(crate) fn of(
        self,
        (track, figure): (&Track, Option<&Figure>),
        joint: Joint,
    ) -> Option<Position<Room>> {
        match self {
            Self::Fused => track.skeleton[joint].as_ref().map(|state| state.position),
            Self::Body => figure.and_then(|figure| figure.joints[joint]),
        }
    }
}
