//! The result: tables on the terminal, JSON, a page in a file.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use posefuse_evaluate::{Group, Report, table};

use crate::global::Global;
use crate::output::{self, Style, line, paint};

/// Where the result goes.
#[derive(Debug, Args)]
pub(super) struct ShownArgs {
    /// Write a page with plots, which opens in any browser and needs nothing else
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

/// More groups than this are told of only together.
const MOST_TABLES: usize = 8;

impl ShownArgs {
    /// Shows the result. `together` is printed before the groups of the report, of which it may be the first.
    pub(super) fn show(&self, report: &Report, global: &Global) -> anyhow::Result<()> {
        if let Some(file) = &self.report {
            let shown = file.display();
            std::fs::write(file, report.html())
                .with_context(|| format!("the report cannot be written to `{shown}`"))?;
        }
        if global.json {
            return output::json_pretty(report);
        }
        let tables = if report.groups.len() > MOST_TABLES {
            1
        } else {
            report.groups.len()
        };
        for group in &report.groups[..tables] {
            print_group(report, group)?;
        }
        aims(report)?;
        versus(report)?;
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
    let rows = table::rows(report.columns(), "method", runs);
    for (index, row) in aligned(&rows).into_iter().enumerate() {
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

fn aims(report: &Report) -> anyhow::Result<()> {
    if report.aims.is_empty() {
        return Ok(());
    }
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
    let mut rows = vec![
        ["room", "figure", "measured", "is", "aim", ""]
            .map(str::to_owned)
            .to_vec(),
    ];
    for aim in &report.aims {
        let verdict = match aim.met {
            true => paint(Style::Good, "met"),
            false => paint(Style::Bad, "missed"),
        };
        rows.push(vec![
            aim.room.clone(),
            aim.figure.clone(),
            format!("{} {}", number(aim.measured), aim.unit),
            number(aim.value),
            aim.aim.clone(),
            verdict,
        ]);
    }
    output::print_table(&rows)?;
    let met = report.aims.iter().filter(|aim| aim.met).count();
    line(format!("{met} of {} aims met", report.aims.len()))?;
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
