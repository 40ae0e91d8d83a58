//! The first reading of a take: who is seen from when to when, and how far frames are apart.

use std::collections::BTreeMap;

use posefuse_session::TakeReader;
use posefuse_skeleton::{Room, Skeleton, Timestamp};

use crate::source::Seen;
use crate::{Options, Phase, Progress, Result, Who};

/// From when to when a person is seen.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    pub(crate) first: Timestamp,
    pub(crate) last: Timestamp,
}

impl Span {
    fn at(time: Timestamp) -> Self {
        Self {
            first: time,
            last: time,
        }
    }

    /// Lets it reach until `time`; gives the step from its end if there is one.
    fn reach(&mut self, time: Timestamp) -> Option<i64> {
        (time > self.last).then(|| {
            let step_ns = time.since_ns(self.last);
            self.last = time;
            step_ns
        })
    }
}

/// What the first look learns of a person.
pub(crate) struct Seeing {
    /// In the whole take: it tells people from passers-by, however short a piece of the take is exported.
    pub(crate) whole: Span,
    /// In the span that is asked for, or just beside it.
    pub(crate) asked: Option<Span>,
}

/// The first reading.
#[derive(Default)]
pub(crate) struct Scan {
    pub(crate) people: BTreeMap<Who, Seeing>,
    /// How often each time between two frames of a person was seen, in tenths of a millisecond: fine enough for a rate, and
    /// it bounds the table.
    pub(crate) steps: BTreeMap<i64, u64>,
}

impl Scan {
    /// Reads the take once; `learn` is shown everybody, and told who is seen in `from..=to`. People are looked for in the span `from..=to` and just beside it.
    pub(crate) fn of(
        take: &TakeReader,
        options: &Options,
        (from, to): (Option<Timestamp>, Option<Timestamp>),
        learn: &mut dyn FnMut(&Who, &Skeleton<Room>, bool),
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self> {
        // Who is seen a little before the span and in it is there from its beginning.
        let gap_ns = (options.max_gap_s * 1e9) as i64;
        let first = from.unwrap_or(Timestamp::from_ns(i64::MIN));
        let last = to.unwrap_or(Timestamp::from_ns(i64::MAX));
        let (span, margin) = (first..=last, first.plus_ns(-gap_ns)..=last.plus_ns(gap_ns));
        let mut scan = Self::default();
        let total = options.source.messages(take);
        for (done, seen) in options.source.read(take)?.enumerate() {
            progress(Progress {
                phase: Phase::Looking,
                done: done as u64 + 1,
                total,
            });
            let Some(Seen { time, people }) = seen? else {
                continue;
            };
            for (who, person) in people {
                // A body is learned from the whole take: a person has the same rig in every span.
                learn(&who, &person.skeleton, span.contains(&time));
                scan.add(who, time, margin.contains(&time));
            }
        }
        Ok(scan)
    }

    fn add(&mut self, who: Who, time: Timestamp, asked: bool) {
        let person = self.people.entry(who).or_insert(Seeing {
            whole: Span::at(time),
            asked: None,
        });
        if let Some(step_ns) = person.whole.reach(time) {
            *self.steps.entry(step_ns / 100_000).or_default() += 1;
        }
        if asked {
            person.asked.get_or_insert(Span::at(time)).reach(time);
        }
    }
}
