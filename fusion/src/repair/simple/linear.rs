//! `linear`: a joint goes straight from where it was last seen to where it is seen again; for takes.

use posefuse_skeleton::{Joint, JointMap};

use super::{Spread, is_gap};
use crate::repair::{Fill, Window};

/// Poses after the one that is filled.
pub(super) const AFTER: usize = 60;
const SPREAD: Spread = Spread {
    at_once: 0.01,
    speed: 0.15,
    most: 0.5,
};

pub(super) fn fill(window: &Window, now: usize) -> JointMap<Fill> {
    let pose = &window.poses[now];
    let gaps = Joint::ALL.into_iter().zip(pose).filter(|(_, j)| is_gap(j));
    gaps.map(|(joint, known)| {
        let later = &window.poses[now + 1..];
        let again = later
            .iter()
            .position(|pose| pose[joint as usize].weight > 0.0);
        let left_s = again.map(|steps| (steps + 1) as f64 * window.step_s);
        let mut position = known.position;
        let mut nearest_s = known.age_s;
        if let (Some(left_s), Some(again)) = (left_s, again) {
            let there = later[again][joint as usize].position;
            let age_s = f64::from(known.age_s);
            position = position.lerp(&there, age_s / (age_s + left_s));
            nearest_s = nearest_s.min(left_s as f32);
        }
        let fill = Fill {
            position,
            sigma_m: SPREAD.sigma_m(nearest_s),
            rotation: None,
        };
        (joint, fill)
    })
    .collect()
}
