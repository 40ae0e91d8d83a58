//! `posefuse doctor`: what is wrong with this machine or this room, each with a remedy.

mod depth;
mod files;
mod machine;
mod models;
mod room;

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{self, Style, line, paint};
use crate::room::ServerOption;
use crate::takes_folder::TakesFolder;

/// Say what is wrong with this machine or room, and what to do about it
#[derive(Debug, Args)]
pub(crate) struct DoctorArgs {
    #[command(flatten)]
    server: ServerOption,
    /// The server's configuration file [default: ~/.config/posefuse/server.toml, if it is there]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    takes: TakesFolder,
}

/// How grave a finding is. The order is from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Grade {
    /// As it should be.
    Good,
    /// Could not be looked at here, or does not matter yet.
    Unknown,
    /// Works, but will not work well.
    Doubtful,
    /// Does not work.
    Bad,
}

/// One thing that was looked at.
#[derive(Clone, Debug, Serialize)]
struct Finding {
    /// What was looked at.
    what: String,
    grade: Grade,
    /// What was found.
    found: String,
    /// What to do; empty when there is nothing to do.
    remedy: String,
}

impl Finding {
    fn good(what: impl Into<String>, found: impl Into<String>) -> Self {
        Self::new(Grade::Good, what, found, "")
    }

    fn unknown(what: impl Into<String>, found: impl Into<String>) -> Self {
        Self::new(Grade::Unknown, what, found, "")
    }

    fn doubtful(
        what: impl Into<String>,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::new(Grade::Doubtful, what, found, remedy)
    }

    fn bad(what: impl Into<String>, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(Grade::Bad, what, found, remedy)
    }

    fn new(
        grade: Grade,
        what: impl Into<String>,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            what: what.into(),
            grade,
            found: found.into(),
            remedy: remedy.into(),
        }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct DoctorView<'a> {
    version: &'static str,
    worst: Grade,
    findings: &'a [Finding],
}

pub(crate) async fn run(args: &DoctorArgs, global: &Global) -> anyhow::Result<Outcome> {
    let mut findings = machine::examine();
    findings.extend(depth::examine());
    let (room, calibration) = room::examine(&args.server.server).await;
    let (of_files, config) = files::examine(args.config.as_deref(), &args.takes, calibration);
    findings.extend(of_files);
    findings.extend(models::examine(&config.models));
    findings.extend(room);
    let worst = findings
        .iter()
        .map(|finding| finding.grade)
        .max()
        .unwrap_or(Grade::Good);
    if global.json {
        output::json_pretty(&DoctorView {
            version: env!("CARGO_PKG_VERSION"),
            worst,
            findings: &findings,
        })?;
    } else {
        print(&findings)?;
    }
    Ok(if worst == Grade::Bad {
        Outcome::Failed
    } else {
        Outcome::Done
    })
}

fn print(findings: &[Finding]) -> anyhow::Result<()> {
    let rows: Vec<Vec<String>> = findings
        .iter()
        .map(|finding| {
            vec![
                mark(finding.grade),
                finding.what.clone(),
                finding.found.clone(),
            ]
        })
        .collect();
    for (row, finding) in output::table(&rows).iter().zip(findings) {
        line(row)?;
        if !finding.remedy.is_empty() {
            line(format!("          {}", paint(Style::Bold, &finding.remedy)))?;
        }
    }
    let count = |grade| {
        findings
            .iter()
            .filter(|finding| finding.grade == grade)
            .count()
    };
    let (bad, doubtful) = (count(Grade::Bad), count(Grade::Doubtful));
    line(match (bad, doubtful) {
        (0, 0) => "\nnothing is wrong".to_owned(),
        (0, n) => format!("\nnothing is broken, {n} to look at"),
        (n, m) => format!("\n{n} broken, {m} to look at"),
    })?;
    Ok(())
}

fn mark(grade: Grade) -> String {
    match grade {
        Grade::Good => paint(Style::Good, "ok"),
        Grade::Unknown => paint(Style::Faint, "--"),
        Grade::Doubtful => paint(Style::Doubtful, "look at"),
        Grade::Bad => paint(Style::Bad, "broken"),
    }
}
