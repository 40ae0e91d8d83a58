//! What `posefuse-kinematics` makes of fused people, against the truth:
//! `cargo run --release -p posefuse-evaluate --example bodies -- [seeds] [seconds] [rooms] [method] [variants]`, for example
//! `-- 3 60 ring4,arc2 kalman fused,ships`. Calibrations are perfect. `-` stands for the usual. A sixth argument is a TOML file
//! of more variants: each table a configuration of the solver, by the table's name.

use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_evaluate::kinematics::{BodyTally, Fused, Variant, variants};
use posefuse_evaluate::suite::Setting;
use posefuse_evaluate::{Metrics, Tally, perfect_calibration, preset};
use posefuse_kinematics::Config;
use posefuse_simulator::{Scenario, World};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, usual: &str| {
        let given = arguments.get(index).filter(|given| *given != "-");
        given.cloned().unwrap_or_else(|| usual.to_owned())
    };
    let seeds: u64 = argument(0, "3").parse()?;
    let seconds: f64 = argument(1, "60").parse()?;
    let method = preset(&argument(3, "kalman")).ok_or("no such method")?;
    let wanted = argument(4, "");
    let mut variants = variants();
    variants.retain(|v| wanted.is_empty() || wanted.split(',').any(|name| name == v.name));
    let given = arguments.get(5).map(std::fs::read_to_string).transpose()?;
    let given: BTreeMap<String, Config> = toml::from_str(&given.unwrap_or_default())?;
    variants.extend(given.into_iter().map(|(name, config)| Variant {
        name: name.leak(),
        about: "given",
        config: Some(config),
    }));
    for room in argument(2, "ring4,arc2").split(',') {
        let setting = Setting::named(room).ok_or("no such room")?;
        let mut totals = vec![(Tally::default(), BodyTally::default()); variants.len()];
        for seed in 1..=seeds {
            let scenario = Scenario {
                seed,
                ..setting.scenario.clone()
            };
            let world = Arc::new(World::new(&scenario)?);
            let calibration = perfect_calibration(&world);
            let fused = Fused::new(&world, &method, calibration, seconds, 2.0)?;
            for (variant, (tally, body)) in variants.iter().zip(&mut totals) {
                let outcome = fused.judge(variant);
                tally.merge(&outcome.judged.tally);
                body.merge(&outcome.body);
            }
            eprint!("\r{room}: {seed} of {seeds}");
        }
        eprintln!();
        print(
            room,
            &variants.iter().map(|v| v.name).collect::<Vec<_>>(),
            &totals,
        );
    }
    Ok(())
}

fn print(room: &str, names: &[&str], totals: &[(Tally, BodyTally)]) {
    let headings = [
        room, "MPJPE", "ratio", "error", "jitter", "bones", "elbow", "knee", "shoulder", "hip",
        "flips", "skate", "wrist", "nearest", "spikes", "deviat.", "us",
    ];
    let units = [
        "", "mm", "", "mm", "m/s2", "mm", "deg", "deg", "deg", "deg", "/min", "mm/s", "cm", "cm",
        "/min", "/min", "/frame",
    ];
    row(headings.map(str::to_owned));
    row(units.map(str::to_owned));
    let first = totals
        .first()
        .and_then(|(tally, _)| Metrics::from(tally).error.mean_mm);
    for (name, (tally, body)) in names.iter().zip(totals) {
        let (m, b) = (Metrics::from(tally), body.figures());
        let cell = |value: Option<f64>, digits: usize| {
            value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
        };
        let ratio = m.error.mean_mm.zip(first).map(|(mean, first)| mean / first);
        row([
            (*name).to_owned(),
            cell(m.error.mean_mm, 1),
            cell(ratio, 3),
            cell(m.own_error.mean_mm, 1),
            cell(m.jitter_mps2, 1),
            cell(m.bone_sigma_mm, 2),
            cell(b.elbow_deg, 1),
            cell(b.knee_deg, 1),
            cell(b.shoulder_deg, 1),
            cell(b.hip_deg, 1),
            cell(b.flips_per_min, 1),
            cell(b.skate_mm_per_s, 0),
            cell(m.wrist_absolute_cm, 2),
            cell(m.wrist_shortest_cm, 2),
            cell(m.spikes_per_min, 1),
            cell(m.deviations_per_min, 1),
            cell(b.us_per_person_frame, 0),
        ]);
    }
}

fn row<const N: usize>(cells: [String; N]) {
    let cells = cells.iter().enumerate();
    let cells = cells.map(|(index, cell)| match index {
        0 => format!("{cell:14}"),
        _ => format!("{cell:>9}"),
    });
    println!("{}", cells.collect::<String>());
}
