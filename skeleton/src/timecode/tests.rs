//! Labels against known ones, at every rate.

use super::*;
use proptest::prelude::*;

fn of(rate: TimecodeRate, seconds: f64) -> String {
    Timecode::of_day(rate, (seconds * 1e9).round() as i64).to_string()
}

/// The label of the frame of this number.
fn numbered(rate: TimecodeRate, number: u64) -> String {
    Timecode { rate, number }.to_string()
}

#[test]
fn whole_rates_count_the_time_of_day() {
    assert_eq!(of(TimecodeRate::Fps25, 0.0), "00:00:00:00");
    assert_eq!(of(TimecodeRate::Fps25, 3661.5), "01:01:01:12");
    assert_eq!(of(TimecodeRate::Fps24, 86_399.999), "23:59:59:23");
    assert_eq!(of(TimecodeRate::Fps60, 43_200.017), "12:00:00:01");
    assert_eq!(of(TimecodeRate::Fps50, 0.0199), "00:00:00:00");
    assert_eq!(of(TimecodeRate::Fps50, 0.0200), "00:00:00:01");
}

#[test]
fn evenly_spaced_times_have_evenly_spaced_labels() {
    for rate in TimecodeRate::ALL {
        let (frames, seconds) = rate.fraction();
        let separator = if rate.is_drop() { ';' } else { ':' };
        let first = Timecode::parse(rate, &format!("14:15:00{separator}02")).unwrap();
        for step in 0..2000_i64 {
            let exact = step as f64 * 1e9 * f64::from(seconds) / f64::from(frames);
            let at = Timecode::of_day(rate, first.day_ns() + exact.round() as i64);
            assert_eq!(at.number, first.number + step as u64, "{rate}");
        }
    }
}

#[test]
fn drop_frame_skips_two_labels_a_minute_but_every_tenth() {
    let rate = TimecodeRate::Fps29Drop;
    for (number, label) in [
        (0, "00:00:00;00"),
        (1799, "00:00:59;29"),
        (1800, "00:01:00;02"),
        (3597, "00:01:59;29"),
        (3598, "00:02:00;02"),
        (17_981, "00:09:59;29"),
        (17_982, "00:10:00;00"),
        (17_983, "00:10:00;01"),
        (19_782, "00:11:00;02"),
        (107_892, "01:00:00;00"),
        (2_589_407, "23:59:59;29"),
    ] {
        assert_eq!(numbered(rate, number), label);
        assert_eq!(Timecode::parse(rate, label).unwrap().number, number);
    }
    // An hour of labels is an hour of time, to 3.6 ms.
    let hour = Timecode::parse(rate, "01:00:00;00").unwrap();
    assert_eq!(hour.day_ns(), 3_599_996_400_000);
}

#[test]
fn the_last_label_of_a_day_is_held_until_midnight() {
    let rate = TimecodeRate::Fps29Drop;
    assert_eq!(of(rate, 86_399.95), "23:59:59;29");
    assert_eq!(
        Timecode::of_day(rate, DAY_NS - 1).to_string(),
        "23:59:59;29"
    );
    let zone = |rate| TimecodeZone {
        rate,
        utc_offset_s: 0,
    };
    for rate in TimecodeRate::ALL {
        let midnight = 20_000 * DAY_NS;
        let before = zone(rate).at(midnight - 1).fields();
        assert_eq!(before, [23, 59, 59, rate.labels() - 1], "{rate}");
        assert_eq!(zone(rate).at(midnight).fields(), [0; 4], "{rate}");
    }
}

#[test]
fn a_room_has_its_own_midnight_also_before_1970() {
    let zone = TimecodeZone {
        rate: TimecodeRate::Fps30,
        utc_offset_s: 2 * 3600,
    };
    assert_eq!(zone.at(0).to_string(), "02:00:00:00");
    assert_eq!(zone.at(-7_200_000_000_000 - 1).to_string(), "23:59:59:29");
    let west = TimecodeZone {
        utc_offset_s: -9 * 3600 - 1800,
        ..zone
    };
    assert_eq!(west.at(0).to_string(), "14:30:00:00");
}

#[test]
fn what_is_no_timecode_is_refused_with_what_was_expected() {
    for text in [
        "",
        "1:2:3:4",
        "00:00:00:30",
        "24:00:00:00",
        "00:60:00:00",
        "00-00-00-00",
        "00:00:00;00",
        "+1:00:00:00",
        "00:00:00:0é",
    ] {
        let error = Timecode::parse(TimecodeRate::Fps30, text).unwrap_err();
        assert!(error.to_string().contains("up to 23:59:59:29"), "{error}");
    }
    let error = Timecode::parse(TimecodeRate::Fps29Drop, "00:01:00;01").unwrap_err();
    assert!(error.to_string().contains("skips"), "{error}");
    assert!(Timecode::parse(TimecodeRate::Fps29Drop, "00:10:00:01").is_ok());
    let error = "23.98".parse::<TimecodeRate>().unwrap_err();
    assert!(error.to_string().contains("29.97df"), "{error}");
}

proptest! {
    #[test]
    fn every_instant_has_one_label_that_reads_back(ns in 0..DAY_NS, which in 0..6_usize) {
        let rate = TimecodeRate::ALL[which];
        let code = Timecode::of_day(rate, ns);
        prop_assert_eq!(Timecode::parse(rate, &code.to_string()).unwrap(), code);
        prop_assert_eq!(Timecode::of_day(rate, code.day_ns()), code);
        prop_assert!(code.day_ns() <= ns + EARLY_NS);
        prop_assert!(Timecode::of_day(rate, ns.saturating_sub(20_000_000)) <= code);
        let (frames, seconds) = rate.fraction();
        let frame_ns = 1e9 * f64::from(seconds) / f64::from(frames);
        // Only the end of a drop-frame day has a longer frame.
        let held = rate.is_drop() && ns > DAY_NS - 100_000_000;
        prop_assert!(held || ((ns - code.day_ns()) as f64) < frame_ns);
    }
}
