//! Chores of the project: `cargo xtask generate | tidy`.

mod generate;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(about = "Chores of the project")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Subcommand)]
enum Chore {
    /// Generate `proto/src/generated` from the .proto files; needs no system protoc.
    Generate {
        /// Change nothing; fail if the checked-in code differs.
        #[arg(long)]
        check: bool,
    },
}

fn main() -> Result<()> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    match Arguments::parse().chore {
        Chore::Generate { check } => generate::run(&root, check),
    }
}
