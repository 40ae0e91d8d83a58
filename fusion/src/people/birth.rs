//! Who becomes a person: candidates seen often enough, unless those who should see them, too, see nobody there
//! (furniture that one tracker takes for somebody), or they move as somebody's image in a mirror would.
//!
//! A doubted candidate is not refused for good. One that moves about is believed after a while, since a tracker may
//! well miss a person; one that stands still has to wait for long.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, Position, Room, Sensor, SensorId, Timestamp, TrackId, Transform};
use serde::{Deserialize, Serialize};

use super::reflection::{Plane, Suspicion};
use super::{People, TrackState};
use crate::config::AssociateConfig;

/// What a sensor said of a candidate, for or against, counts for so long, ns.
const COUNTS_NS: i64 = 300_000_000;
/// Contradicted by those who should see it, a candidate is born after this long if it has moved, and if not, ns.
const MOVING_NS: i64 = 1_000_000_000;
const STILL_NS: i64 = 20_000_000_000;
/// Seen by one of several sensors and contradicted by none, or seen by more than contradict it, it is born at once if it
/// has moved, else after this long; after the second of these if it was there when the sensors began to look, since then
/// people have not moved yet, either.
const ALONE_NS: [i64; 2] = [6_000_000_000, 3_000_000_000];
/// Who is seen this early was there when the sensors began to look, ns.
const BEGINNING_NS: i64 = 1_000_000_000;
/// It has moved when its trunk was this far from where it was at first, metres.
const MOVED_M: f64 = 0.3;
/// Frames over which it is averaged where the trunk was at first, and a frame's share in where it was lately: a single
/// frame can be far off.
const FIRST_FRAMES: u32 = 4;
const LATELY: f64 = 0.2;
/// A joint last seen longer ago has only been carried on, ns.
const SEEN_NS: i64 = 60_000_000;
/// Contradicted in so many frames, it stays so while others are in the way.
const CONTRADICTED_FRAMES: u32 = 6;
/// Seen by one sensor only at first, it is seen by several after so many frames, and if it was contradicted, after so
/// many: a body of somebody who passes by is taken for it in fewer.
const CONFIRMED_FRAMES: [u32; 2] = [20, 45];
/// The part of a view in which a tracker would certainly find somebody: depth, metres, and tangents of the angles to
/// the middle of the trunk. Within the view of every depth sensor in use.
const DEPTH_M: [f64; 2] = [2.0, 4.5];
const ASIDE: f64 = 0.48;
const ABOVE: f64 = 0.25;
/// What tells where the trunk is.
const TRUNK: [Joint; 3] = [Joint::SpineBase, Joint::SpineMid, Joint::SpineShoulder];
/// Whose trunk comes this close to the line of sight hides what is behind, metres.
const HIDES_M: f64 = 0.45;

/// What is held against candidates, by their keys, and what was learned from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Births {
    doubts: BTreeMap<u64, Doubt>,
    /// When the first sensor looked first.
    began: Option<Timestamp>,
    pub(super) mirrors: Vec<Plane>,
}

/// Where a sensor stood when it last looked, room metres, and when that was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Eye {
    pub(super) origin: Vector3<f64>,
    looked: Timestamp,
}

/// What is held against one candidate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Doubt {
    /// The trunk's joints, as these sensors have them.
    trunk: [Wander; 3],
    seen_by: u64,
    moved_m: f64,
    /// Frames in which one sensor saw the candidate, in which several did, in which it was contradicted.
    alone: u32,
    together: u32,
    contradicted: u32,
    /// When each sensor that should have seen the candidate last did not.
    against: BTreeMap<SensorId, Timestamp>,
    mirror: Suspicion,
}

/// How a joint moves about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Wander {
    frames: u32,
    first: Vector3<f64>,
    lately: Vector3<f64>,
}

impl People {
    /// `sensor` has looked at `time`, and all that it saw was taken: who of the candidates should it have seen?
    pub(crate) fn watch(
        &mut self,
        sensor: SensorId,
        room_from_sensor: &Transform<Room, Sensor>,
        time: Timestamp,
    ) {
        if self.eyes.len() <= sensor.index() {
            self.eyes.resize(sensor.index() + 1, None);
        }
        self.births.began.get_or_insert(time);
        self.eyes[sensor.index()] = Some(Eye {
            origin: room_from_sensor.origin().vector(),
            looked: time,
        });
        let doubted: Vec<usize> = (0..self.tracks.len())
            .filter(|&index| {
                let track = &self.tracks[index];
                let seen = |track: &TrackState| {
                    track.source(sensor).and_then(|s| s.newest()) == Some(time)
                };
                track.id.is_none() && !seen(track)
            })
            .collect();
        if doubted.is_empty() {
            return;
        }
        let sensor_from_room = room_from_sensor.inverse();
        for index in doubted {
            let Some(trunk) = self.tracks[index].trunk() else {
                continue;
            };
            let there = sensor_from_room
                .apply(Position::from_vector(trunk))
                .vector();
            if in_sure_view(there) && !self.is_hidden(index, &sensor_from_room, there, time) {
                let doubt = self.births.doubts.entry(self.tracks[index].key);
                doubt.or_default().against.insert(sensor, time);
            }
        }
    }

    /// Whether anybody else's trunk is in the way to candidate number `index`, whose trunk the sensor has at `there`.
    fn is_hidden(
        &self,
        index: usize,
        sensor_from_room: &Transform<Sensor, Room>,
        there: Vector3<f64>,
        time: Timestamp,
    ) -> bool {
        let others = self.tracks.iter().enumerate().filter(|(i, _)| *i != index);
        others
            .filter(|(_, other)| time.since_ns(other.last_seen) <= COUNTS_NS)
            .filter_map(|(_, other)| other.trunk())
            .map(|trunk| {
                sensor_from_room
                    .apply(Position::from_vector(trunk))
                    .vector()
            })
            .any(|trunk| {
                let along = trunk.dot(&there) / there.norm_squared().max(1e-6);
                let off = (trunk - there * along).xz().norm();
                (0.0..1.1).contains(&along) && off < HIDES_M
            })
    }

    /// Candidates that are not doubted become people.
    pub(super) fn give_ids(&mut self, time: Timestamp, config: &AssociateConfig) {
        let mut people = self.tracks.iter().filter(|t| t.id.is_some()).count();
        let ripe: Vec<usize> = (0..self.tracks.len())
            .filter(|&i| self.tracks[i].id.is_none() && self.tracks[i].hits >= config.birth_hits)
            .collect();
        if !self.births.mirrors.is_empty() {
            self.forget_mirrors();
        }
        for index in ripe {
            if people < config.max_people && !self.is_doubtful(index, time) {
                self.next_id += 1;
                self.tracks[index].id = Some(TrackId(self.next_id));
                people += 1;
            }
        }
        let tracks = &self.tracks;
        let candidate = |key: &u64| tracks.iter().any(|t| t.key == *key && t.id.is_none());
        self.births.doubts.retain(|key, _| candidate(key));
    }

    /// Whether candidate number `index` has to wait.
    fn is_doubtful(&mut self, index: usize, time: Timestamp) -> bool {
        let track = &self.tracks[index];
        let mut doubt = self.births.doubts.remove(&track.key).unwrap_or_default();
        let since = time.plus_ns(-COUNTS_NS);
        let seeing = track.sensors_since(since);
        doubt.follow(track, seeing.bits(), time);
        doubt
            .against
            .retain(|sensor, looked| *looked >= since && !seeing.contains(*sensor));
        doubt.count(seeing.len());
        let looking = self.eyes.iter().flatten();
        let several = looking.filter(|eye| eye.looked >= since).count() > 1;
        let began = self.births.began.unwrap_or(track.since);
        let early = track.since.since_ns(began) < BEGINNING_NS;
        let waits = time.since_ns(track.since) < doubt.wait_ns(seeing.len(), several, early);
        let key = track.key;
        let image = self.is_image(index, time, &mut doubt.mirror);
        self.births.doubts.insert(key, doubt);
        waits || image
    }
}

impl Doubt {
    /// Somebody who moves moves all of the trunk: a joint that is guessed wanders about alone. What moves when another
    /// sensor joins in has not moved.
    fn follow(&mut self, track: &TrackState, seen_by: u64, time: Timestamp) {
        if seen_by != self.seen_by {
            self.trunk = Default::default();
            self.seen_by = seen_by;
        }
        let mut moved_m = f64::INFINITY;
        for (wander, joint) in self.trunk.iter_mut().zip(TRUNK) {
            let known = track.pose[joint as usize].as_ref();
            if let Some(known) = known.filter(|known| time.since_ns(known.seen) <= SEEN_NS) {
                moved_m = moved_m.min(wander.follow(known.position));
            }
        }
        if moved_m.is_finite() {
            self.moved_m = self.moved_m.max(moved_m);
        }
    }

    /// Another frame, with so many sensors that see the candidate.
    fn count(&mut self, seeing: usize) {
        if seeing > 1 {
            self.together += 1;
        } else {
            self.alone += 1;
        }
        if self.is_against(seeing) {
            self.contradicted += 1;
        }
    }

    /// Whether as many sensors miss the candidate now as see it.
    fn is_against(&self, seeing: usize) -> bool {
        !self.against.is_empty() && self.against.len() >= seeing
    }

    /// How long the candidate has to wait from when it was first seen, ns. `several`: more than one sensor is looking;
    /// `early`: they had only begun to.
    fn wait_ns(&self, seeing: usize, several: bool, early: bool) -> i64 {
        let against = self.is_against(seeing);
        if self.moved_m > MOVED_M {
            return if against { MOVING_NS } else { 0 };
        }
        let contradicted = self.contradicted >= CONTRADICTED_FRAMES;
        let confirmed = if contradicted {
            self.together >= CONFIRMED_FRAMES[1]
        } else {
            self.together >= self.alone.min(CONFIRMED_FRAMES[0])
        };
        let disputed = 2 * self.against.len() > seeing;
        if against || contradicted && !confirmed {
            STILL_NS
        } else if several && !confirmed || disputed {
            ALONE_NS[usize::from(early)]
        } else {
            0
        }
    }
}

impl Wander {
    /// Takes the joint's next place; how far it has come, metres.
    fn follow(&mut self, place: Vector3<f64>) -> f64 {
        if self.frames == 0 {
            self.lately = place;
        }
        if self.frames < FIRST_FRAMES {
            self.frames += 1;
            self.first += (place - self.first) / f64::from(self.frames);
        }
        self.lately += (place - self.lately) * LATELY;
        (self.lately - self.first).norm()
    }
}

/// Whether a sensor is sure to find somebody whose trunk is here, sensor frame.
fn in_sure_view(trunk: Vector3<f64>) -> bool {
    (DEPTH_M[0]..=DEPTH_M[1]).contains(&trunk.z)
        && trunk.x.abs() <= ASIDE * trunk.z
        && trunk.y.abs() <= ABOVE * trunk.z
}

impl TrackState {
    /// The middle of the trunk, where any of it is known.
    pub(super) fn trunk(&self) -> Option<Vector3<f64>> {
        let known = TRUNK
            .into_iter()
            .filter_map(|joint| self.pose[joint as usize].as_ref());
        let (sum, count) = known.fold((Vector3::zeros(), 0.0), |(sum, count), joint| {
            (sum + joint.position, count + 1.0)
        });
        (count > 0.0).then(|| sum / count)
    }
}
