//! What the sensors saw of the same person at the same instant, for those who watch over the sensors' places.
//!
//! It only looks on: nothing here goes into a frame. Each person is looked at five times a second, at the newest
//! instant that every present sensor's samples enclose, so that nothing has to be carried on by velocity.

use std::collections::VecDeque;

use nalgebra::Vector3;
use posefuse_skeleton::{
    Comparison, Joint, JointMap, Position, Room, Sensor, Timestamp, TrackId, Transform, View,
};

use super::People;
use super::track::{Source, TrackState};
use crate::sensors::SensorState;

/// Time between two looks at a person, ns: errors of trackers live 0.4 s, so that more would say little more.
const SPACING_NS: i64 = 200_000_000;
/// A sensor without a sample for so long does not see the person any more, ns.
const PRESENT_NS: i64 = 250_000_000;
/// Fewest joints of a view that say something.
const MIN_JOINTS: usize = 6;
/// Comparisons that wait to be taken; then the oldest goes.
const MAX_WAITING: usize = 256;

/// Looks at people and keeps what it saw until it is taken.
#[derive(Clone, Debug, Default)]
pub(crate) struct Comparer {
    enabled: bool,
    waiting: VecDeque<Comparison>,
    /// When each person was last looked at.
    last: Vec<(TrackId, Timestamp)>,
}

impl Comparer {
    /// Whether it looks at all.
    pub(crate) fn enable(&mut self, enabled: bool) {
        *self = Self {
            enabled,
            ..Self::default()
        };
    }

    /// What it saw since the last call, oldest first.
    pub(crate) fn take(&mut self) -> impl Iterator<Item = Comparison> {
        self.waiting.drain(..)
    }

    /// Looks at everybody who was not looked at just now. `trusted` is the confidence from which on a joint counts.
    pub(crate) fn look(
        &mut self,
        time: Timestamp,
        people: &People,
        sensors: &[Option<SensorState>],
        trusted: f64,
    ) {
        if !self.enabled {
            return;
        }
        let followed = |id: TrackId| people.tracks.iter().any(|track| track.id == Some(id));
        self.last.retain(|(id, _)| followed(*id));
        for track in &people.tracks {
            let Some(id) = track.id else { continue };
            let known = self.last.iter().position(|(known, _)| *known == id);
            if known.is_some_and(|at| time.since_ns(self.last[at].1) < SPACING_NS) {
                continue;
            }
            // A look in vain counts, too: who is seen by one sensor only is not looked at in every frame.
            match known {
                Some(at) => self.last[at].1 = time,
                None => self.last.push((id, time)),
            }
            let Some(comparison) = compare(id, track, time, sensors, trusted) else {
                continue;
            };
            if self.waiting.len() == MAX_WAITING {
                self.waiting.pop_front();
            }
            self.waiting.push_back(comparison);
        }
    }
}

/// `None` unless two sensors saw enough of the person.
fn compare(
    id: TrackId,
    track: &TrackState,
    now: Timestamp,
    sensors: &[Option<SensorState>],
    trusted: f64,
) -> Option<Comparison> {
    let present = |source: &&Source| {
        let newest = source.newest();
        newest.is_some_and(|newest| now.since_ns(newest) <= PRESENT_NS)
    };
    let sources: Vec<&Source> = track.sources.iter().filter(present).collect();
    if sources.len() < 2 {
        return None;
    }
    let time = sources.iter().filter_map(|source| source.newest()).min()?;
    let view = |source: &&Source| {
        let sensor = sensors.get(source.sensor.index())?.as_ref()?;
        let sensor_from_room = sensor.place?.room_from_sensor.inverse();
        let joints = joints(source, time, &sensor_from_room, trusted)?;
        Some(View {
            sensor: source.sensor,
            joints,
        })
    };
    let views: Vec<View> = sources.iter().filter_map(view).collect();
    (views.len() > 1).then_some(Comparison {
        time,
        track: id,
        views,
    })
}

/// The joints that `source` measured with trust at `time`, if there are enough.
fn joints(
    source: &Source,
    time: Timestamp,
    sensor_from_room: &Transform<Sensor, Room>,
    trusted: f64,
) -> Option<JointMap<Position<Sensor>>> {
    let view = source.view(time, 0)?;
    let measured = |joint: Joint| {
        let (position, confidence, moved_s) = view.joint(joint as usize, Vector3::zeros())?;
        let is_measured = confidence >= trusted && moved_s == 0.0;
        is_measured.then(|| {
            let position = sensor_from_room.apply(Position::from_vector(position));
            (joint, position)
        })
    };
    let joints: JointMap<_> = Joint::ALL.into_iter().filter_map(measured).collect();
    (joints.len() >= MIN_JOINTS).then_some(joints)
}
