//! A hundred bad calibrations and a hundred good ones, and what the verdict says of them.

use std::collections::BTreeMap;

use posefuse_calibration::{CalibrationError, Options, Solution, Verdict, solve};
use posefuse_simulator::{Layout, Scenario, SensorErrors, World};
use std::sync::Arc;

use crate::bad::{EACH, KINDS};
use crate::simulated::{pair_errors, record};

/// The most good ones that may not pass.
const GOOD_LOST: usize = 2;
const WALK_S: f64 = 30.0;

type Outcome = Result<Solution, CalibrationError>;

/// Judges the bad ones; whether none passed.
pub(crate) fn print_bad(threads: usize) -> bool {
    println!(
        "\nBad calibrations, {EACH} of each kind: passed / weak / failed / refused, and the first reason"
    );
    let cases: Vec<(usize, usize)> = (0..KINDS.len())
        .flat_map(|kind| (0..EACH).map(move |case| (kind, case)))
        .collect();
    let outcomes = crate::each(&cases, threads, |&(kind, case)| {
        solve(&KINDS[kind].1(case), &Options::default())
    });
    let mut passed = 0;
    for (kind, outcomes) in outcomes.chunks(EACH).enumerate() {
        let mut counts = [0; 4];
        let mut reasons: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (case, outcome) in outcomes.iter().enumerate() {
            counts[slot(outcome)] += 1;
            reasons.entry(reason(outcome)).or_default().push(case);
        }
        passed += counts[0];
        println!("{:<24}{counts:?}", KINDS[kind].0);
        let mut reasons: Vec<_> = reasons.into_iter().collect();
        reasons.sort_by_key(|(_, cases)| cases[0]);
        for (reason, cases) in reasons {
            println!("    {cases:?} {reason}");
        }
    }
    println!("{passed} of {} bad ones passed", outcomes.len());
    passed == 0
}

fn slot(outcome: &Outcome) -> usize {
    outcome
        .as_ref()
        .map_or(3, |solution| solution.report.verdict as usize)
}

fn reason(outcome: &Outcome) -> String {
    match outcome {
        Err(error) => format!("refused: {error}"),
        Ok(solution) => {
            let reasons = solution
                .report
                .reasons
                .iter()
                .filter(|r| r.severity > Verdict::Passed);
            let texts: Vec<String> = reasons
                .map(|r| format!("{}: {}", r.severity, r.what))
                .collect();
            texts.join("; ")
        }
    }
}

/// A room in which nothing is wrong.
struct Good {
    layout: Layout,
    sensors: usize,
    people: usize,
    biased: bool,
    seed: u64,
}

/// Judges the good ones; whether at most two did not pass.
pub(crate) fn print_good(threads: usize) -> bool {
    let mut rooms = Vec::new();
    for (index, seed) in (100..200).enumerate() {
        rooms.push(Good {
            layout: if index % 2 == 0 {
                Layout::Ring
            } else {
                Layout::Arc
            },
            sensors: [2, 3, 4, 6][index / 2 % 4],
            people: if index % 10 == 9 { 2 } else { 1 },
            biased: index % 4 == 3,
            seed,
        });
    }
    let outcomes = crate::each(&rooms, threads, |room| {
        let scenario = Scenario {
            seed: room.seed,
            people: room.people,
            sensors: room.sensors,
            layout: room.layout,
            errors: SensorErrors {
                sensor_bias_mm: if room.biased { 8.0 } else { 0.0 },
                ..SensorErrors::default()
            },
            ..Scenario::default()
        };
        let world = Arc::new(World::new(&scenario).expect("a possible scenario"));
        let outcome = solve(&record(&world, WALK_S), &Options::default());
        let worst_mm = outcome.as_ref().map_or(f64::NAN, |solution| {
            let errors = pair_errors(&world, &solution.calibration, WALK_S);
            errors
                .iter()
                .map(|(_, error)| error.volume_mm)
                .fold(0.0, f64::max)
        });
        (outcome, worst_mm)
    });
    println!("\nGood calibrations: those that did not pass");
    let mut lost = 0;
    let mut worst_passed: f64 = 0.0;
    for (room, (outcome, worst_mm)) in rooms.iter().zip(&outcomes) {
        if slot(outcome) == 0 {
            worst_passed = worst_passed.max(*worst_mm);
            continue;
        }
        lost += 1;
        println!(
            "    {:?} of {}, {} people, seed {}{}, worst pair off by {worst_mm:.0} mm: {}",
            room.layout,
            room.sensors,
            room.people,
            room.seed,
            if room.biased { ", 8 mm bias" } else { "" },
            reason(outcome)
        );
    }
    println!(
        "{lost} of {} good ones did not pass (at most {GOOD_LOST}); the worst pair of those that did is off by {worst_passed:.1} mm",
        rooms.len()
    );
    lost <= GOOD_LOST
}
