//! A standing person with an arm that goes out of sight: what every model is tried with before it is used.

use posefuse_fusion::MAX_AGE_S;
use posefuse_skeleton::Joint;

use crate::tensors::{JOINTS, Tensors};
use crate::windows;

/// A person of 1.75 m in the room's middle, facing +X, arms hanging; metres, in the order of [`Joint::ALL`].
const STANDING: [[f32; 3]; JOINTS] = [
    [0.0, 0.0, 0.95],
    [0.0, 0.0, 1.20],
    [0.0, 0.0, 1.50],
    [0.0, 0.0, 1.65],
    [0.0, 0.18, 1.42],
    [0.0, 0.22, 1.15],
    [0.0, 0.24, 0.90],
    [0.02, 0.24, 0.82],
    [0.0, -0.18, 1.42],
    [0.0, -0.22, 1.15],
    [0.0, -0.24, 0.90],
    [0.02, -0.24, 0.82],
    [0.0, 0.09, 0.92],
    [0.0, 0.10, 0.50],
    [0.0, 0.10, 0.09],
    [0.12, 0.10, 0.03],
    [0.0, -0.09, 0.92],
    [0.0, -0.10, 0.50],
    [0.0, -0.10, 0.09],
    [0.12, -0.10, 0.03],
    [0.0, 0.0, 1.44],
    [0.02, 0.24, 0.74],
    [0.05, 0.22, 0.80],
    [0.02, -0.24, 0.74],
    [0.05, -0.22, 0.80],
];
/// What goes out of sight.
const ARM: [Joint; 5] = [
    Joint::ElbowLeft,
    Joint::WristLeft,
    Joint::HandLeft,
    Joint::HandTipLeft,
    Joint::ThumbLeft,
];

/// Writes `count` windows: in every second one the left arm is seen in the first half only.
pub(crate) fn fill(tensors: &mut Tensors, rate_hz: f64, count: usize) {
    tensors.clear();
    for window in 0..count {
        // The last window alone is what a call with one window gets.
        let hides = window + 1 == count;
        for pose in 0..tensors.poses {
            for (joint, position) in Joint::ALL.into_iter().zip(&STANDING) {
                let seen = tensors.poses / 2;
                let hidden = hides && pose >= seen && ARM.contains(&joint);
                tensors.pose.extend_from_slice(position);
                tensors.mask.push(if hidden { 0.0 } else { 1.0 });
                let since = if hidden { pose + 1 - seen } else { 0 };
                let age = (since as f64 / rate_hz) as f32;
                tensors.age.push(age.min(MAX_AGE_S));
            }
        }
    }
}

/// Whether the outputs are as many as they should be, and put every joint near that person.
pub(crate) fn check(tensors: &Tensors, count: usize) -> Result<(), String> {
    tensors.check_outputs(count)?;
    windows::check_outputs(tensors, [0.0, 0.0, 0.95])
}
