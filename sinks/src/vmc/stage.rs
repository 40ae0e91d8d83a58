//! Who has which port, and what is sent there of each frame. Pure.
//!
//! A person's packets end with `/VMC/Ext/OK` and `/VMC/Ext/T`: VRM4U takes over a pose when it reads the one, EVMC4U counts
//! frames by the other.

use posefuse_kinematics::Figure;
use posefuse_skeleton::{Timestamp, TrackId};
use rosc::OscType;

use super::body;
use super::{Settings, Travel};
use crate::LiveFrame;
use crate::packets::{NOW, bundles, floats, message};
use crate::slots::Slots;

/// How long it is said again that somebody is gone, seconds: packets get lost.
const AGAIN_S: f64 = 1.0;

/// The ports of one target.
pub(super) struct Stage {
    slots: Slots,
    travel: Travel,
    fingers: bool,
    began: Option<Timestamp>,
    /// Of each slot: whether anybody ever had it, and when it was last said that nobody has.
    used: Vec<bool>,
    told: Vec<Option<Timestamp>>,
}

impl Stage {
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            slots: Slots::new(settings.people),
            travel: settings.travel,
            fingers: settings.fingers,
            began: None,
            used: vec![false; settings.people],
            told: vec![None; settings.people],
        }
    }

    /// Packets, each with the slot it is for.
    pub(super) fn frame(&mut self, frame: &LiveFrame) -> Vec<(usize, Vec<u8>)> {
        let now = frame.frame.time;
        let began = *self.began.get_or_insert(now);
        let time_s = now.since_seconds(began);
        let present: Vec<TrackId> = frame.frame.tracks.iter().map(|track| track.id).collect();
        let ready: Vec<TrackId> = frame.figures.iter().map(|figure| figure.id).collect();
        self.slots.update(now, &present, &ready);
        let holders: Vec<Option<TrackId>> = self.slots.holders().collect();
        let mut packets = Vec::new();
        for (slot, holder) in holders.into_iter().enumerate() {
            let said = match holder {
                Some(id) => {
                    self.used[slot] = true;
                    self.told[slot] = None;
                    let figure = frame.figures.iter().find(|figure| figure.id == id);
                    present_one(figure, self.travel, self.fingers, time_s)
                }
                None if self.is_due(slot, now) => absent(Some(time_s)),
                None => continue,
            };
            packets.extend(said.into_iter().map(|packet| (slot, packet)));
        }
        packets
    }

    /// What is sent when no frame came for a while: everybody is gone.
    pub(super) fn quiet(&mut self) -> Vec<(usize, Vec<u8>)> {
        self.slots.clear();
        let packets = self.used().flat_map(|slot| {
            let packets = absent(None).into_iter();
            packets.map(move |packet| (slot, packet))
        });
        packets.collect()
    }

    /// Slots that somebody had.
    pub(super) fn used(&self) -> impl Iterator<Item = usize> {
        let used = self.used.iter().enumerate();
        used.filter(|(_, used)| **used).map(|(slot, _)| slot)
    }

    /// Whether it is time to say that nobody has this slot any more.
    fn is_due(&mut self, slot: usize, now: Timestamp) -> bool {
        let told = self.told[slot].is_some_and(|told| now.since_seconds(told) < AGAIN_S);
        let due = self.used[slot] && !told;
        if due {
            self.told[slot] = Some(now);
        }
        due
    }
}

/// Somebody who is there; without a figure, as when only an arm is seen, the last pose stays.
fn present_one(
    figure: Option<&Figure>,
    travel: Travel,
    fingers: bool,
    time_s: f64,
) -> Vec<Vec<u8>> {
    let mut messages = match figure {
        Some(figure) => body::messages(figure, travel, fingers),
        None => Vec::new(),
    };
    // The model is loaded, calibrated, in normal mode, and tracked or not.
    messages.push(ok([1, 3, 0, i32::from(figure.is_some())]));
    messages.push(floats("/VMC/Ext/T", [time_s]));
    bundles(&messages, NOW, |_, _| None)
}

/// Nobody is there: no model, not calibrated (upon which EVMC4U can hide its own), not tracked.
pub(super) fn absent(time_s: Option<f64>) -> Vec<Vec<u8>> {
    let mut messages = vec![ok([0, 0, 0, 0])];
    messages.extend(time_s.map(|time_s| floats("/VMC/Ext/T", [time_s])));
    bundles(&messages, NOW, |_, _| None)
}

fn ok(states: [i32; 4]) -> Vec<u8> {
    message("/VMC/Ext/OK", states.map(OscType::Int).to_vec())
}
