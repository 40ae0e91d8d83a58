//! Warm-up, gaps, restart and refusal, each spelled out on a few samples.
#![allow(clippy::unwrap_used)]

use sgfilter::{Error, MAX_WINDOW, Spec, Stream, coefficients, smooth};

const STEP_NS: i64 = 33_333_333;

fn spec(window: usize, order: usize, look_ahead: usize, derivative: usize) -> Spec {
    Spec::new(window, order, look_ahead, derivative).unwrap()
}

#[test]
fn warm_up_uses_what_there_is_and_says_so() {
    let mut stream = Stream::<1>::new(spec(5, 2, 1, 0));
    let shapes: Vec<_> = (0..8)
        .map(|i| stream.push(i * STEP_NS, [i as f64]).unwrap())
        .map(|out| out.map(|s| (s.t_ns / STEP_NS, s.samples, s.order)))
        .collect();
    let expected = [
        None,
        Some((0, 2, 1)),
        Some((1, 3, 2)),
        Some((2, 4, 2)),
        Some((3, 5, 2)),
        Some((4, 5, 2)),
        Some((5, 5, 2)),
        Some((6, 5, 2)),
    ];
    assert_eq!(shapes, expected);
    let last: Vec<_> = stream.flush().map(|s| (s.t_ns, s.samples)).collect();
    assert_eq!(last, [(7 * STEP_NS, 5)]);
    assert_eq!(stream.flush().count(), 0);
}

#[test]
fn a_derivative_waits_until_the_order_can_bear_it() {
    let mut stream = Stream::<1>::new(spec(5, 2, 0, 1));
    assert_eq!(stream.push(0, [3.0]).unwrap(), None);
    let second = stream.push(500_000_000, [4.0]).unwrap().unwrap();
    assert_eq!((second.t_ns, second.order), (500_000_000, 1));
    assert!((second.value[0] - 2.0).abs() < 1e-12);
}

#[test]
fn a_gap_restarts_the_filter_and_loses_nothing() {
    let mut stream = Stream::<1>::new(spec(5, 1, 2, 0))
        .with_max_gap_ns(STEP_NS)
        .unwrap();
    // A step of 100 across the gap would smear over both sides if the window bridged it.
    let before = (0..6).map(|i| (i * STEP_NS, 1.0));
    let after = (0..6).map(|i| (i * STEP_NS + 1_000_000_000, 101.0));
    let mut found = Vec::new();
    for (t_ns, value) in before.chain(after) {
        found.extend(stream.push(t_ns, [value]).unwrap());
    }
    found.extend(stream.flush());
    assert_eq!(found.len(), 12);
    for sample in &found {
        let expected = if sample.t_ns < 1_000_000_000 {
            1.0
        } else {
            101.0
        };
        assert!((sample.value[0] - expected).abs() < 1e-12, "{sample:?}");
    }
    let first_after = found.iter().find(|s| s.t_ns >= 1_000_000_000).unwrap();
    assert_eq!(first_after.samples, 3);
}

#[test]
fn a_gap_of_exactly_the_limit_is_bridged() {
    let mut stream = Stream::<1>::new(spec(5, 1, 0, 0))
        .with_max_gap_ns(100)
        .unwrap();
    stream.push(0, [0.0]).unwrap();
    assert_eq!(stream.push(100, [0.0]).unwrap().unwrap().samples, 2);
    assert_eq!(stream.push(201, [0.0]).unwrap().unwrap().samples, 1);
}

#[test]
fn bad_samples_are_refused_and_change_nothing() {
    let mut stream = Stream::<2>::new(spec(5, 2, 1, 0));
    for i in 0..7 {
        stream.push(i * STEP_NS, [i as f64, 0.0]).unwrap();
    }
    let before = stream.clone();
    let newest_ns = 6 * STEP_NS;
    for t_ns in [newest_ns, newest_ns - 1, i64::MIN] {
        let error = stream.push(t_ns, [0.0; 2]).unwrap_err();
        assert_eq!(error, Error::NotAfter { t_ns, newest_ns });
    }
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = stream.push(newest_ns + 1, [0.0, value]).unwrap_err();
        let Error::NotFinite { at, component, .. } = error else {
            panic!("{error:?}");
        };
        assert_eq!((at, component), (newest_ns + 1, 1));
    }
    assert_eq!(stream, before);
    assert!(stream.push(newest_ns + 1, [0.0; 2]).unwrap().is_some());
}

#[test]
fn restart_forgets_and_allows_earlier_times() {
    let mut stream = Stream::<1>::new(spec(5, 2, 1, 0));
    for i in 10..20 {
        stream.push(i * STEP_NS, [1.0]).unwrap();
    }
    stream.restart();
    assert_eq!(stream, Stream::new(spec(5, 2, 1, 0)));
    assert_eq!(stream.push(0, [2.0]).unwrap(), None);
    assert_eq!(stream.flush().map(|s| s.value).collect::<Vec<_>>(), [[2.0]]);
}

#[test]
fn extreme_times_neither_panic_nor_lie() {
    let mut stream = Stream::<1>::new(spec(4, 2, 0, 0));
    for t_ns in [i64::MIN, i64::MIN + 1, 0, i64::MAX - 1, i64::MAX] {
        let sample = stream.push(t_ns, [5.0]).unwrap().unwrap();
        assert_eq!(sample.t_ns, t_ns);
        assert!((sample.value[0] - 5.0).abs() < 1e-9, "{sample:?}");
    }
    let widest = spec(MAX_WINDOW, MAX_WINDOW - 1, MAX_WINDOW - 1, 0);
    let mut stream = Stream::<1>::new(widest);
    for i in 0..MAX_WINDOW as i64 {
        let due = stream.push(i * i * STEP_NS, [1.0]).unwrap();
        assert_eq!(due.is_some(), i as usize == MAX_WINDOW - 1);
    }
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let window = |window| Spec::new(window, 0, 0, 0);
    assert_eq!(window(1), Err(Error::Window { window: 1 }));
    assert_eq!(window(256), Err(Error::Window { window: 256 }));
    assert!(window(2).is_ok() && window(255).is_ok());
    assert!(matches!(Spec::new(5, 5, 0, 0), Err(Error::Order { .. })));
    assert!(matches!(
        Spec::new(5, 2, 5, 0),
        Err(Error::LookAhead { .. })
    ));
    assert!(matches!(
        Spec::new(5, 2, 0, 3),
        Err(Error::Derivative { .. })
    ));
    for bad in [0, -1] {
        let stream = Stream::<1>::new(spec(5, 2, 0, 0)).with_max_gap_ns(bad);
        assert_eq!(stream.unwrap_err(), Error::MaxGap { max_gap_ns: bad });
    }
    for bad in [-0.1, 0.6, f64::NAN] {
        let stream = Stream::<1>::new(spec(5, 2, 0, 0)).with_regular_tolerance(bad);
        assert!(matches!(stream, Err(Error::Tolerance { .. })));
    }
    for bad in [-0.5, 4.5, f64::NAN] {
        let found = coefficients(5, 2, 0, bad, 1.0);
        assert!(matches!(found, Err(Error::Position { .. })));
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
        let found = coefficients(5, 2, 2, 2.0, bad);
        assert!(
            matches!(found, Err(Error::Delta { .. })),
            "{bad}: {found:?}"
        );
    }
    let centred = spec(5, 2, 2, 0);
    assert_eq!(
        smooth(&centred, &[0.0; 4], 1.0),
        Err(Error::TooShort {
            samples: 4,
            window: 5
        })
    );
    let broken = smooth(&centred, &[0.0, 0.0, 0.0, f64::NAN, 0.0], 1.0);
    assert!(matches!(broken, Err(Error::NotFinite { at: 3, .. })));
}
