//! Two tracks that are one person become one track.
//!
//! Told apart from people who hug by their sensors: each sensor sees two bodies of two people, but only one of one.

use std::collections::BTreeMap;

use posefuse_skeleton::Timestamp;

use super::cost::median_distance;
use super::track::TrackState;
use super::{AssociateConfig, People};
use crate::body::Body;

/// Sensors count as supporting a track for this long after a sample, ns.
const SUPPORT_NS: i64 = 300_000_000;
/// A candidate needs only this many coinciding frames to be taken into a person.
const CANDIDATE_FRAMES: u32 = 3;

impl People {
    /// Counts coincidences, of every pair once, and merges what coincided long enough.
    pub(super) fn merge(&mut self, time: Timestamp, config: &AssociateConfig) {
        let mut ripe = Vec::new();
        let mut close = std::mem::take(&mut self.close);
        let mut still = BTreeMap::new();
        for (index, a) in self.tracks.iter().enumerate() {
            for b in &self.tracks[index + 1..] {
                if !coincide(a, b, time, config) {
                    continue;
                }
                let pair = (a.key, b.key);
                let frames = close.remove(&pair).unwrap_or(0) + 1;
                let candidate = a.id.is_none() || b.id.is_none();
                let needed = if candidate {
                    CANDIDATE_FRAMES.min(config.merge_frames)
                } else {
                    config.merge_frames
                };
                still.insert(pair, frames);
                if frames >= needed {
                    ripe.push(pair);
                }
            }
        }
        for pair in ripe {
            self.merge_pair(pair, time, config);
        }
        still.retain(|(a, b), _| self.index_of(*a).is_some() && self.index_of(*b).is_some());
        self.close = still;
    }

    /// Makes one of these two, by their keys, unless an earlier merge has changed that.
    fn merge_pair(&mut self, (a, b): (u64, u64), time: Timestamp, config: &AssociateConfig) {
        let (Some(a), Some(b)) = (self.index_of(a), self.index_of(b)) else {
            return;
        };
        if !coincide(&self.tracks[a], &self.tracks[b], time, config) {
            return;
        }
        // Whoever has an id stays, else whoever was first.
        let (older, younger) = if self.tracks[a].id.is_none() && self.tracks[b].id.is_some() {
            (b, a)
        } else {
            (a, b)
        };
        let gone = self.tracks[younger].clone();
        self.tracks[older].absorb(gone);
        self.tracks.remove(younger);
    }

    fn index_of(&self, key: u64) -> Option<usize> {
        self.tracks.iter().position(|track| track.key == key)
    }
}

impl TrackState {
    /// Takes over what `other` knew.
    fn absorb(&mut self, other: TrackState) {
        self.hits = self.hits.saturating_add(other.hits);
        self.since = self.since.min(other.since);
        self.last_seen = self.last_seen.max(other.last_seen);
        for source in other.sources {
            match self
                .sources
                .binary_search_by_key(&source.sensor, |s| s.sensor)
            {
                Ok(index) if self.sources[index].newest() < source.newest() => {
                    self.sources[index] = source
                }
                Ok(_) => {}
                Err(index) => self.sources.insert(index, source),
            }
        }
    }
}

/// Whether the two are in one place and no sensor sees both.
fn coincide(a: &TrackState, b: &TrackState, time: Timestamp, config: &AssociateConfig) -> bool {
    let since = time.plus_ns(-SUPPORT_NS);
    let (by_a, by_b) = (a.sensors_since(since), b.sensors_since(since));
    if by_a.is_empty() || by_b.is_empty() || by_a.bits() & by_b.bits() != 0 {
        return false;
    }
    let (mut body_a, mut body_b) = (Body::default(), Body::default());
    a.predicted(time, &mut body_a);
    b.predicted(time, &mut body_b);
    median_distance(&body_a, &body_b).is_some_and(|distance| distance < config.merge_m)
}
