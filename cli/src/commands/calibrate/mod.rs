//! `posefuse calibrate`: where the sensors stand, from a walk that happens now or from one in a take.

mod ask;
mod coverage;
mod from_take;
pub(crate) mod live;
pub(crate) mod verdict;

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::Args;

use crate::failure::Outcome;
use crate::global::Global;
use crate::room::ServerOption;
use crate::takes_folder::TakesFolder;
use crate::values;

/// Find out where the sensors stand: one person walks about where the sensors' views overlap
///
/// The walk ends by itself when every sensor has seen enough, after two minutes at the latest. Then comes a verdict,
/// `passed`, `weak` or `failed`, with its reasons. At a terminal you are asked whether to put it in force; elsewhere it
/// is, unless it failed. Earlier calibrations are kept: `posefuse calibrations`.
#[derive(Debug, Args)]
pub(crate) struct CalibrateArgs {
    /// Watch the walk for so long, instead of until enough was seen
    #[arg(long, value_name = "S", value_parser = values::seconds)]
    seconds: Option<f64>,
    /// Place only this sensor anew, by what all sensors saw of late; the others stay where they are
    #[arg(long, value_name = "NAME", conflicts_with_all = ["seconds", "from"])]
    sensor: Option<String>,
    /// Solve and report, but leave the calibration in force as it is
    #[arg(long)]
    dry_run: bool,
    /// Put it in force unless it failed, without asking
    #[arg(long, short, conflicts_with = "dry_run")]
    yes: bool,
    #[command(flatten)]
    server: ServerOption,
    /// Use the walk in this take instead, without a server: its name or file
    #[arg(long, value_name = "TAKE", conflicts_with_all = ["dry_run", "yes"])]
    from: Option<PathBuf>,
    /// With --from: write the calibration to this file
    #[arg(long, value_name = "FILE", requires = "from")]
    out: Option<PathBuf>,
    #[command(flatten)]
    takes: TakesFolder,
}

pub(crate) fn run(args: &CalibrateArgs, global: &Global) -> anyhow::Result<Outcome> {
    if let Some(take) = &args.from {
        return from_take::run(take, args.out.as_deref(), &args.takes, global);
    }
    let at_terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let wish = live::Wish {
        seconds: args.seconds,
        sensor: args.sensor.clone(),
        dry_run: args.dry_run,
        ask: at_terminal && !args.yes && !args.dry_run && !global.json,
    };
    super::block_on(live::run(&args.server.server, wish, global))
}
