//! The four figures of Menard (2014), who merged several Kinects by their mean: two distances of the wrists, and two
//! counts of what an eye would see.
//!
//! - *Absolute difference*: mean distance of a wrist from where it truly is.
//! - *Shortest distance*: mean distance of a wrist from the nearest place where it truly was within 0.2 s either way;
//!   what is merely late is close.
//! - *Spike*: a joint's error changes by more than 10 cm within four frames. It lasts as long as that is so, and counts
//!   once.
//! - *Deviation*: a joint stays more than 20 cm off for a third of a second or longer. It counts once.

use posefuse_skeleton::{Joint, Timestamp};

use super::{LONGEST_STEP_S, own_error};
use crate::series::Sample;
use crate::tally::Tally;
use crate::truth::Truth;

const WRISTS: [Joint; 2] = [Joint::WristLeft, Joint::WristRight];
/// How far from its time the nearest true place of a wrist is looked for, and in which steps, nanoseconds.
const WINDOW_NS: i64 = 200_000_000;
const STEP_NS: i64 = 20_000_000;
/// Every so many samples are enough for the shortest distance.
const EVERY: usize = 4;

const SPIKE_M: f64 = 0.10;
const SPIKE_FRAMES: usize = 4;
const DEVIATION_M: f64 = 0.20;
const DEVIATION_S: f64 = 1.0 / 3.0;

pub(super) fn measure(samples: &[Sample], person: u64, truth: &dyn Truth, tally: &mut Tally) {
    for sample in samples {
        for wrist in WRISTS {
            if let (Some(fused), Some(truth)) = (sample.fused[wrist], sample.truth[wrist]) {
                tally.wrist.add((fused - truth).norm());
            }
        }
    }
    for sample in samples.iter().step_by(EVERY) {
        shortest(sample, person, truth, tally);
    }
    for joint in Joint::ALL {
        tally.spikes += spikes(samples, joint);
        tally.deviations += deviations(samples, joint);
    }
}

fn shortest(sample: &Sample, person: u64, truth: &dyn Truth, tally: &mut Tally) {
    let mut nearest = [f64::INFINITY; WRISTS.len()];
    let times = (-WINDOW_NS..=WINDOW_NS).step_by(STEP_NS as usize);
    for time in times.map(|ns| sample.time.plus_ns(ns)) {
        let Some(people) = truth.people(time) else {
            continue;
        };
        let Some(person) = people.iter().find(|found| found.id == person) else {
            continue;
        };
        for (nearest, wrist) in nearest.iter_mut().zip(WRISTS) {
            if let (Some(fused), Some(truth)) = (sample.fused[wrist], person.joints[wrist]) {
                *nearest = nearest.min((fused - truth.vector()).norm());
            }
        }
    }
    for distance in nearest.into_iter().filter(|distance| distance.is_finite()) {
        tally.wrist_shortest.add(distance);
    }
}

fn spikes(samples: &[Sample], joint: Joint) -> u64 {
    let (mut count, mut going_on) = (0, false);
    for (index, sample) in samples.iter().enumerate() {
        let Some(now) = own_error(sample, joint) else {
            going_on = false;
            continue;
        };
        let before = &samples[index.saturating_sub(SPIKE_FRAMES)..index];
        let jumped = before.iter().rev().any(|before| {
            let near =
                sample.time.since_seconds(before.time) <= SPIKE_FRAMES as f64 * LONGEST_STEP_S;
            let error = own_error(before, joint).filter(|_| near && before.track == sample.track);
            error.is_some_and(|error| (now - error).norm() > SPIKE_M)
        });
        count += u64::from(jumped && !going_on);
        going_on = jumped;
    }
    count
}

fn deviations(samples: &[Sample], joint: Joint) -> u64 {
    let (mut count, mut since, mut last): (_, Option<Timestamp>, Option<Timestamp>) =
        (0, None, None);
    for sample in samples {
        let off = own_error(sample, joint).is_some_and(|error| error.norm() > DEVIATION_M);
        let successive = last.is_some_and(|last| sample.time.since_seconds(last) <= LONGEST_STEP_S);
        if !off || !successive {
            since = None;
        }
        if off {
            let begun = *since.get_or_insert(sample.time);
            let lasted = |time: Timestamp| time.since_seconds(begun) >= DEVIATION_S;
            let before = last.is_some_and(lasted);
            count += u64::from(lasted(sample.time) && !before);
        }
        last = Some(sample.time);
    }
    count
}
