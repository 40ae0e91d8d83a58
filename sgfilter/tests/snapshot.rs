//! The state of a stream is saved and restored bit-exactly, and nonsense is refused.
#![allow(clippy::unwrap_used)]

use sgfilter::{Spec, Stream};

const STEP_NS: i64 = 20_000_000;

/// Sample `i`: a wave at jittered times, with a gap now and then, so that every part of the state is in use.
fn sample(i: i64) -> (i64, [f64; 40]) {
    let t_ns = i * STEP_NS + (i % 4) * 1_500_000 + i / 12 * 1_000_000_000;
    let t = t_ns as f64 * 1e-9;
    (t_ns, std::array::from_fn(|d| (t + d as f64).sin()))
}

fn stream() -> Stream<40> {
    let spec = Spec::new(7, 3, 2, 1).unwrap();
    Stream::new(spec).with_max_gap_ns(500_000_000).unwrap()
}

#[test]
fn a_restored_stream_goes_on_with_the_same_bits() {
    for stop in 0..40 {
        let mut original = stream();
        for i in 0..stop {
            let (t_ns, value) = sample(i);
            original.push(t_ns, value).unwrap();
        }
        let bytes = postcard::to_stdvec(&original).unwrap();
        let mut restored: Stream<40> = postcard::from_bytes(&bytes).unwrap();
        assert_eq!(restored, original);
        assert_eq!(postcard::to_stdvec(&restored).unwrap(), bytes);
        for i in stop..stop + 20 {
            let (t_ns, value) = sample(i);
            let (a, b) = (original.push(t_ns, value), restored.push(t_ns, value));
            let bits = |out: Option<sgfilter::Sample<40>>| {
                out.map(|s| (s.t_ns, s.samples, s.order, s.value.map(f64::to_bits)))
            };
            assert_eq!(bits(a.unwrap()), bits(b.unwrap()));
        }
        assert_eq!(
            postcard::to_stdvec(&original).unwrap(),
            postcard::to_stdvec(&restored).unwrap()
        );
    }
}

/// The JSON of a stream of two samples after one edit, read back.
fn edited(from: &str, to: &str) -> Result<Stream<1>, String> {
    let mut stream = Stream::<1>::new(Spec::new(3, 1, 1, 0).unwrap());
    stream.push(10, [0.5]).unwrap();
    stream.push(20, [1.5]).unwrap();
    let json = serde_json::to_string(&stream).unwrap();
    assert!(json.contains(from), "{json} has no {from}");
    serde_json::from_str(&json.replacen(from, to, 1)).map_err(|error| error.to_string())
}

#[test]
fn a_state_that_cannot_be_is_refused() {
    assert!(edited("\"t_ns\":20", "\"t_ns\":21").is_ok());
    for (from, to, expected) in [
        ("\"t_ns\":20", "\"t_ns\":10", "do not increase"),
        ("\"order\":1", "\"order\":3", "needs a window of at least 4"),
        ("\"window\":3", "\"window\":1", "expected 2 to 255"),
        ("\"window\":3", "\"widow\":3", "unknown field `widow`"),
        (
            "\"regular_tolerance\":0.0001",
            "\"regular_tolerance\":-1",
            "tolerance -1",
        ),
        (
            "\"max_gap_ns\":null",
            "\"max_gap_ns\":0",
            "longest gap of 0 ns",
        ),
        ("[0.5]", "[0.5,0.5]", "trailing"),
        ("[0.5]", "[]", "1 numbers"),
        (
            "\"due\":[]",
            "\"due\":[{\"t_ns\":1,\"value\":[0.0],\"samples\":1,\"order\":0}]",
            "more samples due",
        ),
        (
            "{\"t_ns\":10",
            "{\"t_ns\":1,\"value\":[0.0]},{\"t_ns\":2,\"value\":[0.0]},{\"t_ns\":10",
            "more samples than the window",
        ),
    ] {
        let error = edited(from, to).expect_err(to);
        assert!(error.contains(expected), "{to} gave: {error}");
    }
}
