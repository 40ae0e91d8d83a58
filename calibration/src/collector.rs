//! Gathers a walk while it happens, in bounded memory, and says live how well each sensor is covered.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use posefuse_skeleton::{Body, SensorId, Timestamp};
use serde::{Deserialize, Serialize};

use crate::{SensorWalk, Walk, WalkFrame};

/// Frames kept per sensor unless told otherwise: two minutes at 30 Hz, some 3 MB.
const DEFAULT_FRAMES: usize = 3600;
/// Bodies kept per frame, the most a sensor of this class tracks.
const MAX_BODIES: usize = 6;
/// Two sensors share an instant if both saw somebody within this time, ns.
const SHARED_NS: i64 = 50_000_000;
/// A gap longer than this is not counted as time seen, ns.
const GAP_NS: i64 = 200_000_000;
/// Edge of a floor cell, metres.
const CELL_M: f64 = 0.5;
/// What a walk needs: seconds of view shared with the best other sensor, and cells covered in it.
const WANTED_SHARED_S: f64 = 15.0;
const WANTED_CELLS: usize = 8;

/// Gathers what sensors see. When a sensor's room is full, its oldest frames go first.
#[derive(Clone, Debug)]
pub struct Collector {
    limit: usize,
    sensors: BTreeMap<SensorId, Gathered>,
}

#[derive(Clone, Debug, Default)]
struct Gathered {
    name: String,
    frames: VecDeque<WalkFrame>,
    last_body: Option<Timestamp>,
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
    /// Frames it has sent, with or without a body.
    pub frames: u64,
    /// How long it saw somebody, seconds.
    pub seconds_with_body: f64,
    /// Frames in which the other sensor saw somebody within 50 ms.
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

    /// Takes in one frame, its `time` on the server's clock. Frames of other sensors are left aside, and so is
    /// every body beyond the sixth.
    pub fn add(&mut self, sensor: SensorId, time: Timestamp, bodies: &[Body]) {
        let bodies = &bodies[..bodies.len().min(MAX_BODIES)];
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
        if gathered.frames.len() == limit {
            gathered.frames.pop_front();
        }
        gathered.frames.push_back(WalkFrame::new(time, bodies));
        if cells.is_empty() {
            return;
        }
        let step = gathered.last_body.map_or(0, |last| time.since_ns(last));
        let step = if (0..=GAP_NS).contains(&step) {
            step
        } else {
            0
        };
        gathered.last_body = Some(time);
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

    /// The sensors that are gathered from, by number.
    pub fn sensors(&self) -> impl Iterator<Item = (SensorId, &str)> {
        self.sensors.iter().map(|(id, s)| (*id, s.name.as_str()))
    }

    /// How far the walk has come.
    pub fn coverage(&self) -> Coverage {
        let sensors: Vec<SensorCoverage> = self
            .sensors
            .iter()
            .map(|(id, gathered)| gathered.coverage(*id))
            .collect();
        let worst = sensors.iter().min_by(|a, b| a.share.total_cmp(&b.share));
        let share = if sensors.len() < 2 {
            0.0
        } else {
            worst.map_or(0.0, |worst| worst.share)
        };
        Coverage {
            share,
            hint: worst.map_or_else(|| "start two agents or more".to_owned(), hint),
            sensors,
        }
    }

    /// What has been gathered, for [`solve`](crate::solve).
    pub fn walk(&self) -> Walk {
        let sensors = self.sensors.values().map(|gathered| SensorWalk {
            name: gathered.name.clone(),
            frames: gathered.frames.iter().cloned().collect(),
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

    fn coverage(&self, sensor: SensorId) -> SensorCoverage {
        let best = |other: &SensorId| {
            let shared_s = self
                .shared_ns
                .get(other)
                .map_or(0.0, |ns| *ns as f64 * 1e-9);
            let cells = self.shared_cells.get(other).map_or(0, BTreeSet::len);
            (shared_s / WANTED_SHARED_S)
                .min(cells as f64 / WANTED_CELLS as f64)
                .min(1.0)
        };
        SensorCoverage {
            sensor,
            name: self.name.clone(),
            frames: self.frames.len() as u64,
            seconds_with_body: self.seen_ns as f64 * 1e-9,
            shared_frames: self.shared_frames.clone(),
            cells: self.cells.iter().copied().collect(),
            share: self.shared_frames.keys().map(best).fold(0.0, f64::max),
        }
    }
}

fn hint(worst: &SensorCoverage) -> String {
    let name = &worst.name;
    if worst.share >= 1.0 {
        String::new()
    } else if worst.frames == 0 {
        format!("`{name}` sends nothing: start its agent")
    } else if worst.seconds_with_body == 0.0 {
        format!("`{name}` has seen nobody yet: walk into its view")
    } else if worst.shared_frames.is_empty() {
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
