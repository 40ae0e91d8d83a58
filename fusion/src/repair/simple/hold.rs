//! `hold`: a joint stays where it was last seen, in the room.

use posefuse_skeleton::{Joint, JointMap};

use super::{Spread, is_gap};
use crate::repair::{Fill, Window};

const SPREAD: Spread = Spread {
    at_once: 0.02,
    speed: 0.25,
    most: 0.5,
};

pub(super) fn fill(window: &Window, now: usize) -> JointMap<Fill> {
    let pose = &window.poses[now];
    let gaps = Joint::ALL.into_iter().zip(pose).filter(|(_, j)| is_gap(j));
    gaps.map(|(joint, known)| {
        let fill = Fill {
            position: known.position,
            sigma_m: SPREAD.sigma_m(known.age_s),
            rotation: None,
        };
        (joint, fill)
    })
    .collect()
}
