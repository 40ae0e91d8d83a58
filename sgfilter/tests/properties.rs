//! Laws that hold for any settings, timestamps and values.
#![allow(clippy::unwrap_used)]

use proptest::prelude::*;
use sgfilter::{Sample, Spec, Stream, coefficients, smooth};

/// Any valid settings with a polynomial of at most degree 5.
fn specs() -> impl Strategy<Value = Spec> {
    (2..=40_usize)
        .prop_flat_map(|window| (Just(window), 0..window.min(6), 0..window))
        .prop_flat_map(|(window, order, look_ahead)| {
            (Just(window), Just(order), Just(look_ahead), 0..=order)
        })
        .prop_map(|(window, order, look_ahead, derivative)| {
            Spec::new(window, order, look_ahead, derivative).unwrap()
        })
}

/// Steps of 5 to 60 ms, in nanoseconds.
fn irregular_steps() -> impl Strategy<Value = Vec<i64>> {
    prop::collection::vec(5_000_000..60_000_000_i64, 1..90)
}

fn times(start_ns: i64, steps: &[i64]) -> Vec<i64> {
    let sums = steps.iter().scan(start_ns, |t, step| {
        *t += step;
        Some(*t)
    });
    sums.collect()
}

/// The `derivative` of the polynomial with `coefficients`, lowest first, at `t`.
fn polynomial(coefficients: &[f64], derivative: usize, t: f64) -> f64 {
    let terms = coefficients.iter().enumerate().skip(derivative).rev();
    terms.fold(0.0, |sum, (k, c)| {
        let falling: f64 = (0..derivative).map(|m| (k - m) as f64).product();
        sum * t + c * falling
    })
}

fn run<const D: usize>(stream: &mut Stream<D>, samples: &[(i64, [f64; D])]) -> Vec<Sample<D>> {
    let mut found = Vec::new();
    for (t_ns, value) in samples {
        found.extend(stream.push(*t_ns, *value).unwrap());
    }
    found.extend(stream.flush());
    found
}

proptest! {
    #[test]
    fn a_polynomial_of_the_order_passes_unchanged_with_its_derivatives(
        spec in specs(),
        steps in irregular_steps(),
        start_ns in -4_000_000_000_000_000_000..4_000_000_000_000_000_000_i64,
        shape in prop::collection::vec(-3.0..3.0_f64, 6),
    ) {
        let shape = &shape[..=spec.order()];
        let times = times(start_ns, &steps);
        let seconds = |t_ns: i64| (t_ns - start_ns) as f64 * 1e-9;
        let samples: Vec<_> = times
            .iter()
            .map(|&t_ns| (t_ns, [polynomial(shape, 0, seconds(t_ns))]))
            .collect();
        let found = run(&mut Stream::new(spec).with_regular_tolerance(0.0).unwrap(), &samples);
        let whole = |s: &&Sample<1>| s.order == spec.order();
        prop_assert!(times.len() < spec.order() + 1 || found.iter().filter(whole).count() > 0);
        for sample in found.iter().filter(whole) {
            let expected = polynomial(shape, spec.derivative(), seconds(sample.t_ns));
            // A derivative divides rounding errors of the values, here at most some hundred, by a
            // window of at least `order` steps of 5 ms to its power.
            let scale = samples.iter().fold(1.0, |m: f64, (_, v)| m.max(v[0].abs()));
            let tolerance = 1e-11 * scale * (1.0 / 0.005_f64).powi(spec.derivative() as i32);
            prop_assert!(
                (sample.value[0] - expected).abs() <= tolerance,
                "{spec:?} at {}: {} for {expected}", sample.t_ns, sample.value[0]
            );
        }
    }

    #[test]
    fn every_sample_comes_out_once_in_order_at_its_own_time(
        spec in specs(),
        steps in irregular_steps(),
        gaps in prop::collection::vec(any::<prop::sample::Index>(), 0..6),
    ) {
        let mut steps = steps;
        for gap in gaps {
            let gap = gap.index(steps.len());
            steps[gap] = 1_000_000_000;
        }
        let times = times(0, &steps);
        let mut stream = Stream::<1>::new(spec).with_max_gap_ns(999_999_999).unwrap();
        let mut found = Vec::new();
        for (pushed, t_ns) in times.iter().enumerate() {
            found.extend(stream.push(*t_ns, [1.0]).unwrap());
            // Samples held back by a gap may come sooner, none comes later.
            let late = spec.derivative() == 0 && found.len() + spec.look_ahead() <= pushed;
            prop_assert!(!late, "{} of {} came out", found.len(), pushed + 1);
        }
        found.extend(stream.flush());
        prop_assert!(found.iter().all(|s| s.order <= spec.order() && s.order < s.samples));
        let found: Vec<i64> = found.iter().map(|s| s.t_ns).collect();
        if spec.derivative() == 0 {
            prop_assert_eq!(found, times);
        } else {
            // Too few samples for a derivative leave some out, but never reorder or invent any.
            prop_assert!(found.windows(2).all(|pair| pair[0] < pair[1]));
            prop_assert!(found.iter().all(|t_ns| times.binary_search(t_ns).is_ok()));
        }
        prop_assert_eq!(stream.newest_ns(), None);
    }

    #[test]
    fn nearly_regular_times_give_the_same_by_either_path(
        spec in specs(),
        step_ns in 1_000_000..40_000_000_i64,
        values in prop::collection::vec(-2.0..2.0_f64, 45..60),
    ) {
        let samples: Vec<_> = values
            .iter()
            .enumerate()
            .map(|(i, v)| (i as i64 * step_ns + (i % 2) as i64, [*v]))
            .collect();
        let cached = run(&mut Stream::new(spec).with_regular_tolerance(1e-5).unwrap(), &samples);
        let fitted = run(&mut Stream::new(spec).with_regular_tolerance(0.0).unwrap(), &samples);
        prop_assert_eq!(cached.len(), fitted.len());
        for (c, f) in cached.iter().zip(&fitted) {
            prop_assert_eq!((c.t_ns, c.samples, c.order), (f.t_ns, f.samples, f.order));
        }
        // 1 ns in 1 ms moves a weight by about 1e-6 of its size, and the sizes sum to this.
        let size: f64 = coefficients(
            spec.window(), spec.order(), spec.derivative(),
            (spec.window() - 1 - spec.look_ahead()) as f64, step_ns as f64 * 1e-9,
        ).unwrap().iter().map(|w| w.abs()).sum();
        for (c, f) in cached.iter().zip(&fitted).filter(|(c, _)| c.samples == spec.window()) {
            prop_assert!((c.value[0] - f.value[0]).abs() <= 1e-4 * size.max(1.0));
        }
    }

    #[test]
    fn components_do_not_mix_and_scale_linearly(
        spec in specs(),
        steps in irregular_steps(),
        seed in -1.0..1.0_f64,
    ) {
        let times = times(0, &steps);
        let wave = |t_ns: i64| (seed + 7.0 * t_ns as f64 * 1e-9).sin();
        let one: Vec<_> = times.iter().map(|&t| (t, [wave(t)])).collect();
        let three: Vec<_> = times.iter().map(|&t| (t, [0.0, wave(t), -4.0 * wave(t)])).collect();
        let one = run(&mut Stream::new(spec), &one);
        let three = run(&mut Stream::new(spec), &three);
        for (a, b) in one.iter().zip(&three) {
            prop_assert_eq!(b.value, [0.0, a.value[0], -4.0 * a.value[0]]);
        }
    }

    #[test]
    fn weights_of_a_derivative_sum_to_what_a_constant_gives(
        spec in specs(),
        position in 0.0..=1.0_f64,
    ) {
        let position = position * (spec.window() - 1) as f64;
        let weights = coefficients(spec.window(), spec.order(), spec.derivative(), position, 1.0).unwrap();
        let size: f64 = weights.iter().map(|w| w.abs()).sum();
        let expected = f64::from(u8::from(spec.derivative() == 0));
        prop_assert!((weights.iter().sum::<f64>() - expected).abs() <= 1e-12 * size.max(1.0));
    }

    #[test]
    fn a_whole_signal_and_a_stream_agree_where_both_have_a_whole_window(
        spec in specs(),
        values in prop::collection::vec(-2.0..2.0_f64, 41..60),
    ) {
        let whole = smooth(&spec, &values, 0.02).unwrap();
        prop_assert_eq!(whole.len(), values.len());
        let samples: Vec<_> =
            values.iter().enumerate().map(|(i, v)| (i as i64 * 20_000_000, [*v])).collect();
        let streamed = run(&mut Stream::new(spec), &samples);
        for s in streamed.iter().filter(|s| s.samples == spec.window()) {
            let expected = whole[(s.t_ns / 20_000_000) as usize];
            let scale = 100.0 * 50f64.powi(spec.derivative() as i32);
            prop_assert!((s.value[0] - expected).abs() <= 1e-11 * scale);
        }
    }
}
