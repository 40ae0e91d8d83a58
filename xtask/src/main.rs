//! Chores of the project: `cargo xtask generate | tidy`.

mod generate;
mod tidy;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(about = "Chores of the project")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Subcommand)]
enum Chore {
    /// Generate the checked-in code from the .proto files; needs no system protoc.
    Generate {
        /// Change nothing; fail if the checked-in code differs.
        #[arg(long)]
        check: bool,
    },
    /// Check the rules of the architecture: who may know whom, what pure crates may not do, file sizes.
    Tidy,
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .context("xtask lies in the workspace")?;
    match Arguments::parse().chore {
        Chore::Generate { check } => generate::run(root, check),
        Chore::Tidy => tidy::run(root),
    }
}
