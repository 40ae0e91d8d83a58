//! The subcommands, one file each, and the runtimes they run on.

pub(crate) mod agent;
pub(crate) mod calibrate;
pub(crate) mod calibrations;
pub(crate) mod completions;
pub(crate) mod demo;
pub(crate) mod devices;
pub(crate) mod doctor;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod record;
pub(crate) mod refuse;
pub(crate) mod server;
pub(crate) mod simulate;
pub(crate) mod sinks;
pub(crate) mod takes;
pub(crate) mod watch;

use std::future::Future;

use anyhow::Context;

use crate::args::{Cli, Command};
use crate::failure::Outcome;

/// Runs what the command line says.
pub(crate) fn run(cli: Cli) -> anyhow::Result<Outcome> {
    let global = &cli.global;
    match cli.command {
        Command::Demo(args) => block_on(demo::run(&args, global)),
        Command::Server(args) => server::run(&args, global),
        Command::Agent(args) => block_on(agent::run(&args, global)),
        Command::Devices(args) => devices::run(&args, global),
        Command::Calibrate(args) => calibrate::run(&args, global),
        Command::Calibrations(args) => block_on(calibrations::run(&args, global)),
        Command::Record(args) => block_on(record::run(&args, global)),
        Command::Takes(args) => takes::run(&args, global),
        Command::Refuse(args) => refuse::run(&args, global),
        Command::Export(args) => export::run(&args, global),
        Command::Simulate(args) => simulate::run(&args, global),
        Command::Evaluate(args) => evaluate::run(&args, global),
        Command::Sinks(args) => block_on(sinks::run(&args, global)),
        Command::Watch(args) => block_on(watch::run(&args, global)),
        Command::Doctor(args) => block_on(doctor::run(&args, global)),
        Command::Completions(args) => completions::run(&args),
    }
}

/// Runs a command that mostly waits, on this thread. Threads that still block on a read do not hold the end up.
pub(crate) fn block_on<T>(command: impl Future<Output = anyhow::Result<T>>) -> anyhow::Result<T> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("cannot start the asynchronous runtime")?;
    let result = runtime.block_on(command);
    runtime.shutdown_background();
    result
}
