//! What every comparison takes, and its result: tables on the terminal, JSON, a page in a file.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use posefuse_evaluate::aims::{Aim, Matrix, in_matrix, matrix};
use posefuse_evaluate::kinematics::{self, BodiesReport};
use posefuse_evaluate::repair::{self, FIGURES, RepairReport, Tests};
use posefuse_evaluate::{Group, Report, table};
use serde::Serialize;

use super::methods::MethodArgs;
use crate::global::Global;
use crate::output::{self, Style, line, paint};
use crate::values;

/// How methods are compared.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// How much is left out at the start, while clocks are mapped and people are found
    #[arg(long, value_name = "S", default_value = "2", value_parser = values::seconds)]
    pub(super) skip: f64,
    #[command(flatten)]
    pub(super) methods: MethodArgs,
    #[command(flatten)]
    pub(super) work: WorkArgs,
}

/// How it is worked through, and where the result goes.
#[derive(Debug, Args)]
pub(super) struct WorkArgs {
    /// How many things are worked on at once [default: one for each core]
    #[arg(long, value_name = "N", value_parser = values::whole(1usize, 256))]
    threads: Option<usize>,
    /// Write a page with plots, which opens in any browser and needs nothing else
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

/// More groups than this are told of only together.
const MOST_TABLES: usize = 8;

impl WorkArgs {
    /// How many things are worked on at once.
    pub(super) fn threads(&self) -> usize {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        self.threads.unwrap_or_else(cores)
    }

    /// Shows how methods compare.
    pub(super) fn show(&self, report: &Report, global: &Global) -> anyhow::Result<()> {
        self.give(
            report,
            global,
            || report.html(),
            || {
                let tables = match report.groups.len() > MOST_TABLES {
                    true => 1,
                    false => report.groups.len(),
                };
                for group in &report.groups[..tables] {
                    print_group(report, group)?;
                }
                aims(&report.aims)?;
                versus(report)
            },
        )
    }

    /// Shows how occlusion models compare.
    pub(super) fn show_repair(&self, report: &RepairReport, global: &Global) -> anyhow::Result<()> {
        self.give(
            report,
            global,
            || report.html(),
            || {
                for tests in Tests::ALL {
                    line(paint(Style::Bold, tests.name()))?;
                    for figure in &FIGURES {
                        print_rows(&repair::rows(report, tests, figure))?;
                    }
                }
                aims(&report.aims)
            },
        )
    }

    /// Shows how ways to make bodies compare.
    pub(super) fn show_bodies(&self, report: &BodiesReport, global: &Global) -> anyhow::Result<()> {
        self.give(
            report,
            global,
            || report.html(),
            || {
                for room in &report.rooms {
                    line(paint(Style::Bold, &room.name))?;
                    print_rows(&kinematics::rows(room))?;
                    print_rows(&kinematics::menard_rows(room))?;
                }
                aims(&report.aims)
            },
        )
    }

    /// Writes the page if one is wanted, then JSON or what `tables` prints.
    fn give(
        &self,
        report: &impl Serialize,
        global: &Global,
        page: impl FnOnce() -> String,
        tables: impl FnOnce() -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        if let Some(file) = &self.report {
            let shown = file.display();
            std::fs::write(file, page())
                .with_context(|| format!("the report cannot be written to `{shown}`"))?;
        }
        if global.json {
            return output::json_pretty(report);
        }
        tables()?;
        if let Some(file) = &self.report {
            line(format!("report: {}", file.display()))?;
        }
        Ok(())
    }
}

fn print_group(report: &Report, group: &Group) -> anyhow::Result<()> {
    let note = match group.note.is_empty() {
        true => String::new(),
        false => format!(": {}", group.note),
    };
    line(format!("{}{note}", paint(Style::Bold, &group.name)))?;
    let runs = group.runs.iter().map(|run| (run.method.as_str(), &run.all));
    print_rows(&table::rows(report.columns(), "method", runs))?;
    let repaired = group.runs.iter().filter(|run| run.all.repair.is_some());
    let mut repaired = repaired
        .map(|run| (run.method.as_str(), &run.all))
        .peekable();
    match repaired.peek().is_some() {
        true => print_rows(&table::rows(&table::REPAIR, "repair", repaired)),
        false => Ok(()),
    }
}

/// A table whose first two rows are headings.
fn print_rows(rows: &[Vec<String>]) -> anyhow::Result<()> {
    for (index, row) in aligned(rows).into_iter().enumerate() {
        line(match index {
            0 => paint(Style::Bold, &row),
            1 => paint(Style::Faint, &row),
            _ => row,
        })?;
    }
    line("")?;
    Ok(())
}

/// First column to the left, all others to the right.
fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let row = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate();
        let cells = cells.map(|(column, (cell, width))| match column {
            0 => format!("{cell:width$}"),
            _ => format!("{cell:>width$}"),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(row).collect()
}

/// One row for each figure, one column for each room.
fn aims(aims: &[Aim]) -> anyhow::Result<()> {
    if aims.is_empty() {
        return Ok(());
    }
    let Matrix { rooms, rows } = matrix(aims);
    let headings = ["figure", "aim"].into_iter().chain(rooms.iter().copied());
    let mut table = vec![headings.map(str::to_owned).collect::<Vec<_>>()];
    for row in rows {
        let cell = |room: &&str| {
            let Some(aim) = in_matrix(aims, room, row) else {
                return "-".to_owned();
            };
            let value = aim
                .value
                .map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
            match aim.met {
                true => paint(Style::Good, &format!("{value} met")),
                false => paint(Style::Bad, &format!("{value} missed")),
            }
        };
        let cells = rooms.iter().map(cell);
        table.push(
            [row.0.to_owned(), row.1.to_owned()]
                .into_iter()
                .chain(cells)
                .collect(),
        );
    }
    output::print_table(&table)?;
    let met = aims.iter().filter(|aim| aim.met).count();
    line(format!("{met} of {} aims met", aims.len()))?;
    Ok(())
}

fn versus(report: &Report) -> anyhow::Result<()> {
    for versus in &report.versus {
        line(versus.told())?;
        for (take, worse) in &versus.others {
            let worse = match worse.is_empty() {
                true => "equal".to_owned(),
                false => format!("worse: {}", worse.join(", ")),
            };
            line(format!("     {take}  {worse}"))?;
        }
    }
    Ok(())
}
