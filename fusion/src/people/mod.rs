//! Who is in the room: bodies become tracks (`assign`), tracks become a frame (`frame`), doubles become one (`merge`).

mod assign;
mod birth;
mod compare;
mod cost;
mod estimate;
mod facing;
mod frame;
mod hungarian;
mod merge;
mod reflection;
mod swap;
mod track;

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{SensorId, Timestamp, TrackId};
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::config::AssociateConfig;
use crate::fuse::Sighting;
use crate::fuse::kalman::Part;
use hungarian::Hungarian;
use track::{TrackState, View};

pub(crate) use compare::Comparer;
pub(crate) use cost::median;
pub(crate) use track::VELOCITY_DECAY_S;

/// A candidate that is not seen for this long is forgotten, ns.
const CANDIDATE_MEMORY_NS: i64 = 300_000_000;

/// One body of one sensor, placed in the room.
#[derive(Clone, Debug, Default)]
pub(crate) struct Placed {
    pub(crate) tracking_id: u64,
    pub(crate) body: Body,
}

/// Where each sensor stands, by its number; `None` where that is unknown.
pub(crate) type Origins = [Option<Vector3<f64>>];

/// Everybody who is followed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct People {
    tracks: Vec<TrackState>,
    next_key: u64,
    next_id: u64,
    /// For how many frames two tracks, by key, have coincided.
    close: BTreeMap<(u64, u64), u32>,
    births: birth::Births,
    /// Each sensor's last look, by its number.
    eyes: Vec<Option<birth::Eye>>,
    /// People whose left and right were found exchanged since this was last taken.
    flipped: Vec<TrackId>,
    #[serde(skip)]
    scratch: Scratch,
}

/// Memory kept between calls; carries nothing from one to the next.
#[derive(Clone, Debug, Default)]
struct Scratch {
    hungarian: Hungarian,
    predicted: Vec<Body>,
    cost: Vec<f64>,
    /// For each body the track it belongs to.
    chosen: Vec<Option<usize>>,
    sightings: Vec<Sighting>,
    filter: crate::fuse::kalman::Scratch,
    parts: Vec<Part>,
    /// Frames that filters remember, where that is more than the configuration wants.
    remembered: usize,
}

impl People {
    /// Whether anyone is to be shown at `time`.
    pub(crate) fn anyone(&self, time: Timestamp, config: &AssociateConfig) -> bool {
        let fresh = |t: &TrackState| time.since_ns(t.last_seen) <= config.show_ns();
        self.tracks
            .iter()
            .any(|t| fresh(t) && (t.id.is_some() || t.hits >= config.birth_hits))
    }

    /// Everybody with an id, also those out of sight.
    pub(crate) fn ids(&self) -> impl Iterator<Item = TrackId> {
        self.tracks.iter().filter_map(|t| t.id)
    }

    /// Whose left and right were found exchanged since the last call.
    pub(crate) fn take_flipped(&mut self) -> Vec<TrackId> {
        std::mem::take(&mut self.flipped)
    }

    /// From now on filters remember at least `frames` frames.
    pub(crate) fn remember(&mut self, frames: usize) {
        self.scratch.remembered = frames;
    }

    /// What part each sensor had in the last frame.
    pub(crate) fn parts(&self) -> &[Part] {
        &self.scratch.parts
    }

    /// The sensors' places have changed: who they are stays known, where they are does not.
    pub(crate) fn uproot(&mut self) {
        self.tracks.iter_mut().for_each(TrackState::uproot);
    }

    /// `sensor` is another one now: what it said is forgotten.
    pub(crate) fn forget_sensor(&mut self, sensor: SensorId) {
        for track in &mut self.tracks {
            track.sources.retain(|source| source.sensor != sensor);
            track.filter.forget_sensor(sensor);
        }
    }

    /// Forgets who has not been seen for too long.
    fn expire(&mut self, time: Timestamp, config: &AssociateConfig) {
        self.tracks.retain(|track| {
            let memory_ns = match track.id {
                Some(_) => config.memory_ns(),
                None => CANDIDATE_MEMORY_NS,
            };
            time.since_ns(track.last_seen) <= memory_ns
        });
    }
}

#[cfg(test)]
mod tests;
