//! Fused frames laid beside the truth: one series of samples per person, in order of time.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_simulator::TruePerson;
use posefuse_skeleton::{Joint, JointMap, Provenance, RoomFrame, Timestamp, Track, TrackId};

use crate::compare::compare;
use crate::truth::Truth;

/// A tracker needs to see this many joints of a person; somebody of whom no sensor sees so much cannot be missed.
const JOINTS_TO_BE_THERE: usize = 7;

/// One person in one fused frame.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) time: Timestamp,
    pub(crate) track: TrackId,
    /// Joints as fused, room metres.
    pub(crate) fused: JointMap<Vector3<f64>>,
    /// As they truly are.
    pub(crate) truth: JointMap<Vector3<f64>>,
    /// As all sensors together take them to be: [`Truth::reported`].
    pub(crate) reported: JointMap<Vector3<f64>>,
    /// Whether any sensor truly sees each joint; where nobody knows, whether it counts as measured.
    pub(crate) visible: JointMap<bool>,
}

/// What pairing the frames with the truth gave.
#[derive(Clone, Debug, Default)]
pub(crate) struct Series {
    pub(crate) people: BTreeMap<u64, Vec<Sample>>,
    /// Frames that were compared.
    pub(crate) frames: u64,
    /// People who could be seen, over all frames, and those of them without a track.
    pub(crate) people_frames: u64,
    pub(crate) missed: u64,
    /// Tracks over all frames, and those without a person.
    pub(crate) track_frames: u64,
    pub(crate) extra: u64,
}

/// Pairs every frame from `from` on with the truth of its own time.
pub(crate) fn align(frames: &[RoomFrame], truth: &dyn Truth, from: Timestamp) -> Series {
    let mut series = Series::default();
    for frame in frames.iter().filter(|frame| frame.time >= from) {
        let Some(people) = truth.people(frame.time) else {
            continue;
        };
        let reported = truth.reported(frame.time).unwrap_or_else(|| people.clone());
        let comparison = compare(frame, &people);
        series.frames += 1;
        series.track_frames += frame.tracks.len() as u64;
        series.extra += comparison.extra.len() as u64;
        let could_be_missed = |id: &&u64| seen_enough(truth, frame.time, **id);
        let missed = comparison.missed.iter().filter(could_be_missed).count();
        series.missed += missed as u64;
        series.people_frames += (missed + comparison.pairs.len()) as u64;
        for pair in &comparison.pairs {
            let track = frame.tracks.iter().find(|track| track.id == pair.track);
            let person = people.iter().find(|person| person.id == pair.person);
            if let (Some(track), Some(person)) = (track, person) {
                let reported = reported.iter().find(|person| person.id == pair.person);
                let sample = sample(frame.time, track, person, reported, truth);
                series.people.entry(person.id).or_default().push(sample);
            }
        }
    }
    series
}

fn sample(
    time: Timestamp,
    track: &Track,
    person: &TruePerson,
    reported: Option<&TruePerson>,
    truth: &dyn Truth,
) -> Sample {
    let sighted = truth.sighted(time);
    let sighted = sighted.and_then(|look| look.iter().find(|seen| seen.person == person.id));
    let visible = |joint: Joint| match sighted {
        Some(seen) => seen.joints[joint].is_some(),
        None => track.skeleton[joint]
            .as_ref()
            .is_some_and(|state| matches!(state.provenance, Provenance::Measured(_))),
    };
    Sample {
        time,
        track: track.id,
        fused: track.skeleton.map(|_, state| state.position.vector()),
        truth: person.joints.map(|_, position| position.vector()),
        reported: reported
            .unwrap_or(person)
            .joints
            .map(|_, position| position.vector()),
        visible: person.joints.map(|joint, _| visible(joint)),
    }
}

fn seen_enough(truth: &dyn Truth, time: Timestamp, person: u64) -> bool {
    let Some(look) = truth.sighted(time) else {
        return true;
    };
    let seen = look.iter().find(|seen| seen.person == person);
    seen.is_some_and(|seen| seen.joints.len() >= JOINTS_TO_BE_THERE)
}
