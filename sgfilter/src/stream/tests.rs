//! What only the inside can show: which path was taken, and that no storage grows.

use super::*;

const STEP_NS: i64 = 33_333_333;

fn wave(t_ns: i64) -> [f64; 2] {
    let t = t_ns as f64 * 1e-9;
    [(3.0 * t).sin(), 1.0 + (5.0 * t).cos()]
}

#[test]
fn the_cached_path_equals_the_fit() {
    for (window, order, look_ahead, derivative) in
        [(7, 2, 1, 0), (29, 4, 14, 1), (8, 3, 0, 2), (2, 1, 1, 0)]
    {
        let spec = Spec::new(window, order, look_ahead, derivative).unwrap();
        let mut stream = Stream::new(spec);
        for i in 0..60 {
            stream.push(i * STEP_NS, wave(i * STEP_NS)).unwrap();
        }
        assert!(stream.regular_spacing_ns().is_some());
        let cached = stream.evaluate(spec.position()).unwrap();
        let fitted = stream.evaluate_by_fit(spec.position()).unwrap();
        assert_eq!((cached.t_ns, cached.order), (fitted.t_ns, fitted.order));
        let scale = 30f64.powi(derivative as i32);
        for (a, b) in cached.value.iter().zip(fitted.value) {
            assert!((a - b).abs() < 1e-12 * scale, "{spec:?}: {a} against {b}");
        }
    }
}

#[test]
fn the_tolerance_decides_the_path() {
    let spec = Spec::new(5, 2, 0, 0).unwrap();
    for (jitter_ns, tolerance, regular) in [
        (0, 0.0, true),
        (1, 0.0, false),
        (1_000, DEFAULT_REGULAR_TOLERANCE, true),
        (1_000_000, DEFAULT_REGULAR_TOLERANCE, false),
        (1_000_000, 0.1, true),
    ] {
        let mut stream = Stream::new(spec).with_regular_tolerance(tolerance).unwrap();
        for i in 0..9 {
            let t_ns = i * STEP_NS + (i % 2) * jitter_ns;
            stream.push(t_ns, wave(t_ns)).unwrap();
        }
        let found = stream.regular_spacing_ns().is_some();
        assert_eq!(found, regular, "jitter {jitter_ns}, tolerance {tolerance}");
    }
}

#[test]
fn no_storage_grows_however_long_it_runs() {
    let spec = Spec::new(9, 3, 4, 1).unwrap();
    let mut stream = Stream::new(spec).with_max_gap_ns(10 * STEP_NS).unwrap();
    let sizes = |s: &Stream<2>| {
        let State { window, due, .. } = &s.state;
        (window.capacity(), due.capacity(), s.fit.capacities())
    };
    let before = sizes(&stream);
    let mut t_ns = 0;
    for i in 0..20_000_i64 {
        let gap = if i % 7 == 0 || i % 31 < 3 { 11 } else { 1 };
        t_ns += gap * STEP_NS + i % 5 * 1_000_000;
        stream.push(t_ns, wave(t_ns)).unwrap();
    }
    assert_eq!(sizes(&stream), before);
}
