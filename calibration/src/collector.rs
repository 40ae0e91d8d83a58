//! Gathers a walk while it happens, in bounded memory, and says live how well each sensor is covered.

use std::collections::{BTreeMap, BTreeSet};

use posefuse_skeleton::{Body, JointSet, Observation, SensorId, Timestamp};
use serde::{Deserialize, Serialize};

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
/// Edge of a floor cell, metres.
const CELL_M: f64 = 0.5;
/// What a walk needs: seconds of view shared with the best other sensor (of a lone sensor's own view), and cells covered
/// in it.
const WANTED_SHARED_S: f64 = 15.0;
const WANTED_CELLS: usize = 8;

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
    seen_ns: i64,
    cells: BTreeSet<(i32, i32)>,
    shared_ns: BTreeMap<SensorId, i64>,
    shared_frames: BTreeMap<SensorId, u64>,
    shared_cells: BTreeMap<SensorId, BTreeSet<(i32, i32)>>,
}

/// How far a walk has come.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// One entry per sensor, by its number.
    pub sensors: Vec<SensorCoverage>,
    /// How much of what is needed has been seen, 0..=1: that of the worst sensor. At 1 the walk may end.
    pub share: f64,
    /// What to do next, in plain words; empty when nothing is missing.
    pub hint: String,
}

/// How well one sensor is covered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorCoverage {
    /// The sensor's number.
    pub sensor: SensorId,
    /// Its name.
    pub name: String,
    /// Frames kept of it, with or without a body.
    pub frames: u64,
    /// How long it saw somebody, seconds.
    pub seconds_with_body: f64,
    /// Frames kept with a body, in which the other sensor saw somebody within 50 ms.
    pub shared_frames: BTreeMap<SensorId, u64>,
    /// Floor cells (0.5 m, in the sensor's own horizontal axes x and z) in which somebody was seen.
    pub cells: Vec<(i32, i32)>,
    /// How much of what is needed has been seen, 0..=1.
    pub share: f64,
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
        let cells: Vec<_> = bodies.iter().filter_map(floor_cell).collect();
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
        let peopled = !cells.is_empty();
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
        gathered.seen_ns += step;
        gathered.cells.extend(&cells);
        for other in others {
            *gathered.shared_ns.entry(other).or_default() += step;
            *gathered.shared_frames.entry(other).or_default() += 1;
            gathered
                .shared_cells
                .entry(other)
                .or_default()
                .extend(&cells);
        }
    }

    /// Leaves out a sensor, with all that it saw and shared.
    pub fn remove(&mut self, sensor: SensorId) {
        self.sensors.remove(&sensor);
        for other in self.sensors.values_mut() {
            other.shared_ns.remove(&sensor);
            other.shared_frames.remove(&sensor);
            other.shared_cells.remove(&sensor);
        }
    }

    /// The sensors that are gathered from, by number.
    pub fn sensors(&self) -> impl Iterator<Item = (SensorId, &str)> {
        self.sensors.iter().map(|(id, s)| (*id, s.name.as_str()))
    }

    /// How far the walk has come.
    pub fn coverage(&self) -> Coverage {
        let sensors: Vec<SensorCoverage> = self
            .sensors
            .iter()
            .map(|(id, gathered)| gathered.coverage(*id, self.sensors.len() == 1))
            .collect();
        let worst = sensors.iter().min_by(|a, b| a.share.total_cmp(&b.share));
        let alone = sensors.len() == 1;
        Coverage {
            share: worst.map_or(0.0, |worst| worst.share),
            hint: worst.map_or_else(|| "start an agent".to_owned(), |worst| hint(worst, alone)),
            sensors,
        }
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

    fn coverage(&self, sensor: SensorId, alone: bool) -> SensorCoverage {
        let enough = |ns: i64, cells: usize| {
            (ns as f64 * 1e-9 / WANTED_SHARED_S)
                .min(cells as f64 / WANTED_CELLS as f64)
                .min(1.0)
        };
        let with = |other: &SensorId| {
            let shared_ns = self.shared_ns.get(other).copied().unwrap_or(0);
            enough(
                shared_ns,
                self.shared_cells.get(other).map_or(0, BTreeSet::len),
            )
        };
        let share = if alone {
            enough(self.seen_ns, self.cells.len())
        } else {
            self.shared_frames.keys().map(with).fold(0.0, f64::max)
        };
        SensorCoverage {
            sensor,
            name: self.name.clone(),
            frames: self.frames.len() as u64,
            seconds_with_body: self.seen_ns as f64 * 1e-9,
            shared_frames: self.shared_frames.clone(),
            cells: self.cells.iter().copied().collect(),
            share,
        }
    }
}

fn hint(worst: &SensorCoverage, alone: bool) -> String {
    let name = &worst.name;
    if worst.share >= 1.0 {
        String::new()
    } else if worst.frames == 0 {
        format!("`{name}` sends nothing: start its agent")
    } else if worst.seconds_with_body == 0.0 {
        format!("`{name}` has seen nobody yet: walk into its view")
    } else if worst.shared_frames.is_empty() && !alone {
        format!("walk where `{name}` and another sensor see you at the same time")
    } else {
        format!("walk about in front of `{name}`, also where you have not been yet")
    }
}

/// The floor cell below a body's centre, in the sensor's own axes (a level sensor's x and z are horizontal).
fn floor_cell(body: &Body) -> Option<(i32, i32)> {
    let centre = body.skeleton.centre().filter(|centre| centre.is_finite())?;
    let cell = |metres: f64| (metres / CELL_M).floor().clamp(-40.0, 40.0) as i32;
    Some((cell(centre.vector().x), cell(centre.vector().z)))
}
