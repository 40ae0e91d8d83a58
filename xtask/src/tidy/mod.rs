//! Checks that keep the architecture what `docs/ARCHITECTURE.md` says. Each prints what it found and where.

mod dependencies;
mod sources;

use std::path::Path;

use anyhow::{Result, bail};

/// Runs every check; fails with all findings.
pub(crate) fn run(root: &Path) -> Result<()> {
    let mut findings = dependencies::check(root)?;
    findings.extend(sources::check(root)?);
    if findings.is_empty() {
        println!("tidy: nothing found");
        return Ok(());
    }
    findings
        .iter()
        .for_each(|finding| eprintln!("tidy: {finding}"));
    bail!("{} findings", findings.len())
}
