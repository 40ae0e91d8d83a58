//! A run's frames against the truth: what is counted, and how.
//!
//! *Error* is the vector from where a joint truly is to where it was fused, at the frame's own capture time. What
//! tells of movement (lag, jitter, spikes, deviations) is taken from the error without the bias of the body, which
//! changes nothing but what turning bodies would add.

mod lag;
mod menard;
mod motion;
mod sides;

pub(crate) use motion::acceleration;

use posefuse_skeleton::{BONES, Joint, RoomFrame, Timestamp};

use crate::series::{Sample, Series, align};
use crate::tally::Tally;
use crate::truth::Truth;

/// Samples of a person further apart than this do not belong to one movement, seconds.
pub(crate) const LONGEST_STEP_S: f64 = 0.1;
/// Frames nearer to each other than this say nothing of acceleration, seconds.
const SHORTEST_STEP_S: f64 = 0.01;

/// Counts what `frames` from `from` on are worth against `truth`.
pub(crate) fn measure(frames: &[RoomFrame], truth: &dyn Truth, from: Timestamp) -> Tally {
    let series = align(frames, truth, from);
    let mut tally = Tally {
        frames: series.frames,
        people_frames: series.people_frames,
        missed: series.missed,
        track_frames: series.track_frames,
        extra: series.extra,
        ..Tally::default()
    };
    for frame in frames.iter().filter(|frame| frame.time >= from) {
        tally.look_ahead.add(frame.look_ahead_ns as f64 * 1e-9);
    }
    let Series { people, .. } = series;
    for (person, samples) in &people {
        for sample in samples {
            errors(sample, &mut tally);
        }
        for pair in samples.windows(2) {
            tally.id_switches += u64::from(pair[0].track != pair[1].track);
            let step = pair[1].time.since_seconds(pair[0].time);
            if step <= LONGEST_STEP_S {
                tally.person_seconds += step;
            }
        }
        bones(samples, &mut tally);
        motion::jitter(samples, &mut tally);
        menard::measure(samples, *person, truth, &mut tally);
        sides::measure(samples, &mut tally);
        lag::measure(samples, *person, truth, &mut tally);
    }
    tally
}

fn errors(sample: &Sample, tally: &mut Tally) {
    for (joint, truth) in sample.truth.iter() {
        let Some(fused) = sample.fused[joint] else {
            tally.joints.add(0.0);
            continue;
        };
        tally.joints.add(1.0);
        let seen = sample.visible[joint] == Some(true);
        let error = (fused - truth).norm();
        let (all, own) = match seen {
            true => (&mut tally.visible, &mut tally.own_visible),
            false => (&mut tally.occluded, &mut tally.own_occluded),
        };
        all.add(error);
        if let Some(reported) = sample.reported[joint] {
            let error = (fused - reported).norm();
            own.add(error);
            tally.by_joint[joint as usize].add(error);
        }
    }
}

/// Standard deviation of each bone's length over all frames that have both its ends.
pub(crate) fn bones(samples: &[Sample], tally: &mut Tally) {
    for bone in BONES {
        let length = |sample: &Sample| {
            let (a, b) = (sample.fused[bone.parent]?, sample.fused[bone.child]?);
            Some((a - b).norm())
        };
        let lengths: Vec<f64> = samples.iter().filter_map(length).collect();
        if lengths.len() < 2 {
            continue;
        }
        let count = lengths.len() as f64;
        let mean = lengths.iter().sum::<f64>() / count;
        let squares: f64 = lengths.iter().map(|length| (length - mean).powi(2)).sum();
        tally.bone_sigma.add((squares / (count - 1.0)).sqrt());
    }
}

/// The error of `joint` without the bias of the body, metres.
fn own_error(sample: &Sample, joint: Joint) -> Option<nalgebra::Vector3<f64>> {
    Some(sample.fused[joint]? - sample.reported[joint]?)
}

#[cfg(test)]
mod tests;
