//! `hold`: a joint stays where it was last seen, in the room.

use posefuse_skeleton::JointMap;

use super::{Spread, fill_gaps};
use crate::repair::{Fill, Window};

const SPREAD: Spread = Spread {
    at_once: 0.02,
    speed: 0.25,
    most: 0.5,
};

pub(super) fn fill(window: &Window, now: usize) -> JointMap<Fill> {
    fill_gaps(window, now, SPREAD, |_, known| {
        (known.position, known.age_s)
    })
}
