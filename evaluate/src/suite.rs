//! Many simulated rooms, every method on the same inputs.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use posefuse_fusion::{Engine, Input};
use posefuse_simulator::{BodyTruth, Layout, Scenario, SensorErrors, World, WorldError};
use posefuse_skeleton::{
    Calibration, JointMap, Observation, RoomFrame, SensorId, SensorIdError, Timestamp,
};
use thiserror::Error;

use crate::beside::beside;
use crate::fuse::fuse_watched;
use crate::judge::{Judge, Judged};
use crate::methods::Method;
use crate::parallel::in_parallel;
use crate::report::{Group, Run};
use crate::room::SimulatedRoom;
use crate::tally::Mean;
use crate::truth::SimulatedTruth;

/// A room that is simulated once per seed.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Its name in tables.
    pub name: String,
    /// The room; its seed is replaced.
    pub scenario: Scenario,
}

impl Setting {
    /// `ring4`, `arc2`, `desk2` and the like: that many sensors all around, over 100 degrees, or so with a desk before each
    /// that hides legs, with all that real rooms add:
    /// imperfect mirror images, biases of single sensors, stale frames, and structured light that interferes. `None`
    /// for other names.
    pub fn named(name: &str) -> Option<Self> {
        let (layout, desks, count) = match name.split_at_checked(4) {
            Some(("ring", count)) => (Layout::Ring, false, count),
            Some(("desk", count)) => (Layout::Arc, true, count),
            _ => (Layout::Arc, false, name.strip_prefix("arc")?),
        };
        let sensors = count.parse().ok().filter(|n| (1..=64).contains(n))?;
        Some(Self {
            name: name.to_owned(),
            scenario: Scenario {
                sensors,
                layout,
                structured_light: sensors,
                desks: if desks { sensors } else { 0 },
                errors: SensorErrors::harsh(),
                ..Scenario::default()
            },
        })
    }
}

impl Setting {
    /// The same with the errors that the project began with: no interference, perfect mirror images.
    pub fn mild(self) -> Self {
        let scenario = Scenario {
            structured_light: 0,
            errors: SensorErrors::default(),
            ..self.scenario
        };
        Self { scenario, ..self }
    }
}

/// What is compared.
pub struct Suite<'a> {
    /// The rooms.
    pub settings: Vec<Setting>,
    /// Each is simulated with each of these.
    pub seeds: Vec<u64>,
    /// How much of each room, seconds.
    pub seconds: f64,
    /// How much of it is left out at the start: clocks are mapped and people are found, seconds.
    pub skip_s: f64,
    /// What is compared.
    pub methods: Vec<Method>,
    /// Where the sensors stand as far as the engine knows.
    pub calibrate: &'a (dyn Fn(&Arc<World>) -> Result<Calibration, String> + Sync),
    /// How many rooms are worked on at once.
    pub threads: usize,
}

/// Why a room could not be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SuiteError {
    /// There is no such room.
    #[error("{setting}: {error}")]
    World {
        /// The room.
        setting: String,
        /// Why.
        error: WorldError,
    },
    /// Too many sensors.
    #[error(transparent)]
    Sensors(#[from] SensorIdError),
    /// It could not be calibrated.
    #[error("{setting}, seed {seed}: {problem}")]
    Calibration {
        /// The room.
        setting: String,
        /// Its seed.
        seed: u64,
        /// Why.
        problem: String,
    },
}

/// One method in one room with one seed.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Which room.
    pub setting: usize,
    /// Which seed.
    pub seed: u64,
    /// Which method.
    pub method: usize,
    /// What came out.
    pub judged: Judged,
}

impl Suite<'_> {
    /// Runs everything. `progress` hears how many of the rooms are done; it may be called from several threads.
    ///
    /// # Errors
    /// The first room that could not be simulated.
    pub fn run(&self, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Vec<Cell>, SuiteError> {
        let jobs: Vec<(usize, u64)> = (0..self.settings.len())
            .flat_map(|setting| self.seeds.iter().map(move |seed| (setting, *seed)))
            .collect();
        let done = AtomicUsize::new(0);
        let results = in_parallel(jobs.len(), self.threads, &|job| {
            let (setting, seed) = jobs[job];
            let result = self.room(setting, seed);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len());
            result
        });
        let cells: Result<Vec<Vec<Cell>>, SuiteError> = results.into_iter().collect();
        Ok(cells?.into_iter().flatten().collect())
    }

    /// The cells of a run as groups, one per room.
    pub fn groups(&self, cells: &[Cell]) -> Vec<Group> {
        let group = |(index, setting): (usize, &Setting)| {
            let own = || cells.iter().filter(move |cell| cell.setting == index);
            let run = |(number, method): (usize, &Method)| {
                let runs = own().filter(|cell| cell.method == number);
                Run::new(method, runs.map(|cell| &cell.judged))
            };
            let runs: Vec<Run> = self.methods.iter().enumerate().map(run).collect();
            let bound = runs.iter().find_map(|run| run.all.noise_bound_mm);
            Group {
                name: setting.name.clone(),
                note: bound.map_or_else(String::new, |mm| format!("noise bound B {mm:.1} mm")),
                runs,
            }
        };
        self.settings.iter().enumerate().map(group).collect()
    }

    fn room(&self, setting: usize, seed: u64) -> Result<Vec<Cell>, SuiteError> {
        let Setting { name, scenario } = &self.settings[setting];
        let scenario = Scenario {
            seed,
            ..scenario.clone()
        };
        let world = World::new(&scenario).map_err(|error| SuiteError::World {
            setting: name.clone(),
            error,
        })?;
        let world = Arc::new(world);
        let calibration = (self.calibrate)(&world).map_err(|problem| SuiteError::Calibration {
            setting: name.clone(),
            seed,
            problem,
        })?;
        let poses_only = Calibration {
            ray_bias_m: JointMap::empty(),
            joint_offsets_m: BTreeMap::new(),
            ..calibration.clone()
        };
        let (inputs, bodies) = inputs_and_bodies(&world, self.seconds)?;
        let truth = SimulatedTruth::new(&world, self.seconds);
        let from = SimulatedRoom::server_time(self.skip_s);
        let bound = truth.noise_bound_m(self.skip_s);
        let room = Room {
            inputs,
            bodies,
            calibration,
            poses_only,
            truth,
            from,
        };
        let mut cells: Vec<(Judged, Vec<RoomFrame>)> = self
            .methods
            .iter()
            .map(|method| self.one(method, &room))
            .collect();
        for index in 0..cells.len() {
            let plain = self.methods[index].repairs.as_ref();
            let plain = plain.and_then(|name| self.methods.iter().position(|m| m.name == *name));
            if let Some(plain) = plain {
                let (without, with) = (&cells[plain].1, &cells[index].1);
                cells[index].0.tally.repair = beside(without, with, &room.truth, from);
            }
        }
        let cell = |(method, (mut judged, _)): (usize, (Judged, Vec<RoomFrame>))| {
            if let Some(bound) = bound {
                judged.tally.bound.add(bound * bound);
            }
            Cell {
                setting,
                seed,
                method,
                judged,
            }
        };
        Ok(cells.into_iter().enumerate().map(cell).collect())
    }

    /// One method in one room: what it is worth and, where repair is to be laid beside it, its frames.
    fn one(&self, method: &Method, room: &Room) -> (Judged, Vec<RoomFrame>) {
        let calibration = match method.poses_only {
            true => room.poses_only.clone(),
            false => room.calibration.clone(),
        };
        let first = (Timestamp::ZERO, Input::Calibration(Arc::new(calibration)));
        let all = std::iter::once(first).chain(room.inputs.iter().cloned());
        let mut judge = Judge::new(Some(&room.truth), room.from);
        let mut swaps = Mean::default();
        let is_repaired = |other: &Method| other.repairs.as_ref() == Some(&method.name);
        let keep = method.repairs.is_some() || self.methods.iter().any(is_repaired);
        let mut frames = Vec::new();
        let busy = fuse_watched(
            method,
            all.map(|(time, input)| (time, Ok(input))),
            |engine, input| {
                if let Input::Observation(observation) = input {
                    count_swaps(engine, observation, &room.bodies, &mut swaps);
                }
            },
            &mut |frame| {
                if keep {
                    frames.push(frame.clone());
                }
                judge.add(frame);
            },
        );
        let mut judged = judge.finish();
        let tally = &mut judged.tally;
        tally.swaps_right = swaps;
        if method.smooth {
            // No such frame was ever waited for.
            tally.look_ahead = Mean::default();
        }
        tally.busy_s = busy.as_secs_f64();
        tally.live_s = self.seconds;
        (judged, frames)
    }
}

/// A simulated room, the same for every method.
struct Room {
    inputs: Vec<(Timestamp, Input)>,
    bodies: Bodies,
    calibration: Calibration,
    /// The same, but for what a calibration finds besides where the sensors stand.
    poses_only: Calibration,
    truth: SimulatedTruth,
    from: Timestamp,
}

/// What is true of the bodies of each observation, by its sensor and number.
type Bodies = BTreeMap<(SensorId, u64), Vec<BodyTruth>>;

/// The inputs of a room, and what is true of the bodies in its observations.
fn inputs_and_bodies(
    world: &Arc<World>,
    seconds: f64,
) -> Result<(Vec<(Timestamp, Input)>, Bodies), SensorIdError> {
    let mut room = SimulatedRoom::new(world, seconds)?;
    let (mut inputs, mut bodies) = (Vec::new(), Bodies::new());
    while let Some((time, input)) = room.next() {
        if let Input::Observation(observation) = &input {
            let key = (observation.sensor, observation.sequence);
            bodies.insert(key, room.body_truth().to_vec());
        }
        inputs.push((time, input));
    }
    Ok((inputs, bodies))
}

/// Counts, for each body that a sensor reports of a person and that the engine follows, whether its arms and its legs
/// are both taken as they are: exchanged where they are, and not where they are not.
fn count_swaps(engine: &Engine, observation: &Observation, bodies: &Bodies, swaps: &mut Mean) {
    let labels = engine.labels();
    let truths = bodies.get(&(observation.sensor, observation.sequence));
    for body in truths.into_iter().flatten() {
        let own = |taken: &&posefuse_fusion::BodyLabels| {
            (taken.sensor, taken.tracking_id) == (observation.sensor, body.tracking_id)
        };
        if let (Some(_), Some(taken)) = (body.person, labels.iter().find(own)) {
            swaps.add(f64::from(u8::from(taken.mirrored == body.swapped)));
        }
    }
}
