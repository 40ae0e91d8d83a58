//! Who is who in the situations that people get into: ids, returns, ghosts, left and right, against the truth.
//!
//! `cargo run --release -p posefuse-fusion --example situations [runs] [seconds] [part of a name] [log]`; exit code 1
//! if a promise is broken: no id changes while its owner is seen, a return within 2 s keeps its id, no ghosts, and
//! sides taken rightly in 99.5 % of sensor-frames.

#[path = "../tests/support/mod.rs"]
mod support;

use posefuse_fusion::Config;
use posefuse_simulator::{Layout, Scenario, SensorErrors, Situation};
use support::judge::{Verdict, judge, share};

/// Share of sensor-frames in which sides are to be taken rightly.
const SWAPS_RIGHT: f64 = 0.995;

/// A row of the table.
struct Row {
    name: &'static str,
    scenario: Scenario,
    /// By how much the calibration is off, metres.
    off_m: f64,
}

fn row(name: &'static str, off_m: f64, scenario: Scenario) -> Row {
    Row {
        name,
        scenario,
        off_m,
    }
}

fn rows() -> Vec<Row> {
    use Situation::*;
    let harsh = |situation, people, sensors, layout| Scenario {
        situation,
        people,
        sensors,
        layout,
        errors: SensorErrors::harsh(),
        ..Scenario::default()
    };
    let ring = |situation, people| harsh(situation, people, 4, Layout::Ring);
    let with = |scenario: Scenario, change: &dyn Fn(&mut SensorErrors)| {
        let mut scenario = scenario;
        change(&mut scenario.errors);
        scenario
    };
    vec![
        row("everyday, ring 4", 0.015, ring(Everyday, 1)),
        row(
            "everyday, ring 3",
            0.015,
            harsh(Everyday, 1, 3, Layout::Ring),
        ),
        row(
            "everyday, ring 6",
            0.015,
            harsh(Everyday, 1, 6, Layout::Ring),
        ),
        row("everyday, arc 2", 0.015, harsh(Everyday, 1, 2, Layout::Arc)),
        row("everyday, arc 3", 0.015, harsh(Everyday, 1, 3, Layout::Arc)),
        row(
            "everyday, one sensor",
            0.0,
            harsh(Everyday, 1, 1, Layout::Arc),
        ),
        row("away, arc 3", 0.015, harsh(Away, 1, 3, Layout::Arc)),
        row("turning, ring 4", 0.015, ring(Turning, 1)),
        row("sitting, ring 4", 0.015, ring(Sitting, 1)),
        row("lying, ring 4", 0.015, ring(Lying, 1)),
        row("two, everyday", 0.015, ring(Everyday, 2)),
        row("two crossing", 0.015, ring(Crossing, 2)),
        row("two crossing, 30 mm off", 0.03, ring(Crossing, 2)),
        row(
            "two crossing, arc 3",
            0.015,
            harsh(Crossing, 2, 3, Layout::Arc),
        ),
        row("three crossing", 0.015, ring(Crossing, 3)),
        row("two hugging", 0.015, ring(Hugging, 2)),
        row("two hugging, 30 mm off", 0.03, ring(Hugging, 2)),
        row(
            "two hugging, arc 3",
            0.015,
            harsh(Hugging, 2, 3, Layout::Arc),
        ),
        row("one leaving", 0.015, ring(Leaving, 1)),
        row("two leaving", 0.015, ring(Leaving, 2)),
        row(
            "furniture, two people",
            0.015,
            with(ring(Everyday, 2), &|e| e.furniture_per_min = 6.0),
        ),
        row(
            "furniture, one sensor of three",
            0.015,
            with(harsh(Everyday, 1, 3, Layout::Arc), &|e| {
                e.furniture_per_min = 6.0
            }),
        ),
        row(
            "mirror, ring 4",
            0.015,
            with(ring(Everyday, 1), &|e| e.mirror = true),
        ),
        row(
            "mirror, arc 3",
            0.015,
            with(harsh(Everyday, 1, 3, Layout::Arc), &|e| e.mirror = true),
        ),
        row(
            "bursts, gaps, reordering",
            0.015,
            with(ring(Crossing, 2), &|e| {
                e.bursts_per_min = 6.0;
                e.gaps_per_min = 4.0;
                e.reordered = 0.02;
            }),
        ),
    ]
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize, default: f64| {
        let given = args.get(index).and_then(|a| a.parse().ok());
        given.unwrap_or(default)
    };
    let runs = number(0, 3.0) as u64;
    let seconds = number(1, 30.0);
    let part = args.get(2).map_or("", String::as_str);
    let log = args.get(3).is_some_and(|a| a == "log");
    println!(
        "{:32}{:>5}{:>9}{:>8}{:>8}{:>9}{:>8}{:>9}{:>9}{:>9}{:>10}{:>8}",
        "situation",
        "runs",
        "switches",
        "extra",
        "missed",
        "returns",
        "ghosts",
        "arms",
        "legs",
        "first 2s",
        "repeated",
        "order"
    );
    let mut broken = false;
    for Row {
        name,
        scenario,
        off_m,
    } in rows()
    {
        if !name.contains(part) {
            continue;
        }
        let mut sum = Verdict::default();
        for seed in 1..=runs {
            let scenario = Scenario {
                seed,
                ..scenario.clone()
            };
            let verdict = judge(&scenario, &Config::default(), seconds, off_m);
            if log {
                for line in &verdict.log {
                    println!("  seed {seed}: {line}");
                }
            }
            sum.add(&verdict);
        }
        broken |= !print(name, runs, &sum);
    }
    if broken {
        println!("* a promise is broken");
        std::process::exit(1);
    }
}

/// Prints a row; whether every promise holds.
fn print(name: &str, runs: u64, sum: &Verdict) -> bool {
    let [arms, legs] = sum.swaps_right();
    let kept = sum.switches == 0
        && sum.kept == sum.returns
        && sum.ghosts == 0
        && arms.min(legs) >= SWAPS_RIGHT;
    println!(
        "{:32}{runs:5}{:9}{:8}{:7.2}%{:>9}{:8}{:8.2}%{:8.2}%{:8.1}%{:10}{:8}",
        format!("{name}{}", if kept { "" } else { " *" }),
        sum.switches,
        sum.extra,
        100.0 * share(sum.missed, sum.person_frames),
        format!("{}/{}", sum.kept, sum.returns),
        sum.ghosts,
        100.0 * arms,
        100.0 * legs,
        100.0 * share(sum.right_early, sum.labelled_early),
        sum.repeated,
        sum.out_of_order,
    );
    kept
}
