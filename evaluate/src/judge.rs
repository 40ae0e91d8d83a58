//! Figures of a run while it goes on: frames are measured a stretch at a time, so that a take of hours fits into
//! memory.

use std::collections::BTreeMap;

use posefuse_skeleton::{RoomFrame, Timestamp, TrackId};

use crate::alone::measure_alone;
use crate::compare::compare;
use crate::measure::measure;
use crate::tally::Tally;
use crate::truth::Truth;

/// Longest stretch that is measured at once, seconds. Bone lengths and lag are figures of a stretch.
const STRETCH_S: f64 = 120.0;
/// Each point of the error over time is a mean over this, seconds.
const POINT_S: f64 = 0.2;

/// Takes in frames and counts what they are worth.
pub struct Judge<'a> {
    truth: Option<&'a dyn Truth>,
    from: Timestamp,
    frames: Vec<RoomFrame>,
    /// The track that last followed each person, from stretch to stretch.
    owners: BTreeMap<u64, TrackId>,
    tally: Tally,
    over_time: BTreeMap<i64, (f64, f64)>,
}

/// What came out for one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Judged {
    /// What was counted.
    pub tally: Tally,
    /// Seconds since the first frame that counts, and the mean error then, metres. Empty without truth.
    pub over_time: Vec<(f64, f64)>,
}

impl<'a> Judge<'a> {
    /// Counts frames from `from` on, against the truth if there is one.
    pub fn new(truth: Option<&'a dyn Truth>, from: Timestamp) -> Self {
        Self {
            truth,
            from,
            frames: Vec::new(),
            owners: BTreeMap::new(),
            tally: Tally::default(),
            over_time: BTreeMap::new(),
        }
    }

    /// Takes in the next frame.
    pub fn add(&mut self, frame: RoomFrame) {
        if frame.time < self.from {
            return;
        }
        let first = self.frames.first().map_or(frame.time, |first| first.time);
        if frame.time.since_seconds(first) > STRETCH_S {
            self.stretch();
        }
        self.frames.push(frame);
    }

    /// The end of the run.
    pub fn finish(mut self) -> Judged {
        self.stretch();
        let point = |(point, (sum, count)): (&i64, &(f64, f64))| {
            (*point as f64 * POINT_S, sum / count.max(1.0))
        };
        Judged {
            over_time: self.over_time.iter().map(point).collect(),
            tally: self.tally,
        }
    }

    fn stretch(&mut self) {
        let frames = std::mem::take(&mut self.frames);
        let Some(truth) = self.truth else {
            self.tally.merge(&measure_alone(&frames));
            return;
        };
        self.tally.merge(&measure(&frames, truth, self.from));
        for (index, frame) in frames.iter().enumerate() {
            let people = truth.reported(frame.time).unwrap_or_default();
            let comparison = compare(frame, &people);
            for pair in &comparison.pairs {
                let before = self.owners.insert(pair.person, pair.track);
                // Within a stretch it was counted already.
                let changed = before.is_some_and(|before| before != pair.track);
                self.tally.id_switches += u64::from(index == 0 && changed);
            }
            if let Some(error) = comparison.mpjpe_m() {
                let point = (frame.time.since_seconds(self.from) / POINT_S).floor() as i64;
                let (sum, count) = self.over_time.entry(point).or_default();
                *sum += error;
                *count += 1.0;
            }
        }
    }
}
