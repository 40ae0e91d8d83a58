//! Simulates every room of the tables once and measures everything about it.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::{SMatrix, SVector};
use posefuse_calibration::{
    CalibrationError, Options, Report, SensorCovariance, Solution, Walk, solve,
};
use posefuse_simulator::{Layout, Scenario, SensorErrors, World};
use posefuse_skeleton::Calibration;

use crate::simulated::{PairError, pair_errors, record};
use crate::{coverage, plain};

/// The lengths of walk, seconds.
pub(crate) const WALKS: [f64; 2] = [10.0, 30.0];
/// The methods, in the order of [`Walked::errors`].
pub(crate) const METHODS: [&str; 3] = ["SVD", "SVD .75", "ours"];

/// The values that chi squared with three and with one degree of freedom stays below in 95 % of cases.
const CHI2_3: f64 = 7.815;
const CHI2_1: f64 = 3.841;

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
    /// True error over the stated 95 % bound, per sensor: place, turn, time.
    pub(crate) over_bound: Vec<[f64; 3]>,
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
    let over_bound = solution
        .as_ref()
        .map_or(Vec::new(), |s| over_bound(world, s, seconds));
    Walked {
        errors: [svd, confident, ours],
        over_bound,
        report: solution.map(|solution| solution.report),
        solve_s,
    }
}

/// For every sensor, the distance of the truth from what was found over the stated 95 % bound: place, turn, time. As
/// the report defines its covariance, a motion and a delay that all sensors share are no error.
fn over_bound(world: &World, solution: &Solution, seconds: f64) -> Vec<[f64; 3]> {
    let name = |index: usize| world.sensor_name(index);
    let found = |index: usize| &solution.calibration.sensors[name(index)];
    let found_pose = |index: usize| *found(index).room_from_sensor.isometry();
    let true_pose = |index: usize| *world.room_from_sensor(index).isometry();
    let found_from_true = found_pose(0) * true_pose(0).inverse();
    let error = |index: usize| {
        let off = found_from_true * true_pose(index) * found_pose(index).inverse();
        let clock = world.sensor_clock(index);
        let late_ns = clock.offset_ns as f64 + clock.drift_ppm * 1e-6 * seconds * 0.5e9;
        let mut error = SVector::<f64, 7>::zeros();
        error
            .fixed_rows_mut::<3>(0)
            .copy_from(&off.rotation.scaled_axis());
        error
            .fixed_rows_mut::<3>(3)
            .copy_from(&off.translation.vector);
        error[6] = (-late_ns - found(index).time_offset_ns as f64) * 1e-9;
        error
    };
    let errors: Vec<_> = (0..world.sensor_count()).map(error).collect();
    let mean = errors.iter().sum::<SVector<f64, 7>>() / errors.len() as f64;
    let ratio = |row: &SensorCovariance| {
        let index = world.sensor_index(&row.name)?;
        let error = errors[index] - mean;
        let covariance = SMatrix::<f64, 7, 7>::from_fn(|i, j| row.matrix[i][j]);
        // The sensor's own place: the shift of the origin and the turn about it.
        let at = found_pose(index).translation.vector;
        let mut place_from = SMatrix::<f64, 3, 7>::zeros();
        place_from
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&-at.cross_matrix());
        place_from
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&SMatrix::<f64, 3, 3>::identity());
        let place = place_from * error;
        let of_place = place_from * covariance * place_from.transpose();
        let turn = error.fixed_rows::<3>(0).into_owned();
        let of_turn = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let distance = |error: SVector<f64, 3>, covariance: SMatrix<f64, 3, 3>| {
            Some((error.dot(&(covariance.try_inverse()? * error)) / CHI2_3).sqrt())
        };
        let time = error[6].abs() / (CHI2_1 * covariance[(6, 6)]).sqrt();
        Some([distance(place, of_place)?, distance(turn, of_turn)?, time])
    };
    solution
        .report
        .covariance
        .iter()
        .filter_map(ratio)
        .collect()
}
