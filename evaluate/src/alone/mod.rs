//! What can be said of fused people without any truth: how they move, and whether a sensor that was left out agrees
//! with what the others made of its people.

mod left_out;
mod motion;

use std::collections::BTreeMap;

use posefuse_skeleton::{JointMap, RoomFrame, TrackId};

pub use left_out::{LeftOut, leave_one_out, left_out_alike};

use crate::measure::{LONGEST_STEP_S, bones};
use crate::series::Sample;
use crate::tally::Tally;

/// Counts what can be counted of `frames` without truth: jitter, spikes and bones of every track.
pub(crate) fn measure_alone(frames: &[RoomFrame]) -> Tally {
    let mut tally = Tally {
        frames: frames.len() as u64,
        ..Tally::default()
    };
    let mut tracks: BTreeMap<TrackId, Vec<Sample>> = BTreeMap::new();
    for frame in frames {
        tally.look_ahead.add(frame.look_ahead_ns as f64 * 1e-9);
        tally.track_frames += frame.tracks.len() as u64;
        for track in &frame.tracks {
            let sample = Sample {
                time: frame.time,
                track: track.id,
                fused: track.skeleton.map(|_, state| state.position.vector()),
                truth: JointMap::empty(),
                reported: JointMap::empty(),
                visible: JointMap::empty(),
            };
            tracks.entry(track.id).or_default().push(sample);
        }
    }
    for samples in tracks.values() {
        for pair in samples.windows(2) {
            let step = pair[1].time.since_seconds(pair[0].time);
            if step <= LONGEST_STEP_S {
                tally.person_seconds += step;
            }
        }
        bones(samples, &mut tally);
        motion::jitter(samples, &mut tally);
        motion::spikes(samples, &mut tally);
    }
    tally
}
