//! How far a walk has come: what two sensors saw together, against what a calibration needs.
//!
//! Every count only grows, so that no share ever falls. What is needed is set so that walks that end when the share is
//! 1 pass: the `figures` example measures it.

use std::collections::{BTreeMap, BTreeSet};

use posefuse_skeleton::{Body, Joint, SensorId};
use serde::{Deserialize, Serialize};

/// Edge of a floor cell, metres.
const CELL_M: f64 = 0.5;
/// Height of a slice of the body, metres.
const SLICE_M: f64 = 0.25;
/// How many directions of the shoulders are told apart, over half a turn.
const SECTORS: usize = 6;

/// Seconds that two sensors must share (a lone one: see somebody). The errors of a tracker live 0.4 s, so that
/// these are some 50 independent looks.
const WANTED_S: f64 = 20.0;
/// Floor cells that must be covered in that time: 2 square metres hold the turn of a sensor about any axis.
const WANTED_CELLS: f64 = 8.0;
/// Seconds in each direction of the shoulders, and how many directions of [`SECTORS`]. Sensors see skin, on the side
/// that is turned to them: only who turns shows all sides to all.
const SECTOR_S: f64 = 1.0;
const WANTED_SECTORS: f64 = 4.0;
/// Slices of the body that must be seen: from shank to head.
const WANTED_SLICES: f64 = 5.0;
/// Seconds with ankles in view of any sensor: the floor rests on them.
const WANTED_FEET_S: f64 = 4.0;

/// How far a walk has come.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// One entry per sensor, by its number.
    pub sensors: Vec<SensorCoverage>,
    /// How much of what is needed has been seen, 0..=1: of the weakest of the pairs that hold all sensors together (of a
    /// lone sensor's view), and no more than what was seen of feet. At 1 the walk may end.
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
    /// How much of what is needed has been seen, 0..=1, together with the sensor it shares most with.
    pub share: f64,
    /// The parts of that share, of which it is the least.
    #[serde(default)]
    pub goals: Goals,
}

/// The parts of what is needed, each 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Goals {
    /// Time in which both sensors saw somebody.
    pub seconds: f64,
    /// Floor that somebody walked on meanwhile.
    pub floor: f64,
    /// Directions that they faced.
    pub turning: f64,
    /// Heights of the body that were seen.
    pub height: f64,
}

impl Goals {
    /// The least of them.
    pub fn share(&self) -> f64 {
        [self.seconds, self.floor, self.turning, self.height]
            .into_iter()
            .fold(1.0, f64::min)
    }

    fn least(self, other: Self) -> Self {
        Self {
            seconds: self.seconds.min(other.seconds),
            floor: self.floor.min(other.floor),
            turning: self.turning.min(other.turning),
            height: self.height.min(other.height),
        }
    }
}

/// What one frame shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Glimpse {
    cells: Vec<(i32, i32)>,
    sectors: Vec<usize>,
    slices: Vec<i32>,
    feet: bool,
}

impl Glimpse {
    pub(crate) fn of(bodies: &[Body]) -> Self {
        let mut glimpse = Self::default();
        for body in bodies {
            let Some(cell) = floor_cell(body) else {
                continue;
            };
            glimpse.cells.push(cell);
            glimpse.sectors.extend(sector(body));
            let clear = body
                .skeleton
                .iter()
                .filter(|(_, j)| j.confidence.get() > 0.5);
            let slice = |y: f64| (y / SLICE_M).floor().clamp(-20.0, 20.0) as i32;
            glimpse
                .slices
                .extend(clear.map(|(_, joint)| slice(joint.position.vector().y)));
            let clear = |joint: Joint| {
                body.skeleton[joint]
                    .as_ref()
                    .is_some_and(|j| j.confidence.get() > 0.5)
            };
            glimpse.feet |= clear(Joint::AnkleLeft) || clear(Joint::AnkleRight);
        }
        glimpse.slices.sort_unstable();
        glimpse.slices.dedup();
        glimpse
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }
}

/// What a sensor saw, alone or while another one saw somebody too.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pub(crate) seen_ns: i64,
    pub(crate) frames: u64,
    pub(crate) cells: BTreeSet<(i32, i32)>,
    sectors_ns: [i64; SECTORS],
    slices: BTreeSet<i32>,
    feet_ns: i64,
}

impl Tally {
    /// Counts a frame, `step_ns` after the last.
    pub(crate) fn add(&mut self, glimpse: &Glimpse, step_ns: i64) {
        self.seen_ns += step_ns;
        self.frames += 1;
        self.cells.extend(&glimpse.cells);
        for sector in &glimpse.sectors {
            self.sectors_ns[*sector] += step_ns;
        }
        self.slices.extend(&glimpse.slices);
        self.feet_ns += if glimpse.feet { step_ns } else { 0 };
    }

    pub(crate) fn goals(&self) -> Goals {
        let seconds = |ns: i64| ns as f64 * 1e-9;
        let sector = |ns: &i64| (seconds(*ns) / SECTOR_S).min(1.0);
        Goals {
            seconds: (seconds(self.seen_ns) / WANTED_S).min(1.0),
            floor: (self.cells.len() as f64 / WANTED_CELLS).min(1.0),
            turning: (self.sectors_ns.iter().map(sector).sum::<f64>() / WANTED_SECTORS).min(1.0),
            height: (self.slices.len() as f64 / WANTED_SLICES).min(1.0),
        }
    }

    pub(crate) fn feet_share(&self) -> f64 {
        (self.feet_ns as f64 * 1e-9 / WANTED_FEET_S).min(1.0)
    }
}

/// What the collector knows of one sensor.
pub(crate) struct Sight<'s> {
    pub(crate) sensor: SensorId,
    pub(crate) name: &'s str,
    pub(crate) frames: u64,
    pub(crate) own: &'s Tally,
    /// By the other sensor.
    pub(crate) shared: &'s BTreeMap<SensorId, Tally>,
}

/// Two sensors by their index, with what both sides have seen of what is needed.
type Edge = (usize, usize, Goals);

/// The coverage that these sights make.
pub(crate) fn coverage(sights: &[Sight<'_>]) -> Coverage {
    let alone = sights.len() == 1;
    let edges = edges(sights);
    let sensor = |(index, sight): (usize, &Sight<'_>)| {
        let touching = edges.iter().filter(|(a, b, _)| *a == index || *b == index);
        let best = touching.max_by(|x, y| x.2.share().total_cmp(&y.2.share()));
        let goals = if alone {
            sight.own.goals()
        } else {
            best.map_or_else(Goals::default, |e| e.2)
        };
        let shared = sight.shared.iter().filter(|(_, tally)| tally.frames > 0);
        SensorCoverage {
            sensor: sight.sensor,
            name: sight.name.to_owned(),
            frames: sight.frames,
            seconds_with_body: sight.own.seen_ns as f64 * 1e-9,
            shared_frames: shared
                .map(|(other, tally)| (*other, tally.frames))
                .collect(),
            cells: sight.own.cells.iter().copied().collect(),
            share: goals.share(),
            goals,
        }
    };
    let sensors: Vec<SensorCoverage> = sights.iter().enumerate().map(sensor).collect();
    let weakest = weakest(sights.len(), edges);
    let feet = sights
        .iter()
        .map(|sight| sight.own.feet_share())
        .fold(0.0, f64::max);
    let share = match (sights, weakest) {
        ([], _) => 0.0,
        ([one], _) => one.own.goals().share(),
        (_, Some((_, _, goals))) => goals.share(),
        (_, None) => 0.0,
    };
    Coverage {
        share: share.min(feet),
        hint: hint(sights, weakest, feet),
        sensors,
    }
}

fn edges(sights: &[Sight<'_>]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for (a, first) in sights.iter().enumerate() {
        for (b, second) in sights.iter().enumerate().skip(a + 1) {
            if let (Some(of_a), Some(of_b)) = (
                first.shared.get(&second.sensor),
                second.shared.get(&first.sensor),
            ) {
                edges.push((a, b, of_a.goals().least(of_b.goals())));
            }
        }
    }
    edges
}

/// The weakest edge of the tree of strongest edges that joins all; `None` where nothing joins them.
fn weakest(sensors: usize, mut edges: Vec<Edge>) -> Option<Edge> {
    edges.sort_by(|x, y| {
        y.2.share()
            .total_cmp(&x.2.share())
            .then((x.0, x.1).cmp(&(y.0, y.1)))
    });
    let mut group: Vec<usize> = (0..sensors).collect();
    let mut joined = 1;
    for edge in edges {
        let (ga, gb) = (group[edge.0], group[edge.1]);
        if ga != gb {
            group.iter_mut().filter(|g| **g == gb).for_each(|g| *g = ga);
            joined += 1;
            if joined == sensors {
                return Some(edge);
            }
        }
    }
    None
}

/// What to do about what is missing most.
fn hint(sights: &[Sight<'_>], weakest: Option<Edge>, feet: f64) -> String {
    if let Some(silent) = sights.iter().find(|sight| sight.frames == 0) {
        return format!("`{}` sends nothing: start its agent", silent.name);
    }
    if let Some(blind) = sights.iter().find(|sight| sight.own.frames == 0) {
        return format!("`{}` has seen nobody yet: walk into its view", blind.name);
    }
    let (goals, place) = match (sights, weakest) {
        ([], _) => return "start an agent".to_owned(),
        ([one], _) => (one.own.goals(), format!("where `{}` sees you", one.name)),
        (_, Some((a, b, goals))) => {
            let [a, b] = [a, b].map(|index| sights[index].name);
            (goals, format!("where `{a}` and `{b}` both see you"))
        }
        (_, None) => return hint_apart(sights),
    };
    let least = goals.share();
    if least >= 1.0 {
        return if feet < 1.0 {
            "step back so that a sensor sees your feet, too".to_owned()
        } else {
            String::new()
        };
    }
    if goals.floor <= least {
        format!("walk also to places that you have not been to yet, {place}")
    } else if goals.turning <= least {
        format!("turn around slowly {place}")
    } else if goals.height <= least {
        format!("step back so that you are seen from head to foot, {place}")
    } else {
        format!("walk on {place}")
    }
}

/// Names the sensor that shares least.
fn hint_apart(sights: &[Sight<'_>]) -> String {
    let shared = |sight: &&Sight<'_>| sight.shared.values().map(|tally| tally.frames).sum::<u64>();
    let least = sights
        .iter()
        .min_by_key(shared)
        .map_or("", |sight| sight.name);
    format!("walk where `{least}` and another sensor see you at the same time")
}

/// The direction of the shoulders in the sensor's horizontal plane, over half a turn: left and right may be exchanged.
fn sector(body: &Body) -> Option<usize> {
    let at = |joint: Joint| body.skeleton[joint].as_ref().map(|j| j.position.vector());
    let line = at(Joint::ShoulderLeft)? - at(Joint::ShoulderRight)?;
    let angle = line.z.atan2(line.x).rem_euclid(std::f64::consts::PI);
    let sector = (angle / std::f64::consts::PI * SECTORS as f64) as usize;
    line.x
        .hypot(line.z)
        .is_finite()
        .then_some(sector.min(SECTORS - 1))
}

/// The floor cell below a body's centre, in the sensor's own axes (a level sensor's x and z are horizontal).
fn floor_cell(body: &Body) -> Option<(i32, i32)> {
    let centre = body.skeleton.centre().filter(|centre| centre.is_finite())?;
    let cell = |metres: f64| (metres / CELL_M).floor().clamp(-40.0, 40.0) as i32;
    Some((cell(centre.vector().x), cell(centre.vector().z)))
}
