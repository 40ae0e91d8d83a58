//! Time per pushed sample, as a ratio to two references measured in the same run:
//! a bare dot product over the same window (the least any filter could cost), and a naive refit
//! that builds and solves the normal equations anew for each sample.
//!
//! `cargo bench -p sgfilter --bench throughput`

use std::hint::black_box;
use std::time::Instant;

use sgfilter::{Spec, Stream, coefficients};

const SAMPLES: usize = 20_000;
const ROUNDS: usize = 9;
const STEP_NS: i64 = 33_333_333;

fn main() {
    println!(
        "ns per sample, best of {ROUNDS} rounds of {SAMPLES}; (x) is the ratio to the dot product"
    );
    println!(
        "{:24}{:>12}{:>20}{:>20}{:>20}",
        "window/order/ahead, D", "dot", "regular", "irregular", "naive refit"
    );
    compare::<1>(7, 2, 1);
    compare::<3>(7, 2, 1);
    compare::<75>(7, 2, 1);
    compare::<3>(29, 4, 14);
    compare::<75>(29, 4, 14);
}

fn compare<const D: usize>(window: usize, order: usize, look_ahead: usize) {
    let spec = Spec::new(window, order, look_ahead, 0).expect("valid settings");
    let values: Vec<[f64; D]> = (0..SAMPLES)
        .map(|i| std::array::from_fn(|d| (0.1 * i as f64 + d as f64).sin()))
        .collect();
    let regular: Vec<i64> = (0..SAMPLES as i64).map(|i| i * STEP_NS).collect();
    let jittered: Vec<i64> = regular.iter().map(|t| t + t % 7 * 1_000_000).collect();

    let dot = best(|| dot_products(&spec, &values));
    let cached = best(|| pushes(&spec, &regular, &values));
    let fitted = best(|| pushes(&spec, &jittered, &values));
    let naive = best(|| refits(&spec, &jittered, &values));
    let cell = |ns: f64| format!("{ns:.1} ({:.1}x)", ns / dot);
    println!(
        "{:24}{:>12.1}{:>20}{:>20}{:>20}",
        format!("{window}/{order}/{look_ahead}, {D}"),
        dot,
        cell(cached),
        cell(fitted),
        cell(naive)
    );
}

/// Least time per sample over the rounds, in nanoseconds.
fn best(mut work: impl FnMut() -> f64) -> f64 {
    let time = |_| {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_nanos() as f64 / SAMPLES as f64
    };
    (0..ROUNDS).map(time).fold(f64::INFINITY, f64::min)
}

fn pushes<const D: usize>(spec: &Spec, times: &[i64], values: &[[f64; D]]) -> f64 {
    let mut stream = Stream::new(*spec);
    let mut sum = 0.0;
    for (t_ns, value) in times.iter().zip(values) {
        if let Ok(Some(sample)) = stream.push(*t_ns, black_box(*value)) {
            sum += black_box(sample).value[0];
        }
    }
    sum
}

/// No buffer, no timestamps: known weights over slices of a signal that is already there.
fn dot_products<const D: usize>(spec: &Spec, values: &[[f64; D]]) -> f64 {
    let position = (spec.window() - 1 - spec.look_ahead()) as f64;
    let weights = coefficients(spec.window(), spec.order(), 0, position, 1.0).expect("valid");
    let mut sum = 0.0;
    for seen in values.windows(spec.window()) {
        sum += black_box(weigh(&weights, black_box(seen)))[0];
    }
    sum
}

/// Normal equations of powers of time, built and solved for each sample, as one would at first.
fn refits<const D: usize>(spec: &Spec, times: &[i64], values: &[[f64; D]]) -> f64 {
    let mut sum = 0.0;
    let windows = times.windows(spec.window());
    for (times, seen) in windows.zip(values.windows(spec.window())) {
        let now = times[times.len() - 1 - spec.look_ahead()];
        let places: Vec<f64> = times.iter().map(|t| (t - now) as f64 * 1e-9).collect();
        let weights = normal_equations(&places, spec.order());
        sum += black_box(weigh(&weights, black_box(seen)))[0];
    }
    sum
}

/// Weights of the constant term: the first row of `(A^T A)^-1 A^T`, by Gaussian elimination.
fn normal_equations(places: &[f64], order: usize) -> Vec<f64> {
    let size = order + 1;
    let power = |x: f64, k: usize| x.powi(k as i32);
    let mut rows: Vec<Vec<f64>> = (0..size)
        .map(|i| {
            let moment = |j| places.iter().map(|x| power(*x, i + j)).sum();
            let mut row: Vec<f64> = (0..size).map(moment).collect();
            row.push(f64::from(u8::from(i == 0)));
            row
        })
        .collect();
    for column in 0..size {
        let pivot = rows[column].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != column) {
            let factor = row[column] / pivot[column];
            row.iter_mut()
                .zip(&pivot)
                .for_each(|(r, p)| *r -= factor * p);
        }
    }
    let solution: Vec<f64> = (0..size).map(|i| rows[i][size] / rows[i][i]).collect();
    let weight = |x: &f64| (0..size).map(|k| solution[k] * power(*x, k)).sum();
    places.iter().map(weight).collect()
}

fn weigh<const D: usize>(weights: &[f64], seen: &[[f64; D]]) -> [f64; D] {
    let mut sum = [0.0; D];
    for (weight, value) in weights.iter().zip(seen) {
        for (sum, value) in sum.iter_mut().zip(value) {
            *sum += weight * value;
        }
    }
    sum
}
