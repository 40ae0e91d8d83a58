//! Against the numbers of SciPy and of exact rational arithmetic in `golden.txt` (see `make_golden.py`).
#![allow(clippy::unwrap_used)]

use sgfilter::{Spec, Stream, coefficients, smooth};

struct Case {
    kind: &'static str,
    parameters: Vec<f64>,
    input: Vec<f64>,
    expected: Vec<f64>,
}

fn cases(kind: &str) -> Vec<Case> {
    let cases: Vec<Case> = include_str!("golden.txt")
        .lines()
        .filter(|line| line.split(' ').next() == Some(kind))
        .map(parse)
        .collect();
    assert!(cases.len() >= 5, "{} cases of {kind}", cases.len());
    cases
}

fn parse(line: &'static str) -> Case {
    let (kind, rest) = line.split_once(' ').unwrap();
    let mut parts = rest.split('|').map(|part| {
        let numbers = part.split_whitespace().map(|word| word.parse().unwrap());
        numbers.collect::<Vec<f64>>()
    });
    Case {
        kind,
        parameters: parts.next().unwrap(),
        input: parts.next().unwrap(),
        expected: parts.next().unwrap(),
    }
}

/// Largest difference, as a fraction of the largest expected number.
fn distance(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let off = found.iter().zip(expected).map(|(f, e)| (f - e).abs());
    off.fold(0.0, f64::max) / scale
}

fn assert_close(found: &[f64], case: &Case, tolerance: f64) {
    let off = distance(found, &case.expected);
    let (kind, parameters) = (case.kind, &case.parameters);
    assert!(
        off <= tolerance,
        "{kind} {parameters:?} is off by {off:e}, more than {tolerance:e}"
    );
}

fn coefficients_of(case: &Case) -> Vec<f64> {
    let [window, order, derivative, position, delta] = case.parameters[..] else {
        panic!("{:?}", case.parameters);
    };
    let (window, order, derivative) = (window as usize, order as usize, derivative as usize);
    coefficients(window, order, derivative, position, delta).unwrap()
}

/// SciPy solves with powers of the sample number and so is itself off, by up to 1e-7 of the largest
/// weight in these cases: no more than that may lie between its numbers and ours.
#[test]
fn coefficients_are_those_of_scipy() {
    let exact = cases("exact");
    for case in cases("coefficients") {
        let exact = exact.iter().find(|e| e.parameters == case.parameters);
        let scipy_off = distance(&case.expected, &exact.unwrap().expected);
        assert!(scipy_off < 1e-7, "{:?}", case.parameters);
        assert_close(&coefficients_of(&case), &case, 2.0 * scipy_off + 1e-14);
    }
}

#[test]
fn coefficients_are_exact_to_rounding_also_for_high_orders() {
    for case in cases("exact") {
        assert_close(&coefficients_of(&case), &case, 5e-14);
    }
}

#[test]
fn a_whole_signal_is_filtered_as_by_scipy() {
    for case in cases("smooth") {
        let [window, order, derivative, delta] = case.parameters[..] else {
            panic!("{:?}", case.parameters);
        };
        let (window, order) = (window as usize, order as usize);
        let spec = Spec::new(window, order, (window - 1) / 2, derivative as usize).unwrap();
        assert_close(&smooth(&spec, &case.input, delta).unwrap(), &case, 1e-12);
    }
}

/// A centred stream gives SciPy's interior; flushing gives its edge handling at the end.
#[test]
fn a_stream_gives_the_same_as_scipy_from_the_first_whole_window_on() {
    for case in cases("smooth") {
        let [window, order, derivative, delta] = case.parameters[..] else {
            panic!("{:?}", case.parameters);
        };
        let (window, order) = (window as usize, order as usize);
        let spec = Spec::new(window, order, (window - 1) / 2, derivative as usize).unwrap();
        let step_ns = (delta * 1e9) as i64;
        let mut stream = Stream::<1>::new(spec);
        let mut found = Vec::new();
        for (i, value) in case.input.iter().enumerate() {
            found.extend(stream.push(i as i64 * step_ns, [*value]).unwrap());
        }
        found.extend(stream.flush());
        assert_eq!(found.len(), case.input.len());
        let settled = case.expected.len() - found.iter().filter(|s| s.samples == window).count();
        let case = Case {
            expected: case.expected[settled..].to_vec(),
            ..case
        };
        let found: Vec<f64> = found[settled..].iter().map(|s| s.value[0]).collect();
        assert_close(&found, &case, 1e-12);
    }
}

/// Impulses pushed as the components of one value read out the weights of an irregular fit.
#[test]
fn an_irregular_fit_is_exact() {
    for case in cases("fit") {
        let [order, derivative, index] = case.parameters[..] else {
            panic!("{:?}", case.parameters);
        };
        let window = case.input.len();
        let look_ahead = window - 1 - index as usize;
        let spec = Spec::new(window, order as usize, look_ahead, derivative as usize).unwrap();
        let mut stream = Stream::<15>::new(spec);
        let mut last = None;
        for (i, place) in case.input.iter().enumerate() {
            let mut impulse = [0.0; 15];
            impulse[i] = 1.0;
            last = stream.push(*place as i64 * 1_000_000_000, impulse).unwrap();
        }
        let last = last.unwrap();
        assert_eq!((last.samples, last.order), (window, order as usize));
        assert_close(&last.value[..window], &case, 1e-12);
    }
}
