//! The last step before a frame leaves the engine: what is missing is asked for, waited for, and put in.
//!
//! Frames leave in order. One waits while the model wants to see what comes after it, and while the model outside has not
//! answered and its deadline has not passed. Windows hold what was measured, never what was made up, so that several
//! frames can be asked for at once and no model feeds on its own words.

use std::collections::{BTreeMap, VecDeque};
use std::ops::RangeInclusive;

use posefuse_skeleton::{JointMap, RoomFrame, Timestamp, TrackId};
use serde::{Deserialize, Serialize};

use super::blend::Source;
use super::choice::Choice;
use super::person::Person;
use super::waiting::{Answer, Waiting};
use super::{
    Circumstances, Fill, Outlet, RepairAnswer, RepairConfig, RepairCounts, RepairModel,
    RepairRequest,
};
use crate::config::seconds_to_ns;

/// Requests without an answer at most, live; then the oldest frame goes on without.
const MOST_ASKED: usize = 32;
/// The same where frames wait for later ones anyway.
const MOST_ASKED_OFFLINE: usize = 2048;
/// What a model can ask to see, poses on one side, and poses per second.
const MOST_POSES: usize = 600;
const RATES_HZ: RangeInclusive<f64> = 1.0..=240.0;
/// Poses are kept this much longer than windows reach, ns.
const SPARE_NS: i64 = 200_000_000;

/// Everybody, and the frames that wait.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Repair {
    outside: Option<RepairModel>,
    people: BTreeMap<TrackId, Person>,
    /// Oldest first.
    waiting: VecDeque<Waiting>,
    /// Time of the newest frame.
    newest: Option<Timestamp>,
    /// Requests so far.
    asked: u64,
    counts: RepairCounts,
}

impl Repair {
    /// The model outside, if there is one.
    pub(crate) fn outside(&self) -> Option<&RepairModel> {
        self.outside.as_ref()
    }

    pub(crate) fn counts(&self) -> RepairCounts {
        self.counts
    }

    /// The name of the model in effect; `None`: nothing is made up.
    pub(crate) fn model(&self, config: &RepairConfig, offline: bool) -> Option<String> {
        Some(Choice::of(config, self.outside.as_ref(), offline)?.name)
    }

    /// The next deadline of an answer.
    pub(crate) fn wake(&self) -> Option<Timestamp> {
        let open = self.waiting.iter().flat_map(Waiting::open);
        open.map(|(_, deadline)| deadline).min()
    }

    /// There is another model outside, or none; one whose needs cannot be met counts as none.
    pub(crate) fn offer(&mut self, model: Option<RepairModel>) {
        self.outside = model.filter(|model| {
            let needs = &model.needs;
            RATES_HZ.contains(&needs.rate_hz)
                && needs.before <= MOST_POSES
                && needs.after <= MOST_POSES
        });
    }

    /// Takes the next frame.
    pub(crate) fn push(&mut self, frame: RoomFrame, at: &Circumstances, out: &mut dyn Outlet) {
        let choice = Choice::of(at.config, self.outside.as_ref(), at.offline);
        let Some(choice) = choice else {
            return out.frame(frame);
        };
        let time = frame.time;
        let gaps = (frame.tracks.iter())
            .map(|track| {
                let person = self.people.entry(track.id);
                let person = person.or_insert_with(|| Person::new(time));
                person.learn(time, &track.skeleton, at.known, at.config)
            })
            .collect();
        self.newest = Some(time);
        self.waiting.push_back(Waiting {
            frame,
            gaps,
            asked: false,
            answers: Vec::new(),
            last: false,
        });
        self.go_on(&choice, at, out);
        self.forget(&choice);
    }

    /// What the model outside answered.
    pub(crate) fn take(&mut self, answer: RepairAnswer, at: &Circumstances) {
        let slots = self.waiting.iter_mut().flat_map(|w| &mut w.answers);
        let open = |slot: &&mut Answer| {
            matches!(slot, Answer::Open { number, deadline }
            if *number == answer.number && at.now < *deadline)
        };
        let mut slots = slots.filter(open);
        let Some(slot) = slots.next() else {
            self.counts.unknown += 1;
            return;
        };
        // One pose was wanted.
        match <[JointMap<Fill>; 1]>::try_from(answer.fills) {
            Ok([fills]) => {
                *slot = Answer::Filled {
                    fills: Box::new(fills),
                    source: Source::Outside { back: false },
                };
                self.counts.answered += 1;
            }
            Err(_) => {
                *slot = Answer::Failed;
                self.counts.failed += 1;
            }
        }
    }

    /// Gives up what is waited for in vain, and gives every frame that is ready.
    pub(crate) fn tick(&mut self, at: &Circumstances, out: &mut dyn Outlet) {
        if self.waiting.is_empty() {
            return;
        }
        match Choice::of(at.config, self.outside.as_ref(), at.offline) {
            Some(choice) => self.go_on(&choice, at, out),
            None => self.give_all(out),
        }
    }

    /// Nothing comes for a while: no frame waits for later ones any more.
    pub(crate) fn flush(&mut self, at: &Circumstances, out: &mut dyn Outlet) {
        for waiting in &mut self.waiting {
            waiting.last = true;
        }
        self.tick(at, out);
    }

    /// Nothing comes at all: what was asked before this is not waited for.
    pub(crate) fn finish(&mut self, at: &Circumstances, out: &mut dyn Outlet) {
        self.close_all(at);
        self.flush(at, out);
    }

    /// Starts afresh for `id`, or for everybody: what was known of places holds no more. No frame waits longer.
    pub(crate) fn restart(
        &mut self,
        id: Option<TrackId>,
        at: &Circumstances,
        out: &mut dyn Outlet,
    ) {
        self.flush(at, out);
        self.finish(at, out);
        for (known, person) in &mut self.people {
            if id.is_none_or(|id| id == *known) {
                person.restart();
            }
        }
    }

    /// Forgets who is not among `known` (ascending) and in no frame that waits.
    pub(crate) fn retain(&mut self, known: &[TrackId]) {
        let Self {
            people, waiting, ..
        } = self;
        people.retain(|id, _| {
            let mut tracks = waiting.iter().flat_map(|w| &w.frame.tracks);
            known.binary_search(id).is_ok() || tracks.any(|track| track.id == *id)
        });
    }

    /// The deadline of everything that is open is now.
    fn close_all(&mut self, at: &Circumstances) {
        for answer in self.waiting.iter_mut().flat_map(|w| &mut w.answers) {
            if let Answer::Open { deadline, .. } = answer {
                *deadline = (*deadline).min(at.now);
            }
        }
    }

    fn go_on(&mut self, choice: &Choice, at: &Circumstances, out: &mut dyn Outlet) {
        self.ask_all(choice, at, out);
        self.expire(choice, at);
        while self.waiting.front().is_some_and(Waiting::is_ready) {
            if let Some(ready) = self.waiting.pop_front() {
                out.frame(self.finished(ready, at));
            }
        }
    }

    /// Asks for every frame whose later ones have come.
    fn ask_all(&mut self, choice: &Choice, at: &Circumstances, out: &mut dyn Outlet) {
        let after_ns = seconds_to_ns(choice.after_s());
        let newest = self.newest;
        for index in 0..self.waiting.len() {
            let waiting = &mut self.waiting[index];
            let people = waiting.frame.tracks.len();
            if waiting.asked {
                continue;
            }
            let seen_ns = newest.map_or(0, |newest| newest.since_ns(waiting.frame.time));
            if !waiting.last && seen_ns < after_ns {
                return;
            }
            waiting.asked = true;
            if after_ns > 0 {
                // This delay was chosen; what an answer takes is suffered.
                waiting.frame.look_ahead_ns += seen_ns;
            }
            for track in 0..people {
                let answer = self.ask(index, track, choice, at, out);
                self.waiting[index].answers.push(answer);
            }
        }
    }

    fn ask(
        &mut self,
        index: usize,
        track: usize,
        choice: &Choice,
        at: &Circumstances,
        out: &mut dyn Outlet,
    ) -> Answer {
        let waiting = &self.waiting[index];
        if waiting.gaps[track] == 0 {
            return Answer::None;
        }
        let (time, id) = (waiting.frame.time, waiting.frame.tracks[track].id);
        let Some(needs) = &choice.outside else {
            return self.fill(id, time, choice);
        };
        let Some(person) = self.people.get(&id) else {
            return Answer::None;
        };
        self.asked += 1;
        self.counts.asked += 1;
        let deadline = at.now.plus_ns(at.config.deadline_ns());
        out.request(RepairRequest {
            number: self.asked,
            track: id,
            time,
            asked: at.now,
            deadline,
            window: person.history.window(time, needs),
            wanted: needs.before..needs.before + 1,
        });
        Answer::Open {
            number: self.asked,
            deadline,
        }
    }

    /// What the simple model says.
    fn fill(&self, id: TrackId, time: Timestamp, choice: &Choice) -> Answer {
        let Some(person) = self.people.get(&id) else {
            return Answer::None;
        };
        let needs = choice.simple.needs_of();
        let window = person.history.window(time, &needs);
        Answer::Filled {
            fills: Box::new(choice.simple.fill_one(&window, needs.before)),
            source: Source::Simple { back: false },
        }
    }

    /// The simple model stands in for answers that did not come in time, or for the oldest where too many are open.
    fn expire(&mut self, choice: &Choice, at: &Circumstances) {
        let most = match at.offline {
            true => MOST_ASKED_OFFLINE,
            false => MOST_ASKED,
        };
        let open = self.waiting.iter().flat_map(Waiting::open).count();
        let mut too_many = open.saturating_sub(most);
        for index in 0..self.waiting.len() {
            for track in 0..self.waiting[index].answers.len() {
                let waiting = &self.waiting[index];
                match waiting.answers[track] {
                    Answer::Failed => {}
                    Answer::Open { deadline, .. } if deadline <= at.now || too_many > 0 => {
                        too_many = too_many.saturating_sub(1);
                        self.counts.late += 1;
                    }
                    Answer::None | Answer::Open { .. } | Answer::Filled { .. } => continue,
                }
                let waiting = &self.waiting[index];
                let (time, id) = (waiting.frame.time, waiting.frame.tracks[track].id);
                self.waiting[index].answers[track] = self.fill(id, time, choice);
            }
        }
    }

    /// The frame with what was made up.
    fn finished(&mut self, ready: Waiting, at: &Circumstances) -> RoomFrame {
        let Waiting {
            mut frame,
            gaps,
            answers,
            ..
        } = ready;
        let blend_s = at.config.blend_ms * 1e-3;
        for ((track, gaps), answer) in frame.tracks.iter_mut().zip(gaps).zip(&answers) {
            let Some(person) = self.people.get_mut(&track.id) else {
                continue;
            };
            let made = match answer {
                Answer::Filled { fills, source } => Some((&**fills, *source)),
                Answer::None | Answer::Open { .. } | Answer::Failed => None,
            };
            let joints = person.finish(frame.time, &mut track.skeleton, gaps, made, blend_s);
            self.counts.joints += joints;
            self.counts.poses += u64::from(joints > 0);
        }
        frame
    }

    /// Nothing is made up any more.
    fn give_all(&mut self, out: &mut dyn Outlet) {
        for waiting in self.waiting.drain(..) {
            out.frame(waiting.frame);
        }
    }

    /// Forgets poses that no window reaches any more.
    fn forget(&mut self, choice: &Choice) {
        let Some(newest) = self.newest else {
            return;
        };
        let oldest = self.waiting.front().map_or(newest, |w| w.frame.time);
        let until = oldest.plus_ns(-seconds_to_ns(choice.before_s()) - SPARE_NS);
        for person in self.people.values_mut() {
            person.history.forget_before(until);
        }
    }
}
