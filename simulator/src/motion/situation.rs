//! What the people of a room do most.

use serde::{Deserialize, Serialize};

/// A situation that people in front of sensors get into, gone through again and again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Situation {
    /// Walking, turning, reaching, crouching, sitting, waving, crossing each other.
    #[default]
    Everyday,
    /// Two at a time walk past each other, 42 to 60 cm from spine to spine.
    Crossing,
    /// Two at a time embrace, 18 to 26 cm from pelvis to pelvis.
    Hugging,
    /// Everybody leaves the room by a door now and then, and comes back by it.
    Leaving,
    /// Sitting on a chair for 15 to 25 s at a time.
    Sitting,
    /// Lying on the back for 12 to 20 s at a time.
    Lying,
    /// Turning on the spot, half a turn to two turns at a time.
    Turning,
    /// Everybody faces away (room -x) for the first 20 s: an arc of sensors sees nothing but backs.
    Away,
}

impl Situation {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Everyday,
        Self::Crossing,
        Self::Hugging,
        Self::Leaving,
        Self::Sitting,
        Self::Lying,
        Self::Turning,
        Self::Away,
    ];

    /// Where people face at first, radians from room x, if not inwards.
    pub(crate) fn first_heading(self) -> Option<f64> {
        (self == Self::Away).then_some(std::f64::consts::PI)
    }
}
