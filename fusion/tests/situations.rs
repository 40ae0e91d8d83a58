//! Who is who in the situations that people get into; `examples/situations.rs` does the same at length.

#![allow(clippy::unwrap_used)]

mod support;

use posefuse_fusion::Config;
use posefuse_simulator::{Layout, Scenario, SensorErrors, Situation};
use support::judge::{Verdict, judge};

fn judged(scenario: &Scenario, seeds: std::ops::RangeInclusive<u64>, seconds: f64) -> Verdict {
    let mut sum = Verdict::default();
    for seed in seeds {
        let scenario = Scenario {
            seed,
            ..scenario.clone()
        };
        sum.add(&judge(&scenario, &Config::default(), seconds, 0.015));
    }
    sum
}

fn harsh(situation: Situation, people: usize) -> Scenario {
    Scenario {
        situation,
        people,
        errors: SensorErrors::harsh(),
        ..Scenario::default()
    }
}

#[test]
fn who_crosses_or_embraces_keeps_the_id() {
    for situation in [Situation::Crossing, Situation::Hugging] {
        let verdict = judged(&harsh(situation, 2), 1..=2, 12.0);
        assert!(verdict.person_frames > 1000);
        assert_eq!((verdict.switches, verdict.ghosts), (0, 0), "{verdict:?}");
        assert!(
            verdict.swaps_right().iter().all(|share| *share > 0.99),
            "{verdict:?}"
        );
    }
}

#[test]
fn who_leaves_and_returns_keeps_the_id() {
    let verdict = judged(&harsh(Situation::Leaving, 1), 2..=3, 25.0);
    assert!(verdict.returns >= 4, "{verdict:?}");
    assert_eq!(
        (verdict.kept, verdict.switches),
        (verdict.returns, 0),
        "{verdict:?}"
    );
}

#[test]
fn sides_are_found_though_everybody_shows_their_back() {
    let scenario = Scenario {
        layout: Layout::Arc,
        sensors: 3,
        ..harsh(Situation::Away, 1)
    };
    let verdict = judged(&scenario, 1..=4, 5.0);
    let right = f64::from(verdict.right_early as u32) / f64::from(verdict.labelled_early as u32);
    assert!(right > 0.97, "{right}: {verdict:?}");
}

#[test]
fn frames_in_bunches_and_out_of_order_make_nobody_new() {
    let mut scenario = harsh(Situation::Crossing, 2);
    scenario.errors.bursts_per_min = 6.0;
    scenario.errors.gaps_per_min = 6.0;
    scenario.errors.reordered = 0.03;
    let verdict = judged(&scenario, 1..=1, 15.0);
    assert_eq!((verdict.switches, verdict.ghosts), (0, 0), "{verdict:?}");
    assert!(
        verdict.out_of_order > 10 && verdict.repeated > 50,
        "{verdict:?}"
    );
}

#[test]
fn nobody_is_made_of_what_a_mirror_shows() {
    for (layout, sensors) in [(Layout::Ring, 4), (Layout::Arc, 3)] {
        let mut scenario = Scenario {
            layout,
            sensors,
            ..harsh(Situation::Everyday, 1)
        };
        scenario.errors.mirror = true;
        let verdict = judged(&scenario, 1..=2, 15.0);
        assert!(verdict.person_frames > 800, "{verdict:?}");
        assert_eq!((verdict.ghosts, verdict.missed), (0, 0), "{verdict:?}");
    }
}
