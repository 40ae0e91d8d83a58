//! Simulates every room of the tables once and measures everything about it.

use std::sync::Arc;
use std::time::Instant;

use posefuse_calibration::{CalibrationError, Options, Report, Solution, Walk, solve};
use posefuse_simulator::{Layout, Scenario, SensorErrors, World};
use posefuse_skeleton::Calibration;

use crate::simulated::{PairError, pair_errors, record};
use crate::{coverage, plain};

/// The lengths of walk, seconds.
pub(crate) const WALKS: [f64; 2] = [10.0, 30.0];
/// The methods, in the order of [`Walked::errors`].
pub(crate) const METHODS: [&str; 3] = ["SVD", "SVD .75", "ours"];

/// One room.
pub(crate) struct Surveyed {
    pub(crate) layout: Layout,
    pub(crate) sensors: usize,
    pub(crate) biased: bool,
    pub(crate) seed: u64,
    /// By [`WALKS`].
    pub(crate) walks: Vec<Walked>,
    pub(crate) coverage: Option<coverage::Stopped>,
}

/// What came of one walk.
pub(crate) struct Walked {
    /// By [`METHODS`], over pairs of sensors.
    pub(crate) errors: [Vec<PairError>; 3],
    /// True error over stated sigma per sensor against the first: place, turn, time.
    pub(crate) over_sigma: Vec<[f64; 3]>,
    pub(crate) report: Result<Report, CalibrationError>,
    pub(crate) solve_s: f64,
}

/// All rooms of the tables.
pub(crate) fn survey(seeds: u64, threads: usize, with_coverage: bool) -> Vec<Surveyed> {
    let mut rooms = Vec::new();
    for layout in [Layout::Ring, Layout::Arc] {
        for sensors in [2, 3, 4, 6] {
            for biased in [false, true] {
                rooms.extend((1..=seeds).map(|seed| (layout, sensors, biased, seed)));
            }
        }
    }
    crate::each(&rooms, threads, |&(layout, sensors, biased, seed)| {
        let world = world(layout, sensors, biased, seed);
        let longest = if with_coverage {
            coverage::LONGEST_S
        } else {
            WALKS[1]
        };
        let walk = record(&world, longest);
        Surveyed {
            layout,
            sensors,
            biased,
            seed,
            walks: WALKS.map(|seconds| walked(&world, &walk, seconds)).into(),
            coverage: with_coverage.then(|| coverage::stopped(&world, &walk)),
        }
    })
}

/// A room with one person.
pub(crate) fn world(layout: Layout, sensors: usize, biased: bool, seed: u64) -> Arc<World> {
    let scenario = Scenario {
        seed,
        sensors,
        layout,
        errors: SensorErrors {
            sensor_bias_mm: if biased { 8.0 } else { 0.0 },
            ..SensorErrors::default()
        },
        ..Scenario::default()
    };
    Arc::new(World::new(&scenario).expect("the scenario is possible"))
}

/// The part of `walk` before `seconds`.
pub(crate) fn first(walk: &Walk, seconds: f64) -> Walk {
    let mut walk = walk.clone();
    for sensor in &mut walk.sensors {
        sensor.frames.retain(|frame| frame.time.seconds() < seconds);
    }
    walk
}

fn walked(world: &World, walk: &Walk, seconds: f64) -> Walked {
    let walk = first(walk, seconds);
    let errors = |calibration: &Calibration| -> Vec<PairError> {
        let errors = pair_errors(world, calibration, seconds);
        errors.into_iter().map(|(_, error)| error).collect()
    };
    let svd = errors(&plain::solve(&walk, 0.0));
    let confident = errors(&plain::solve(&walk, 0.75));
    let start = Instant::now();
    let solution = solve(&walk, &Options::default());
    let solve_s = start.elapsed().as_secs_f64();
    let ours = solution
        .as_ref()
        .map_or(Vec::new(), |s| errors(&s.calibration));
    let over_sigma = solution
        .as_ref()
        .map_or(Vec::new(), |s| over_sigma(world, s, seconds));
    Walked {
        errors: [svd, confident, ours],
        over_sigma,
        report: solution.map(|solution| solution.report),
        solve_s,
    }
}

/// For every pair of sensors, the true error over what the stated sigmas of both make of it.
fn over_sigma(world: &World, solution: &Solution, seconds: f64) -> Vec<[f64; 3]> {
    let errors = pair_errors(world, &solution.calibration, seconds);
    let ratio = |((a, b), error): ((usize, usize), PairError)| {
        let of = |index: usize| solution.calibration.sensors[world.sensor_name(index)].sigma;
        let (a, b) = (of(a)?, of(b)?);
        let both = |x: f64, y: f64| x.hypot(y).max(1e-12);
        Some([
            error.place_mm * 1e-3 / both(a.position_m, b.position_m),
            error.turn_deg.to_radians() / both(a.rotation_rad, b.rotation_rad),
            error.time_ms.abs() * 1e-3 / both(a.time_s, b.time_s),
        ])
    };
    errors.into_iter().filter_map(ratio).collect()
}
