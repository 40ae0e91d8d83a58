//! `posefuse completions`: what a shell sources to complete `posefuse`.

use std::io::{self, Write};

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::args::Cli;
use crate::failure::Outcome;

/// Print shell completions, e.g. `posefuse completions bash > ~/.local/share/bash-completion/completions/posefuse`
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell they are for
    shell: Shell,
}

pub(crate) fn run(args: &CompletionsArgs) -> anyhow::Result<Outcome> {
    // The generator panics where it cannot write: it writes to memory, we to stdout.
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "posefuse", &mut script);
    io::stdout().write_all(&script)?;
    Ok(Outcome::Done)
}
