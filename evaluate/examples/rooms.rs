//! The figures of `posefuse evaluate simulated` without the rest of the program, which is quicker to build.
//!
//! `cargo run --release -p posefuse-evaluate --example rooms -- [seeds] [seconds] [rooms] [methods] [harsh|mild]`, for example
//! `-- 3 20 ring4,arc2 menard,kalman`. Calibrations are perfect.

use std::sync::Arc;

use posefuse_evaluate::suite::{Setting, Suite};
use posefuse_evaluate::{preset, table};
use posefuse_simulator::World;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, usual: &str| {
        arguments
            .get(index)
            .cloned()
            .unwrap_or_else(|| usual.to_owned())
    };
    let seeds: u64 = argument(0, "3").parse()?;
    let names = argument(2, "ring4,arc2");
    let harsh = argument(4, "harsh") == "harsh";
    let settings = names.split(',').map(|name| {
        let setting = Setting::named(name)?;
        Some(if harsh { setting } else { setting.mild() })
    });
    let methods = argument(3, "mean,menard,weighted,kalman-0,kalman");
    let methods = methods.split(',').map(preset);
    let suite = Suite {
        settings: settings.collect::<Option<_>>().ok_or("no such room")?,
        seeds: (1..=seeds).collect(),
        seconds: argument(1, "20").parse()?,
        skip_s: 2.0,
        methods: methods.collect::<Option<_>>().ok_or("no such method")?,
        calibrate: &|world: &Arc<World>| Ok(posefuse_evaluate::perfect_calibration(world)),
        threads: 1,
    };
    let cells = suite.run(&|done, all| eprint!("\r{done} of {all}"))?;
    eprintln!();
    for group in suite.groups(&cells) {
        println!("{}: {}", group.name, group.note);
        let runs = group.runs.iter().map(|run| (run.method.as_str(), &run.all));
        for row in table::rows(&table::WITH_TRUTH, "method", runs) {
            let cells = row.iter().enumerate();
            let cells = cells.map(|(i, cell)| match i {
                0 => format!("{cell:12}"),
                _ => format!("{cell:>8}"),
            });
            println!("{}", cells.collect::<String>());
        }
    }
    Ok(())
}
