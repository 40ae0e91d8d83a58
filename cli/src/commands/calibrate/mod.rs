//! `posefuse calibrate`: where the sensors stand, from a walk that happens now or from one in a take.

mod from_take;
pub(crate) mod live;
pub(crate) mod verdict;

use std::path::PathBuf;

use clap::Args;

use crate::failure::Outcome;
use crate::global::Global;
use crate::room::ServerOption;
use crate::takes_folder::TakesFolder;
use crate::values;

/// Find out where the sensors stand: one person walks about where the sensors' views overlap
#[derive(Debug, Args)]
pub(crate) struct CalibrateArgs {
    /// How long to watch the walk
    #[arg(long, value_name = "S", default_value = "30", value_parser = values::seconds)]
    seconds: f64,
    /// Solve and report, but leave the calibration in force as it is
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    server: ServerOption,
    /// Use the walk in this take instead, without a server: its name or file
    #[arg(long, value_name = "TAKE", conflicts_with = "dry_run")]
    from: Option<PathBuf>,
    /// With --from: write the calibration to this file
    #[arg(long, value_name = "FILE", requires = "from")]
    out: Option<PathBuf>,
    #[command(flatten)]
    takes: TakesFolder,
}

pub(crate) fn run(args: &CalibrateArgs, global: &Global) -> anyhow::Result<Outcome> {
    match &args.from {
        Some(take) => from_take::run(take, args.out.as_deref(), &args.takes, global),
        None => super::block_on(live::run(
            &args.server.server,
            args.seconds,
            args.dry_run,
            global,
        )),
    }
}
