//! The `posefuse` program: every journey of a user as one subcommand. Subcommands are thin; the crates do the work.
//!
//! Results go to stdout, diagnostics and progress to stderr. Exit codes: 0 done, 1 failed, 2 wrong usage or
//! configuration, 3 done with loss.

mod args;
mod children;
mod commands;
mod failure;
mod global;
mod logging;
mod offline;
mod output;
mod paths;
mod progress;
mod repair;
mod room;
mod shutdown;
mod takes_folder;
mod values;
mod views;

use std::process::ExitCode;

use clap::Parser;

use crate::args::Cli;

fn main() -> ExitCode {
    let cli = Cli::parse();
    output::init(&cli.global);
    logging::init(&cli.global, cli.command.default_log_level());
    let result = commands::run(cli);
    let code = match result {
        Ok(outcome) => outcome.code(),
        Err(error) => failure::report(&error),
    };
    ExitCode::from(code)
}
