//! How far a body is from a track.

use posefuse_skeleton::{JOINT_COUNT, Joint};

use crate::body::Body;

/// No single joint counts as further off than this, metres.
const CLIP_M: f64 = 1.5;
/// Common joints below which nothing can be said.
const MIN_COMMON: usize = 3;

/// Mean joint distance under the better of both labellings, metres, weighted by confidence; `None` with too few
/// common joints.
pub(crate) fn distance(body: &Body, predicted: &Body) -> Option<f64> {
    let (mut as_is, mut mirrored, mut weights, mut count) = (0.0, 0.0, 0.0, 0);
    for joint in Joint::ALL {
        let (index, other) = (joint as usize, joint.mirrored() as usize);
        if !(body.has(index) && predicted.has(index) && predicted.has(other)) {
            continue;
        }
        let weight = 0.1 + f64::from(body.confidence[index]);
        let here = body.position[index];
        let direct = (here - predicted.position[index]).norm().min(CLIP_M);
        as_is += weight * direct;
        mirrored += weight
            * if other == index {
                direct
            } else {
                (here - predicted.position[other]).norm().min(CLIP_M)
            };
        weights += weight;
        count += 1;
    }
    (count >= MIN_COMMON).then(|| f64::min(as_is, mirrored) / weights)
}

/// Median joint distance under the better of both labellings, metres.
pub(crate) fn median_distance(a: &Body, b: &Body) -> Option<f64> {
    let median = |partner: &dyn Fn(Joint) -> Joint| {
        let mut distances = [0.0; JOINT_COUNT];
        let mut count = 0;
        for joint in Joint::ALL {
            let (index, other) = (joint as usize, partner(joint) as usize);
            if a.has(index) && b.has(other) {
                distances[count] = (a.position[index] - b.position[other]).norm();
                count += 1;
            }
        }
        median(&mut distances[..count])
    };
    let as_is = median(&|joint| joint)?;
    Some(as_is.min(median(&Joint::mirrored)?))
}

/// The middle value, the lower of two; `None` of nothing.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
