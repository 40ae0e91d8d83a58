//! What each sensor saw in the last minute, to find one sensor's place anew from. Frames without people are kept, too: a
//! sensor that nobody stands in front of is not one that sends nothing.
//!
//! At most 15 frames a second, 60 s and 4 people: 0.9 MB per sensor and person, 3.6 MB per sensor at the most.

use std::collections::{BTreeMap, VecDeque};

use posefuse_calibration::{SensorWalk, Walk, WalkFrame};
use posefuse_skeleton::{JointSet, SensorId, Timestamp};

/// Frames that follow the last one more closely are left aside, ns.
pub(super) const SPACING_NS: i64 = 60_000_000;
/// Bodies kept of a frame.
pub(super) const MAX_BODIES: usize = 4;
/// How long frames are kept, ns, and how many of a sensor.
const KEPT_NS: i64 = 60_000_000_000;
const MAX_FRAMES: usize = 1000;

/// The last minute, by sensor.
#[derive(Debug, Default)]
pub(super) struct Recent(BTreeMap<SensorId, VecDeque<WalkFrame>>);

impl Recent {
    pub(super) fn add(&mut self, sensor: SensorId, frame: WalkFrame) {
        let start = frame.time.plus_ns(-KEPT_NS);
        let frames = self.0.entry(sensor).or_default();
        while frames.len() >= MAX_FRAMES || frames.front().is_some_and(|f| f.time < start) {
            frames.pop_front();
        }
        frames.push_back(frame);
    }

    /// Forgets what is older than `start`.
    pub(super) fn forget_before(&mut self, start: Timestamp) {
        for frames in self.0.values_mut() {
            while frames.front().is_some_and(|frame| frame.time < start) {
                frames.pop_front();
            }
        }
        self.0.retain(|_, frames| !frames.is_empty());
    }

    /// The time for which frames are kept, before `now`.
    pub(super) fn start(now: Timestamp) -> Timestamp {
        now.plus_ns(-KEPT_NS)
    }

    /// What these sensors saw from `since` on, as a walk; sensors that saw nobody are not in it.
    pub(super) fn walk(
        &self,
        sensors: impl Iterator<Item = (SensorId, String, JointSet)>,
        since: Timestamp,
    ) -> Walk {
        let seen = |(id, name, joint_set): (SensorId, String, JointSet)| {
            let frames = self.0.get(&id)?.iter();
            let frames: Vec<_> = frames.filter(|f| f.time >= since).cloned().collect();
            let saw_somebody = frames.iter().any(|frame| !frame.bodies.is_empty());
            saw_somebody.then_some(SensorWalk {
                name,
                joint_set: Some(joint_set),
                frames,
            })
        };
        Walk {
            sensors: sensors.filter_map(seen).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use posefuse_calibration::WalkBody;
    use posefuse_skeleton::JointMap;

    use super::*;

    fn id(index: usize) -> SensorId {
        SensorId::new(index).unwrap()
    }

    fn frame(seconds: f64) -> WalkFrame {
        WalkFrame {
            time: Timestamp::from_seconds(seconds),
            bodies: vec![WalkBody {
                tracking_id: 1,
                joints: JointMap::default(),
            }],
        }
    }

    fn empty(seconds: f64) -> WalkFrame {
        WalkFrame {
            bodies: Vec::new(),
            ..frame(seconds)
        }
    }

    #[test]
    fn a_minute_is_kept_and_no_more_than_there_is_room_for() {
        let mut recent = Recent::default();
        for i in 0..2000 {
            recent.add(id(0), frame(f64::from(i) * 0.1));
            recent.add(id(1), frame(f64::from(i) * 0.001));
        }
        let of =
            |recent: &Recent, sensor: usize| recent.0.get(&id(sensor)).map_or(0, VecDeque::len);
        assert!((600..=601).contains(&of(&recent, 0)), "{}", of(&recent, 0));
        assert_eq!(of(&recent, 1), MAX_FRAMES);
        let sensors = [0, 1].map(|i| (id(i), format!("s{i}"), JointSet::KinectV2));
        let walk = recent.walk(sensors.into_iter(), Timestamp::from_seconds(190.0));
        assert_eq!(walk.sensors.len(), 1, "the other has seen nobody since");
        assert_eq!(walk.sensors[0].frames.len(), 100);
        recent.forget_before(Timestamp::from_seconds(100.0));
        assert_eq!(of(&recent, 1), 0);
    }

    #[test]
    fn a_sensor_that_sees_nobody_at_the_end_has_not_left_and_one_that_never_saw_anybody_is_not_asked()
     {
        let mut recent = Recent::default();
        for i in 0..30 {
            recent.add(id(0), frame(f64::from(i)));
            recent.add(id(1), empty(f64::from(i)));
            let seen = if i < 10 { frame } else { empty };
            recent.add(id(2), seen(f64::from(i)));
        }
        let sensors = [0, 1, 2].map(|i| (id(i), format!("s{i}"), JointSet::KinectV2));
        let walk = recent.walk(sensors.clone().into_iter(), Timestamp::from_seconds(5.0));
        let names: Vec<_> = walk.sensors.iter().map(|seen| seen.name.as_str()).collect();
        assert_eq!(names, ["s0", "s2"]);
        let last = walk.sensors[1].frames.last().map(|frame| frame.time);
        assert_eq!(last, Some(Timestamp::from_seconds(29.0)));
        let later = recent.walk(sensors.into_iter(), Timestamp::from_seconds(20.0));
        assert_eq!(later.sensors.len(), 1, "it has seen nobody since");
    }
}
