//! Jitter: how much fused joints shake.

use nalgebra::Vector3;
use posefuse_skeleton::Joint;

use super::{LONGEST_STEP_S, SHORTEST_STEP_S, own_error};
use crate::series::Sample;
use crate::tally::Tally;

/// Adds the squared acceleration of the error: the second difference over three successive frames of one track, by
/// the frames' own times. Its root mean square is the jitter, m/s^2. It is linear, so that it is also the
/// acceleration fused less the acceleration that truly was.
pub(super) fn jitter(samples: &[Sample], tally: &mut Tally) {
    for three in samples.windows(3) {
        let [a, b, c] = three else { continue };
        for joint in Joint::ALL {
            let errors = (
                own_error(a, joint),
                own_error(b, joint),
                own_error(c, joint),
            );
            let (Some(ea), Some(eb), Some(ec)) = errors else {
                continue;
            };
            if let Some(acceleration) = acceleration([a, b, c], [ea, eb, ec]) {
                tally.jitter.add(acceleration.norm_squared());
            }
        }
    }
}

/// Second difference of `values` at the times of `samples`, per second squared; `None` if they are not successive
/// frames of one track.
pub(crate) fn acceleration(
    samples: [&Sample; 3],
    values: [Vector3<f64>; 3],
) -> Option<Vector3<f64>> {
    let [a, b, c] = samples;
    let (first, second) = (b.time.since_seconds(a.time), c.time.since_seconds(b.time));
    let steps = SHORTEST_STEP_S..=LONGEST_STEP_S;
    let one = a.track == b.track && b.track == c.track;
    let usable = one && steps.contains(&first) && steps.contains(&second);
    let [va, vb, vc] = values;
    usable.then(|| ((vc - vb) / second - (vb - va) / first) * (2.0 / (first + second)))
}
