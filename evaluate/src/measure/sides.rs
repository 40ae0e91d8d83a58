//! Left and right: whether a fused person is a mirror image.

use posefuse_skeleton::{Joint, SIDE_PAIRS};

use crate::series::Sample;
use crate::tally::Tally;

/// Counts, for each frame of a person, whether both arms and legs are nearer to where they truly are than to the
/// other side's place. An arm or a leg of which nothing is fused is no reason for a no.
pub(super) fn measure(samples: &[Sample], tally: &mut Tally) {
    for sample in samples {
        let right = [false, true]
            .into_iter()
            .all(|legs| limbs_right(sample, legs));
        tally.sides_right.add(f64::from(u8::from(right)));
    }
}

fn limbs_right(sample: &Sample, legs: bool) -> bool {
    let (mut as_is, mut mirrored) = (0.0, 0.0);
    let pairs = SIDE_PAIRS.iter().filter(|(left, _)| is_leg(*left) == legs);
    for joint in pairs.flat_map(|(left, right)| [*left, *right]) {
        let places = (
            sample.fused[joint],
            sample.reported[joint],
            sample.reported[joint.mirrored()],
        );
        if let (Some(fused), Some(own), Some(other)) = places {
            as_is += (fused - own).norm();
            mirrored += (fused - other).norm();
        }
    }
    as_is <= mirrored
}

fn is_leg(joint: Joint) -> bool {
    use Joint::*;
    matches!(joint, HipLeft | KneeLeft | AnkleLeft | FootLeft)
}
