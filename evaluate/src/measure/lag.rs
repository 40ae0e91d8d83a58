//! Lag: how much older the fused people are than they say.

use nalgebra::Vector3;
use posefuse_skeleton::{JointMap, Timestamp};

use crate::series::Sample;
use crate::tally::Tally;
use crate::truth::Truth;

/// Joints that are further off say more of other things than of lag, metres.
const FURTHEST_M: f64 = 0.15;
/// Every so many samples are enough.
const EVERY: usize = 3;
/// Half the time over which a velocity is taken, nanoseconds.
const HALF_STEP_NS: i64 = 8_000_000;
/// Gauss-Newton rounds.
const ROUNDS: usize = 3;

/// The shift in time that minimises the squared error over all joints within 15 cm, by Gauss-Newton; positive where
/// the fused people trail behind. What a frame waited for, its look-ahead, comes on top.
pub(super) fn measure(samples: &[Sample], person: u64, truth: &dyn Truth, tally: &mut Tally) {
    let mut lag = 0.0;
    let mut weight = 0.0;
    for _ in 0..ROUNDS {
        let (mut top, mut bottom) = (0.0, 0.0);
        for sample in samples.iter().step_by(EVERY) {
            let at = sample.time.plus_ns((-lag * 1e9_f64).round() as i64);
            let here = joints(truth, at, person);
            let before = joints(truth, at.plus_ns(-HALF_STEP_NS), person);
            let after = joints(truth, at.plus_ns(HALF_STEP_NS), person);
            let (Some(here), Some(before), Some(after)) = (here, before, after) else {
                continue;
            };
            for (joint, fused) in sample.fused.iter() {
                let (Some(here), Some(before), Some(after)) =
                    (here[joint], before[joint], after[joint])
                else {
                    continue;
                };
                let error = fused - here;
                let velocity = (after - before) / (2.0 * HALF_STEP_NS as f64 * 1e-9);
                if error.norm() < FURTHEST_M {
                    top -= error.dot(&velocity);
                    bottom += velocity.norm_squared();
                }
            }
        }
        if bottom < 1e-9 {
            return;
        }
        lag += top / bottom;
        weight = bottom;
    }
    tally.lag.sum += lag * weight;
    tally.lag.count += weight;
}

fn joints(truth: &dyn Truth, time: Timestamp, person: u64) -> Option<JointMap<Vector3<f64>>> {
    let people = truth.reported(time)?;
    let person = people.iter().find(|found| found.id == person)?;
    Some(person.joints.map(|_, position| position.vector()))
}
