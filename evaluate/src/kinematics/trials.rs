//! Many simulated rooms, every way to make bodies on the same fused people.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use posefuse_simulator::{Scenario, World, WorldError};
use posefuse_skeleton::SensorIdError;
use serde::Serialize;
use thiserror::Error;

use super::{BodyFigures, BodyTally, Fused, Variant, aims};
use crate::aims::Aim;
use crate::methods::Method;
use crate::metrics::Metrics;
use crate::parallel::in_parallel;
use crate::room::perfect_calibration;
use crate::suite::Setting;
use crate::tally::Tally;

/// What is tried.
pub struct Trials {
    /// The rooms.
    pub settings: Vec<Setting>,
    /// Each is simulated with each of these.
    pub seeds: Vec<u64>,
    /// How much of each room, seconds.
    pub seconds: f64,
    /// How much of that is left out at the start, seconds.
    pub skip_s: f64,
    /// How people are fused. Where the sensors stand is known exactly.
    pub methods: Vec<Method>,
    /// What is made of them.
    pub variants: Vec<Variant>,
    /// How many rooms are worked on at once; times are right with 1 only.
    pub threads: usize,
}

/// Why nothing was tried.
#[derive(Debug, Error)]
pub enum BodiesError {
    /// There is no such room.
    #[error(transparent)]
    World(#[from] WorldError),
    /// More sensors than a room may have.
    #[error(transparent)]
    Sensors(#[from] SensorIdError),
}

/// The result: what scripts get as JSON and what people get as tables or as a page.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BodiesReport {
    /// What it is about.
    pub title: String,
    /// What was done, in sentences.
    pub about: Vec<String>,
    /// One for each room and method.
    pub rooms: Vec<BodiesRoom>,
    /// What is to be reached, and whether it is.
    pub aims: Vec<Aim>,
}

/// A room, its people fused by one method.
#[derive(Clone, Debug, Serialize)]
pub struct BodiesRoom {
    /// The room and the method.
    pub name: String,
    /// One for each variant, in order.
    pub rows: Vec<BodiesRow>,
}

/// What one variant came to.
#[derive(Clone, Debug, Serialize)]
pub struct BodiesRow {
    /// The variant.
    pub name: String,
    /// What it is.
    pub about: String,
    /// Of positions.
    pub metrics: Metrics,
    /// Of bodies.
    pub body: BodyFigures,
}

type Totals = Vec<(Tally, BodyTally)>;

impl Trials {
    /// How many rooms are simulated.
    pub fn count(&self) -> usize {
        self.settings.len() * self.seeds.len()
    }

    /// Tries everything. `done` hears how many rooms are.
    ///
    /// # Errors
    /// There is no such room.
    pub fn run(&self, done: &(dyn Fn(usize) + Sync)) -> Result<BodiesReport, BodiesError> {
        let count = AtomicUsize::new(0);
        let work = |index: usize| {
            let (setting, seed) = (index / self.seeds.len(), index % self.seeds.len());
            let totals = self.room(&self.settings[setting], self.seeds[seed]);
            done(count.fetch_add(1, Ordering::Relaxed) + 1);
            totals
        };
        let parts = in_parallel(self.count(), self.threads, &work);
        let parts: Vec<Vec<Totals>> = parts.into_iter().collect::<Result<_, _>>()?;
        let mut rooms = Vec::new();
        for (setting, seeds) in self.settings.iter().zip(parts.chunks(self.seeds.len())) {
            for (number, method) in self.methods.iter().enumerate() {
                let name = format!("{}, {}", setting.name, method.name);
                let of_method = seeds.iter().map(|methods| &methods[number]);
                rooms.push(self.pooled(name, of_method));
            }
        }
        Ok(BodiesReport {
            title: "Bodies made of fused people".to_owned(),
            about: Vec::new(),
            aims: aims::check(&rooms),
            rooms,
        })
    }

    /// Of one room, for each method what each variant comes to.
    fn room(&self, setting: &Setting, seed: u64) -> Result<Vec<Totals>, BodiesError> {
        let scenario = Scenario {
            seed,
            ..setting.scenario.clone()
        };
        let world = Arc::new(World::new(&scenario)?);
        let mut methods = Vec::with_capacity(self.methods.len());
        for method in &self.methods {
            let calibration = perfect_calibration(&world);
            let fused = Fused::new(&world, method, calibration, self.seconds, self.skip_s)?;
            let judged = self.variants.iter().map(|variant| {
                let outcome = fused.judge(variant);
                (outcome.judged.tally, outcome.body)
            });
            methods.push(judged.collect());
        }
        Ok(methods)
    }

    fn pooled<'a>(&self, name: String, parts: impl Iterator<Item = &'a Totals>) -> BodiesRoom {
        let mut totals: Totals = vec![Default::default(); self.variants.len()];
        for part in parts {
            for ((tally, body), (of_part, body_of_part)) in totals.iter_mut().zip(part) {
                tally.merge(of_part);
                body.merge(body_of_part);
            }
        }
        let row = |(variant, (tally, body)): (&Variant, &(Tally, BodyTally))| BodiesRow {
            name: variant.name.clone(),
            about: variant.about.clone(),
            metrics: Metrics::from(tally),
            body: body.figures(),
        };
        BodiesRoom {
            name,
            rows: self.variants.iter().zip(&totals).map(row).collect(),
        }
    }
}

impl BodiesRoom {
    /// What a variant came to; `None` where it was not tried.
    pub fn row(&self, name: &str) -> Option<&BodiesRow> {
        self.rows.iter().find(|row| row.name == name)
    }
}

impl BodiesReport {
    /// A page that stands by itself: no script, no font, no picture from anywhere else.
    pub fn html(&self) -> String {
        crate::report::bodies_html(self)
    }
}
