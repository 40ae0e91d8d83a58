//! Which joints a sensor sees, and how sure its tracker is of them.

use posefuse_skeleton::{Confidence, JointMap, Position, Sensor};

use super::errors::SensorErrors;
use super::layout::in_view;
use super::occlusion::{Flesh, visible_share};

/// Confidence of a joint that the tracker had to guess.
const GUESSED: f32 = 0.5;

/// A joint is hidden when fewer of its rays than this get through.
const HIDDEN_BELOW: f64 = 0.5;

/// How well each joint of a person is seen.
pub(crate) struct Sight(pub(crate) JointMap<Seen>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    Clearly,
    Hidden,
    OutOfView,
}

impl Sight {
    pub(crate) fn of(
        joints: &JointMap<Position<Sensor>>,
        flesh: &[Flesh],
        person: usize,
        errors: &SensorErrors,
    ) -> Self {
        Self(joints.map(|joint, position| {
            let at = position.vector();
            if errors.field_of_view && !in_view(at) {
                Seen::OutOfView
            } else if errors.occlusion && visible_share(flesh, person, joint, at) < HIDDEN_BELOW {
                Seen::Hidden
            } else {
                Seen::Clearly
            }
        }))
    }

    pub(crate) fn clear(&self) -> usize {
        self.0
            .iter()
            .filter(|(_, seen)| **seen == Seen::Clearly)
            .count()
    }
}

pub(crate) fn confidence(seen: Seen, overconfident: bool) -> Confidence {
    match seen {
        Seen::Hidden if !overconfident => Confidence::saturating(GUESSED),
        _ => Confidence::FULL,
    }
}
