//! Accuracy of the fusing methods on the simulator, with and without left/right handling.
//!
//! `cargo run --release -p posefuse-fusion --example accuracy [seconds] [seeds]`: errors in mm (16 of them a bias
//! of the body that no sensor can see), jitter in m/s^2.

#[path = "../tests/support/mod.rs"]
mod support;

use posefuse_fusion::{Config, FuseMethod, IntakeMode};
use posefuse_simulator::{Layout, Scenario, SensorErrors};
use support::{Score, run, score};

fn main() {
    let mut args = std::env::args()
        .skip(1)
        .filter_map(|a| a.parse::<f64>().ok());
    let seconds = args.next().unwrap_or(30.0);
    let seeds = args.next().unwrap_or(3.0) as u64;
    let rooms = [
        ("ring 4, 1 person", Scenario::default()),
        (
            "ring 4, 2 people",
            Scenario {
                people: 2,
                ..Scenario::default()
            },
        ),
        (
            "arc 3, 1 person",
            Scenario {
                sensors: 3,
                layout: Layout::Arc,
                ..Scenario::default()
            },
        ),
        (
            "ring 4, 1 person, harsh",
            Scenario {
                errors: SensorErrors::harsh(),
                ..Scenario::default()
            },
        ),
    ];
    println!(
        "{:26}{:32}{:>7}{:>7}{:>8}{:>8}{:>7}{:>9}",
        "room", "method", "mean", "p95", "jitter", "missed", "extra", "switches"
    );
    for (room, scenario) in rooms {
        for (method, config) in methods() {
            let scores: Vec<Score> = (1..=seeds)
                .map(|seed| {
                    let scenario = Scenario {
                        seed,
                        ..scenario.clone()
                    };
                    let (world, outcome) = run(&scenario, &config, seconds);
                    score(&world, &outcome.frames, 2.0)
                })
                .collect();
            let mean =
                |f: &dyn Fn(&Score) -> f64| scores.iter().map(f).sum::<f64>() / scores.len() as f64;
            println!(
                "{room:26}{method:32}{:7.1}{:7.1}{:8.1}{:7.2}%{:7.0}{:9.1}",
                mean(&|s| s.mpjpe_m) * 1e3,
                mean(&|s| s.p95_m) * 1e3,
                mean(&|s| s.jitter_mps2),
                mean(&|s| s.missed) * 100.0,
                mean(&|s| s.extra as f64),
                mean(&|s| s.id_switches as f64),
            );
        }
    }
}

fn kalman(look_ahead: usize) -> Config {
    let mut config = Config::default();
    config.fuse.look_ahead = look_ahead;
    config
}

fn methods() -> Vec<(&'static str, Config)> {
    let make = |method, swaps, stages: bool, mode| {
        let mut config = Config::default();
        config.fuse.method = method;
        config.fuse.swaps = swaps;
        config.intake.mode = mode;
        config
            .stages
            .iter_mut()
            .skip(1)
            .for_each(|stage| stage.set_enabled(stages));
        config
    };
    use FuseMethod::{Average, Kalman, Weighted};
    use IntakeMode::{Async, Window};
    vec![
        (
            "average, swaps off, no stages",
            make(Average, false, false, Async),
        ),
        ("average, no stages", make(Average, true, false, Async)),
        (
            "weighted, swaps off, no stages",
            make(Weighted, false, false, Async),
        ),
        ("weighted, no stages", make(Weighted, true, false, Async)),
        ("weighted, all stages", make(Weighted, true, true, Async)),
        ("kalman, no look-ahead", kalman(0)),
        ("kalman (shipped)", kalman(1)),
        ("kalman, 3 frames ahead", kalman(3)),
        ("weighted, window", make(Weighted, true, true, Window)),
    ]
}
