//! `linear`: a joint goes straight from where it was last seen to where it is seen again; for takes.

use posefuse_skeleton::JointMap;

use super::{Spread, fill_gaps};
use crate::repair::{Fill, Window};

/// Poses after the one that is filled.
pub(super) const AFTER: usize = 60;
const SPREAD: Spread = Spread {
    at_once: 0.01,
    speed: 0.15,
    most: 0.5,
};

pub(super) fn fill(window: &Window, now: usize) -> JointMap<Fill> {
    let later = &window.poses[now + 1..];
    fill_gaps(window, now, SPREAD, |joint, known| {
        let mut poses = later.iter().map(|pose| &pose[joint as usize]);
        let Some(again) = poses.position(|seen| seen.weight > 0.0) else {
            return (known.position, known.age_s);
        };
        let there = later[again][joint as usize].position;
        let left_s = (again + 1) as f64 * window.step_s;
        let age_s = f64::from(known.age_s);
        let position = known.position.lerp(&there, age_s / (age_s + left_s));
        (position, known.age_s.min(left_s as f32))
    })
}
