//! Gathers a walk while it happens, in bounded memory, and says live how well each sensor is covered.

use std::collections::BTreeMap;

use posefuse_skeleton::{Body, JointSet, Observation, SensorId, Timestamp};

use crate::coverage::{self, Coverage, Glimpse, Sight, Tally};
use crate::{SensorWalk, Walk, WalkFrame};

/// Frames that follow the last one kept more closely than this are left aside, ns: [`solve`](crate::solve) compares
/// sensors ten times a second. Of 30 frames a second 15 stay.
const SPACING_NS: i64 = 45_000_000;
/// Frames kept per sensor unless told otherwise: ten minutes at that spacing, 9 MB for one person at 30 Hz.
const DEFAULT_FRAMES: usize = 13_400;
/// Two sensors share an instant if both saw somebody within this time, ns.
const SHARED_NS: i64 = 50_000_000;
/// A gap longer than this is not counted as time seen, ns.
const GAP_NS: i64 = 200_000_000;

/// Gathers what sensors see. What does not fit, once a sensor's room is full, is neither kept nor counted.
#[derive(Clone, Debug)]
pub struct Collector {
    limit: usize,
    sensors: BTreeMap<SensorId, Gathered>,
}

#[derive(Clone, Debug, Default)]
struct Gathered {
    name: String,
    joint_set: Option<JointSet>,
    frames: Vec<WalkFrame>,
    /// When it last saw somebody, in a frame that was kept or not.
    last_body: Option<Timestamp>,
    /// The same, kept.
    last_kept_body: Option<Timestamp>,
    /// In the frames that were kept.
    own: Tally,
    /// The same while the other sensor saw somebody, too.
    shared: BTreeMap<SensorId, Tally>,
}

impl Collector {
    /// Gathers from these sensors only.
    pub fn new(names: impl IntoIterator<Item = (SensorId, String)>) -> Self {
        Self::with_limit(names, DEFAULT_FRAMES)
    }

    /// The same, with at most `frames_per_sensor` frames kept for each.
    pub fn with_limit(
        names: impl IntoIterator<Item = (SensorId, String)>,
        frames_per_sensor: usize,
    ) -> Self {
        let gathered = |(id, name)| {
            let gathered = Gathered {
                name,
                ..Gathered::default()
            };
            (id, gathered)
        };
        Self {
            limit: frames_per_sensor.max(1),
            sensors: names.into_iter().map(gathered).collect(),
        }
    }

    /// Says which joint set a sensor's tracker sends: in a room of several, each set's own idea of the joints is estimated.
    pub fn set_joint_set(&mut self, sensor: SensorId, joint_set: JointSet) {
        if let Some(gathered) = self.sensors.get_mut(&sensor) {
            gathered.joint_set = Some(joint_set);
        }
    }

    /// Takes in one frame, its `time` on the server's clock. Frames of other sensors are left aside, frames beyond some
    /// 15 a second, and bodies beyond [`Observation::MAX_BODIES`].
    pub fn add(&mut self, sensor: SensorId, time: Timestamp, bodies: &[Body]) {
        let bodies = &bodies[..bodies.len().min(Observation::MAX_BODIES)];
        let glimpse = Glimpse::of(bodies);
        let others: Vec<SensorId> = self
            .sensors
            .iter()
            .filter(|(id, other)| **id != sensor && other.saw_body_near(time))
            .map(|(id, _)| *id)
            .collect();
        let limit = self.limit;
        let Some(gathered) = self.sensors.get_mut(&sensor) else {
            return;
        };
        let peopled = !glimpse.is_empty();
        if peopled {
            gathered.last_body = Some(time);
        }
        if gathered.frames.len() >= limit || gathered.is_too_close(time, peopled) {
            return;
        }
        gathered.frames.push(WalkFrame::new(time, bodies));
        if !peopled {
            return;
        }
        let last = gathered.last_kept_body.replace(time);
        let step = last.map_or(0, |last| time.since_ns(last));
        let step = if (0..=GAP_NS).contains(&step) {
            step
        } else {
            0
        };
        gathered.own.add(&glimpse, step);
        for other in others {
            gathered
                .shared
                .entry(other)
                .or_default()
                .add(&glimpse, step);
        }
    }

    /// Leaves out a sensor, with all that it saw and shared.
    pub fn remove(&mut self, sensor: SensorId) {
        self.sensors.remove(&sensor);
        for other in self.sensors.values_mut() {
            other.shared.remove(&sensor);
        }
    }

    /// The sensors that are gathered from, by number.
    pub fn sensors(&self) -> impl Iterator<Item = (SensorId, &str)> {
        self.sensors.iter().map(|(id, s)| (*id, s.name.as_str()))
    }

    /// How far the walk has come.
    pub fn coverage(&self) -> Coverage {
        let sensors = self.sensors.iter();
        let sights: Vec<Sight<'_>> = sensors.map(|(id, gathered)| gathered.sight(*id)).collect();
        coverage::coverage(&sights)
    }

    /// What has been gathered, for [`solve`](crate::solve).
    pub fn walk(&self) -> Walk {
        let sensors = self.sensors.values().map(|gathered| SensorWalk {
            name: gathered.name.clone(),
            joint_set: gathered.joint_set,
            frames: gathered.frames.clone(),
        });
        Walk {
            sensors: sensors.collect(),
        }
    }
}

impl Gathered {
    fn sight(&self, sensor: SensorId) -> Sight<'_> {
        Sight {
            sensor,
            name: &self.name,
            frames: self.frames.len() as u64,
            own: &self.own,
            shared: &self.shared,
        }
    }

    fn saw_body_near(&self, time: Timestamp) -> bool {
        self.last_body
            .is_some_and(|last| time.since_ns(last).saturating_abs() <= SHARED_NS)
    }

    /// Whether a frame at `time`, with somebody in it or not, adds little to the last of its kind. An empty frame does
    /// not keep one with a body out.
    fn is_too_close(&self, time: Timestamp, peopled: bool) -> bool {
        let last = if peopled {
            self.last_kept_body
        } else {
            self.frames.last().map(|frame| frame.time)
        };
        last.is_some_and(|last| (0..SPACING_NS).contains(&time.since_ns(last)))
    }
}
