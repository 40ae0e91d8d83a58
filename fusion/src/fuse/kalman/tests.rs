use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3};

use posefuse_skeleton::{JOINT_COUNT, SensorId, Timestamp};

use super::motion::Motion;
use super::smooth::{Hindsight, Step};
use super::state::Belief;
use super::{Estimate, Moment, PersonFilter, Reading, Scratch};
use crate::body::Body;

/// A reproducible number, normally distributed with variance 1.
struct Normal(u64);

impl Normal {
    fn roll(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.roll(), self.roll(), self.roll())
    }
}

/// One instant of a joint: how long after the one before, and what was measured of it.
struct Instant {
    elapsed_s: f64,
    /// Place (metres), covariance of it (m^2), seconds from the instant.
    measured: Option<(Vector3<f64>, Matrix3<f64>, f64)>,
}

const VARIANCE: f64 = 9.0;
const FIRST_M: f64 = 0.05;
const FIRST: [f64; 2] = [1.0, 5.0];

/// Uneven times, some of them without a measurement, measurements of different precision in different directions,
/// some from a little before.
fn instants() -> Vec<Instant> {
    let mut normal = Normal(7);
    let mut time_s = 0.0;
    let instants = (0..32).map(|index| {
        let elapsed_s = [0.033, 0.021, 0.047, 0.034, 0.09][index % 5];
        time_s += elapsed_s;
        let measured = (index % 7 != 3).then(|| {
            let root = Matrix3::from_columns(&[
                normal.vector() * 0.004,
                normal.vector() * 0.012,
                Vector3::z() * 0.006,
            ]);
            let ahead_s = -0.009 * (index % 4) as f64;
            let at_s = time_s + ahead_s;
            let place = Vector3::new(
                (2.0 * at_s).sin(),
                0.3 * at_s,
                1.0 + 0.2 * (5.0 * at_s).cos(),
            );
            let noise = root * root.transpose() + Matrix3::from_diagonal_element(1e-5);
            (place + root * normal.vector(), noise, ahead_s)
        });
        Instant {
            elapsed_s,
            measured,
        }
    });
    instants.collect()
}

fn first_belief() -> Belief {
    let place = Matrix3::from_diagonal_element(FIRST_M * FIRST_M);
    Belief::at_rest(Vector3::new(0.1, 0.0, 1.1), place, FIRST[0], FIRST[1])
}

/// The filter's steps over all instants.
fn filtered(instants: &[Instant]) -> Vec<Step> {
    let mut belief = first_belief();
    let steps = instants.iter().map(|instant| {
        let motion = Motion::new(instant.elapsed_s, VARIANCE, true);
        belief.predict(&motion, Vector3::zeros(), instant.elapsed_s);
        let correction = instant.measured.as_ref().map(|(place, noise, ahead_s)| {
            let off = place - belief.place_at(*ahead_s);
            belief.correct(off, noise, *ahead_s).unwrap()
        });
        Step {
            motion: Some(motion),
            correction,
            belief,
        }
    });
    steps.collect()
}

/// Places and covariances of `steps`, smoothed by all that follow within `reach`.
fn smoothed(steps: &[Step], reach: usize) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
    let place = |index: usize| {
        let mut hindsight = Hindsight::none();
        let last = steps.len().min(index + reach + 1);
        steps[index + 1..last]
            .iter()
            .rev()
            .for_each(|step| hindsight.back(step));
        hindsight.place(&steps[index])
    };
    (0..steps.len()).map(place).collect()
}

/// The same from all measurements at once: all states are one normally distributed vector, and what was measured is a
/// linear function of it. Nothing here goes forth or back in time.
fn at_once(instants: &[Instant]) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
    let count = instants.len();
    let (mut mean, mut covariance) = (
        DVector::zeros(9 * count),
        DMatrix::zeros(9 * count, 9 * count),
    );
    let first = first_belief();
    let mut state = SMatrix::<f64, 9, 1>::zeros();
    for (row, part) in first.mean.iter().enumerate() {
        state.fixed_rows_mut::<3>(3 * row).copy_from(part);
    }
    let sigmas = [FIRST_M, FIRST[0], FIRST[1]];
    let mut own = SMatrix::<f64, 9, 9>::from_diagonal(&SMatrix::<f64, 9, 1>::from_fn(|i, _| {
        sigmas[i / 3].powi(2)
    }));
    for (index, instant) in instants.iter().enumerate() {
        let m = Motion::new(instant.elapsed_s, VARIANCE, true);
        let n = m.noise;
        let each = |rows: [[f64; 3]; 3]| {
            SMatrix::<f64, 9, 9>::from_fn(|i, j| {
                if i % 3 == j % 3 {
                    rows[i / 3][j / 3]
                } else {
                    0.0
                }
            })
        };
        let on = each([[1.0, m.pv, m.pa], [0.0, m.vv, m.va], [0.0, 0.0, m.aa]]);
        state = on * state;
        own = on * own * on.transpose()
            + each([[n[0], n[1], n[2]], [n[1], n[3], n[4]], [n[2], n[4], n[5]]]);
        mean.rows_mut(9 * index, 9).copy_from(&state);
        // With every state before: what they share has been moved on, too.
        for before in 0..index {
            let shared = on * covariance.view((9 * (index - 1), 9 * before), (9, 9));
            covariance
                .view_mut((9 * index, 9 * before), (9, 9))
                .copy_from(&shared);
            covariance
                .view_mut((9 * before, 9 * index), (9, 9))
                .copy_from(&shared.transpose());
        }
        covariance
            .view_mut((9 * index, 9 * index), (9, 9))
            .copy_from(&own);
    }
    let measured: Vec<_> = (0..count)
        .filter(|i| instants[*i].measured.is_some())
        .collect();
    let mut what = DMatrix::zeros(3 * measured.len(), 9 * count);
    let mut noise = DMatrix::zeros(3 * measured.len(), 3 * measured.len());
    let mut found = DVector::zeros(3 * measured.len());
    for (row, index) in measured.into_iter().enumerate() {
        let Some((place, unsure, ahead_s)) = &instants[index].measured else {
            continue;
        };
        for (column, factor) in [1.0, *ahead_s, 0.5 * ahead_s * ahead_s]
            .into_iter()
            .enumerate()
        {
            let mut block = what.view_mut((3 * row, 9 * index + 3 * column), (3, 3));
            block.copy_from(&Matrix3::from_diagonal_element(factor));
        }
        noise.view_mut((3 * row, 3 * row), (3, 3)).copy_from(unsure);
        found.rows_mut(3 * row, 3).copy_from(place);
    }
    let shared = &covariance * what.transpose();
    let inverse = (&what * &shared + noise).try_inverse().unwrap();
    let all = &mean + &shared * &inverse * (found - &what * &mean);
    let left = &covariance - &shared * &inverse * shared.transpose();
    let place = |index: usize| {
        let at = 9 * index;
        (
            all.fixed_rows::<3>(at).into_owned(),
            left.fixed_view::<3, 3>(at, at).into_owned(),
        )
    };
    (0..count).map(place).collect()
}

#[test]
fn going_back_gives_what_all_measurements_at_once_give() {
    let instants = instants();
    let steps = filtered(&instants);
    let back = smoothed(&steps, steps.len());
    let once = at_once(&instants);
    let mut moved_m = 0.0_f64;
    for (index, ((place, covariance), (expected, unsure))) in back.iter().zip(&once).enumerate() {
        let off_m = (place - expected).norm();
        assert!(off_m < 1e-8, "{off_m} m at {index}");
        let off = (covariance - unsure).norm() / unsure.norm();
        assert!(
            off < 1e-5,
            "covariance {off} off at {index}: {covariance} {unsure}"
        );
        moved_m = moved_m.max((place - steps[index].belief.mean[0]).norm());
    }
    assert!(moved_m > 0.005, "smoothing moved nothing: {moved_m} m");
}

#[test]
fn the_further_the_look_ahead_the_nearer_to_all() {
    let steps = filtered(&instants());
    let all = smoothed(&steps, steps.len());
    let off_m = |reach: usize| {
        let near = smoothed(&steps, reach);
        // The last frames have nothing ahead to wait for.
        let squares = near
            .iter()
            .zip(&all)
            .take(16)
            .map(|(a, b)| (a.0 - b.0).norm_squared());
        (squares.sum::<f64>() / 16.0).sqrt()
    };
    let off: Vec<f64> = [0, 1, 2, 4, 8, 16].into_iter().map(off_m).collect();
    assert!(off.windows(2).all(|w| w[1] < w[0]), "{off:?}");
    assert!(off[5] < 0.01 * off[0], "{off:?}");
    // And what is known after more is known better.
    let (one, four) = (smoothed(&steps, 1), smoothed(&steps, 4));
    let better = one
        .iter()
        .zip(&four)
        .all(|(a, b)| b.1.trace() <= a.1.trace() + 1e-12);
    assert!(better);
}

/// A body that sways, seen without any error by two sensors in turn.
#[test]
fn what_all_sensors_lie_ahead_is_movement_and_no_error_of_theirs() {
    let at = |time_s: f64, index: usize| {
        Vector3::new(
            0.3 * (4.0 * time_s).sin(),
            0.1 * index as f64,
            1.0 + 0.05 * index as f64,
        )
    };
    let sensors = [SensorId::new(0).unwrap(), SensorId::new(1).unwrap()];
    let origins = [Vector3::new(3.0, 0.0, 1.0), Vector3::new(0.0, -3.0, 1.0)];
    let mut filter = PersonFilter::default();
    let (mut scratch, mut along, mut squares) = (Scratch::default(), 0.0, 0.0);
    for frame in 0..300 {
        let time_s = f64::from(frame) / 30.0;
        let bodies = [0.011, 0.004].map(|age_s| {
            let mut body = Body::default();
            (0..JOINT_COUNT).for_each(|index| body.set(index, at(time_s - age_s, index), 1.0));
            (age_s, body)
        });
        let readings: Vec<Reading> = bodies
            .iter()
            .zip(sensors.iter().zip(&origins))
            .map(|((age_s, body), (sensor, origin))| Reading {
                sensor: *sensor,
                origin: *origin,
                body,
                age_s: *age_s,
                fresh: true,
                doubt: [0.0; 2],
            })
            .collect();
        let moment = Moment {
            time: Timestamp::from_seconds(time_s),
            elapsed_s: 1.0 / 30.0,
            trusted: 0.75,
            keep: 0,
        };
        let give = |index: usize, estimate: Estimate| {
            if frame > 90 {
                let velocity = at(time_s + 0.001, index) - at(time_s - 0.001, index);
                let off = at(time_s, index) - estimate.fused.position;
                along += off.dot(&velocity) / 0.002;
                squares += (velocity / 0.002).norm_squared();
            }
        };
        filter.advance(&moment, &readings, &mut scratch, give, &mut |_| {});
    }
    let lag_s = along / squares;
    assert!(lag_s.abs() < 0.01, "{lag_s} s behind");
}
