//! What is said of each frame, as packets. Pure.
//!
//! Each packet begins with `/skel/packet`: the frame's number on this stream (up to 2^24, then from 0), which of the frame's
//! packets this is, and how many there are. So a receiver sees what was lost.

use std::collections::BTreeMap;

use posefuse_kinematics::Figure;
use posefuse_skeleton::{Joint, Provenance, Track, TrackId};

use super::{Person as Numbers, Settings};
use crate::LiveFrame;
use crate::packets::{NOW, bundles, floats, time_tag};
use crate::slots::Slots;

/// Floats count up to here without a gap.
const WRAP: u64 = 1 << 24;
const DAY_NS: i64 = 86_400_000_000_000;
const SECOND_NS: i64 = 1_000_000_000;
/// The joints that hands are told of by.
const HANDS: [Joint; 2] = [Joint::HandLeft, Joint::HandRight];

/// Somebody, with their body where there is one.
type Person<'a> = (&'a Track, Option<&'a Figure>);

/// Somebody who talks of one frame after the other.
pub(super) struct Speech {
    settings: Settings,
    slots: Slots,
    frames: u64,
    /// Who is there, by the numbers that they are called by.
    present: BTreeMap<u64, TrackId>,
}

impl Speech {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            slots: Slots::new(settings.slots),
            settings,
            frames: 0,
            present: BTreeMap::new(),
        }
    }

    /// The packets of a frame.
    pub(super) fn frame(&mut self, frame: &LiveFrame) -> Vec<Vec<u8>> {
        let people = self.settings.joints.people(frame);
        let ids: Vec<TrackId> = people.iter().map(|(track, _)| track.id).collect();
        self.slots.update(frame.frame.time, &ids, &ids);
        let mut messages = vec![floats("/skel/time", capture_time(frame.unix_ns))];
        let numbered = people
            .into_iter()
            .filter_map(|person| Some((self.number(person.0.id)?, person)));
        let people: Vec<(u64, Person<'_>)> = numbered.collect();
        let now = people
            .iter()
            .map(|(number, (track, _))| (*number, track.id));
        self.who(now.collect(), &mut messages);
        for (number, person) in people {
            self.person(number, person, &mut messages);
        }
        let tag = match self.settings.time_tags {
            true => time_tag(frame.unix_ns),
            false => NOW,
        };
        self.numbered(&messages, tag)
    }

    /// The packet of a room in which nothing happens.
    pub(super) fn quiet(&mut self) -> Vec<Vec<u8>> {
        self.slots.clear();
        let mut messages = Vec::new();
        self.who(BTreeMap::new(), &mut messages);
        self.numbered(&messages, NOW)
    }

    fn number(&self, id: TrackId) -> Option<u64> {
        match self.settings.person {
            Numbers::Id => Some(id.0),
            Numbers::Slot => self.slots.of(id).map(|slot| slot as u64 + 1),
        }
    }

    /// Who is there, who came and who left.
    fn who(&mut self, now: BTreeMap<u64, TrackId>, messages: &mut Vec<Vec<u8>>) {
        messages.push(floats("/skel/count", [now.len() as f64]));
        messages.push(floats(
            "/skel/people",
            now.keys().map(|number| *number as f64),
        ));
        let news = |new: &BTreeMap<u64, TrackId>, old: &BTreeMap<u64, TrackId>, word: &str| {
            let differ = new
                .iter()
                .filter(|(number, id)| old.get(number) != Some(id));
            let told = differ.map(|(number, _)| floats(format!("/skel/{number}/{word}"), [1.0]));
            told.collect::<Vec<_>>()
        };
        messages.extend(news(&self.present, &now, "leave"));
        messages.extend(news(&now, &self.present, "enter"));
        self.present = now;
    }

    fn person(&self, number: u64, person: Person<'_>, to: &mut Vec<Vec<u8>>) {
        let (track, figure) = person;
        if self.settings.person == Numbers::Slot {
            to.push(floats(format!("/skel/{number}/id"), [track.id.0 as f64]));
        }
        for joint in Joint::ALL {
            let state = track.skeleton[joint].as_ref();
            let address = |what: &str| format!("/skel/{number}/{}/{what}", joint.name());
            if let Some(at) = self.settings.joints.of(person, joint) {
                let at = self.settings.axes.from_room() * at.vector();
                to.push(floats(address("pos"), [at.x, at.y, at.z]));
            }
            if self.settings.confidence {
                let confidence = state.map_or(0.0, |state| f64::from(state.confidence.get()));
                to.push(floats(address("confidence"), [confidence]));
            }
            if self.settings.provenance {
                let source = state.map_or(-1.0, |state| source(state.provenance));
                to.push(floats(address("provenance"), [source]));
            }
        }
        let hands = figure.into_iter().flat_map(|figure| figure.hands);
        for (hand, state) in HANDS.into_iter().zip(hands) {
            if let Some(state) = state {
                let address = format!("/skel/{number}/{}/closed", hand.name());
                to.push(floats(address, [state.closed_probability]));
            }
        }
    }

    fn numbered(&mut self, messages: &[Vec<u8>], tag: crate::packets::TimeTag) -> Vec<Vec<u8>> {
        let number = (self.frames % WRAP) as f64;
        self.frames += 1;
        bundles(messages, tag, |part, parts| {
            let values = [number, part as f64, parts as f64];
            Some(floats("/skel/packet", values))
        })
    }
}

/// Days since 1970, whole seconds of the day, and the rest, UTC: three floats that lose less than a microsecond.
fn capture_time(unix_ns: i64) -> [f64; 3] {
    let (day, rest) = (unix_ns.div_euclid(DAY_NS), unix_ns.rem_euclid(DAY_NS));
    let fraction = (rest % SECOND_NS) as f64 / SECOND_NS as f64;
    [day as f64, (rest / SECOND_NS) as f64, fraction]
}

fn source(provenance: Provenance) -> f64 {
    match provenance {
        Provenance::Measured(_) => 0.0,
        Provenance::Predicted(_) => 1.0,
        Provenance::Repaired => 2.0,
    }
}
