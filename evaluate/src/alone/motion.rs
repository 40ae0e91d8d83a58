//! How joints move, without truth: measured against the same joint's own smooth motion.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::Joint;

use crate::measure::{LONGEST_STEP_S, acceleration};
use crate::series::Sample;
use crate::tally::Tally;

/// The smooth motion at an instant: a parabola through the samples within this many seconds either way.
const HALF_FIT_S: f64 = 0.2;
/// Fewer samples make no parabola.
const FEWEST: usize = 6;

const SPIKE_M: f64 = 0.10;
/// A spike is out and back within four frames: so many before and after its middle.
const SPIKE_HALF: usize = 2;

/// Adds the squared acceleration of what a joint's own smooth motion does not explain. People's own quick
/// accelerations are in it too, in equal measure for every method.
pub(super) fn jitter(samples: &[Sample], tally: &mut Tally) {
    for joint in Joint::ALL {
        let rest: Vec<Option<Vector3<f64>>> = (0..samples.len())
            .map(|index| Some(samples[index].fused[joint]? - smooth(samples, index, joint)?))
            .collect();
        for (three, rest) in samples.windows(3).zip(rest.windows(3)) {
            if let ([a, b, c], [Some(ra), Some(rb), Some(rc)]) = (three, rest)
                && let Some(found) = acceleration([a, b, c], [*ra, *rb, *rc])
            {
                tally.jitter.add(found.norm_squared());
            }
        }
    }
}

/// Where a parabola through the samples around has the joint.
fn smooth(samples: &[Sample], index: usize, joint: Joint) -> Option<Vector3<f64>> {
    let middle = samples[index].time;
    let near = |sample: &&Sample| sample.time.since_seconds(middle).abs() <= HALF_FIT_S;
    let before = samples[..index].iter().rev().take_while(near);
    let after = samples[index..].iter().take_while(near);
    let (mut normal, mut sides, mut count) = (Matrix3::zeros(), [Vector3::zeros(); 3], 0);
    for sample in before.chain(after) {
        let Some(at) = sample.fused[joint] else {
            continue;
        };
        let t = sample.time.since_seconds(middle) / HALF_FIT_S;
        let row = Vector3::new(1.0, t, t * t);
        normal += row * row.transpose();
        for (side, value) in sides.iter_mut().zip(at.iter()) {
            *side += row * *value;
        }
        count += 1;
    }
    if count < FEWEST {
        return None;
    }
    let inverse = normal.try_inverse()?;
    Some(Vector3::from(sides.map(|side| (inverse * side).x)))
}

/// Counts the times that a joint leaves the straight way between where it was two frames before and two frames later
/// by more than 10 cm. It lasts as long as that is so, and counts once.
pub(super) fn spikes(samples: &[Sample], tally: &mut Tally) {
    for joint in Joint::ALL {
        let mut going_on = false;
        for five in samples.windows(2 * SPIKE_HALF + 1) {
            let jumped = leaves_the_way(five, joint);
            tally.spikes += u64::from(jumped && !going_on);
            going_on = jumped;
        }
    }
}

fn leaves_the_way(five: &[Sample], joint: Joint) -> bool {
    let (first, middle, last) = (&five[0], &five[SPIKE_HALF], &five[2 * SPIKE_HALF]);
    let whole = last.time.since_seconds(first.time);
    if whole > 2.0 * SPIKE_HALF as f64 * LONGEST_STEP_S || whole <= 0.0 {
        return false;
    }
    let share = middle.time.since_seconds(first.time) / whole;
    let places = (first.fused[joint], middle.fused[joint], last.fused[joint]);
    let (Some(a), Some(b), Some(c)) = places else {
        return false;
    };
    (b - a.lerp(&c, share)).norm() > SPIKE_M
}
