//! `damped`: a joint goes on as it last moved, its velocity dying away.

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, JointMap};

use super::{Spread, fill_gaps};
use crate::repair::{Fill, Window};

/// Poses before the one that is filled.
pub(super) const BEFORE: usize = 30;
/// The velocity is that over so many poses.
const OVER: usize = 2;
/// It dies away with this time constant, seconds.
const DECAY_S: f64 = 0.15;
/// No joint is taken to move faster, m/s.
const MAX_SPEED_MPS: f64 = 8.0;
const SPREAD: Spread = Spread {
    at_once: 0.01,
    speed: 0.25,
    most: 0.5,
};

pub(super) fn fill(window: &Window, now: usize) -> JointMap<Fill> {
    fill_gaps(window, now, SPREAD, |joint, known| {
        let age_s = f64::from(known.age_s);
        let velocity = last_velocity(window, now, joint);
        let way = velocity * (DECAY_S * (1.0 - (-age_s / DECAY_S).exp()));
        (known.position + way, known.age_s)
    })
}

/// How fast the joint moved when it was last measured, m/s; zero where that is not known.
fn last_velocity(window: &Window, now: usize, joint: Joint) -> Vector3<f64> {
    let at = |k: usize| &window.poses[k][joint as usize];
    let measured = |k: &usize| at(*k).weight > 0.0;
    let Some(last) = (0..=now).rev().find(measured) else {
        return Vector3::zeros();
    };
    match last.checked_sub(OVER).filter(measured) {
        Some(earlier) => {
            let way = at(last).position - at(earlier).position;
            (way / (OVER as f64 * window.step_s)).cap_magnitude(MAX_SPEED_MPS)
        }
        None => Vector3::zeros(),
    }
}
