//! A calibration from the walk in a take, without a server.

use std::path::Path;

use anyhow::Context;
use posefuse_calibration::{Options, solve, to_toml};

use super::verdict;
use crate::failure::Outcome;
use crate::global::Global;
use crate::offline::{now_rfc3339, walk_of};
use crate::takes_folder::TakesFolder;
use crate::views::CalibrationView;
use crate::{output, progress};

pub(super) fn run(
    take: &Path,
    out: Option<&Path>,
    takes: &TakesFolder,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let located = takes.find(take)?;
    let reader = located.open()?;
    let working = progress::spinner("reading");
    let walk = walk_of(&reader)?;
    working.set_message("solving");
    let options = Options {
        created: now_rfc3339(),
        ..Options::default()
    };
    let solution = solve(&walk, &options);
    working.finish_and_clear();
    let solution = solution.with_context(|| format!("the walk in take `{}`", located.name))?;
    let mut view = CalibrationView::of_solution(&solution);
    if let Some(out) = out
        && view.verdict != "failed"
    {
        std::fs::write(out, to_toml(&solution.calibration))
            .with_context(|| format!("the calibration cannot be written to `{}`", out.display()))?;
        view.file = Some(out.display().to_string());
    }
    if global.json {
        output::json_pretty(&view)?;
    } else {
        verdict::print(&view)?;
        match (&view.file, out) {
            (Some(file), _) => output::line(format!(
                "written to {file}; fuse the take with it: posefuse refuse {} --calibration {file}",
                located.name
            ))?,
            (None, Some(_)) => output::note("a failed calibration is not written"),
            (None, None) => output::note("--out FILE would write it to a file"),
        }
    }
    Ok(verdict::outcome(&view))
}
