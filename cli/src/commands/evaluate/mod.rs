//! `posefuse evaluate`: how good fused people are, methods side by side.

mod bodies;
mod bodytrack;
mod csv;
mod material;
mod methods;
mod models;
mod repair;
mod shown;
mod simulated;
mod takes;

use clap::{Args, Subcommand};
use posefuse_evaluate::PRESETS;

use crate::failure::Outcome;
use crate::global::Global;
use crate::output;

/// Say how good fused people are: methods side by side, on simulated rooms, takes or recordings; and what is made up
#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    #[command(subcommand)]
    on: On,
}

/// What to fuse.
#[derive(Debug, Subcommand)]
enum On {
    /// Simulated rooms, where the truth is known
    Simulated(simulated::SimulatedArgs),
    /// Takes: against their truth if they are simulated, else each sensor against all others
    Takes(takes::TakesArgs),
    /// Recordings of two Kinects v2 (CSV), calibrated from themselves
    Csv(csv::CsvArgs),
    /// Occlusion models: how well they fill in joints that no sensor saw
    Repair(repair::RepairArgs),
    /// Bodies made of fused people: what ships and each of its functions off
    Bodies(bodies::BodiesArgs),
    /// The body tracker for depth sensors, on rendered depth
    Bodytrack(bodytrack::BodytrackArgs),
    /// List the methods that have a name
    Methods,
}

pub(crate) fn run(args: &EvaluateArgs, global: &Global) -> anyhow::Result<Outcome> {
    match &args.on {
        On::Simulated(args) => simulated::run(args, global),
        On::Takes(args) => takes::run(args, global),
        On::Csv(args) => csv::run(args, global),
        On::Repair(args) => repair::run(args, global),
        On::Bodies(args) => bodies::run(args, global),
        On::Bodytrack(args) => bodytrack::run(args, global),
        On::Methods => list_methods(global),
    }
}

fn list_methods(global: &Global) -> anyhow::Result<Outcome> {
    if global.json {
        let methods: std::collections::BTreeMap<_, _> = PRESETS.into_iter().collect();
        output::json_pretty(&methods)?;
    } else {
        let rows = PRESETS.map(|(name, about)| vec![name.to_owned(), about.to_owned()]);
        output::print_table(&rows)?;
    }
    Ok(Outcome::Done)
}
