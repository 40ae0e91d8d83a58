//! The files of an export, before any of them is opened.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use posefuse_kinematics::Rig;

use crate::format::Format;
use crate::plan::Plan;
use crate::write::{NEVER_SEEN, Sheet};
use crate::{ExportError, Options, Result};

/// The most files of an export: systems let a process have as few as 256 open (macOS), or 512 (Windows), and the take, the
/// terminal and the program's own need some.
const MOST_FILES: usize = 240;

/// A file to be written.
pub(crate) struct Target<'a> {
    pub(crate) format: Format,
    pub(crate) sheet: Sheet<'a>,
    pub(crate) path: PathBuf,
}

/// The files that an export to `folder` writes.
///
/// # Errors
/// [`ExportError::Nobody`] where there is nothing to write, [`ExportError::TooMany`], [`ExportError::Twice`].
pub(crate) fn targets<'a>(
    plan: &'a Plan,
    rigs: &'a [Option<Rig>],
    options: &Options,
    folder: &Path,
) -> Result<Vec<Target<'a>>> {
    let sheets = sheets(plan, rigs, options);
    if sheets.is_empty() {
        let (take, reason) = (plan.header.name.clone(), NEVER_SEEN.to_owned());
        return Err(ExportError::Nobody { take, reason });
    }
    let target = |(format, sheet): (Format, Sheet<'a>)| Target {
        format,
        path: folder.join(file_name(format, &sheet, options)),
        sheet,
    };
    let targets: Vec<Target> = sheets.into_iter().map(target).collect();
    check(targets.iter().map(|target| target.path.as_path()))?;
    Ok(targets)
}

/// Refuses paths that are too many, or not all different.
fn check<'p>(paths: impl ExactSizeIterator<Item = &'p Path>) -> Result<()> {
    let (files, most) = (paths.len(), MOST_FILES);
    if files > most {
        return Err(ExportError::TooMany { files, most });
    }
    let mut known = BTreeSet::new();
    for path in paths {
        if !known.insert(path) {
            return Err(ExportError::Twice(path.to_owned()));
        }
    }
    Ok(())
}

/// What goes into which file.
fn sheets<'a>(
    plan: &'a Plan,
    rigs: &'a [Option<Rig>],
    options: &Options,
) -> Vec<(Format, Sheet<'a>)> {
    let sheet = |format: Format, people: Vec<usize>| {
        let (mut first, mut last) = plan.frames();
        if !options.whole && format.is_one_person() {
            let presence = &plan.people[people[0]];
            (first, last) = (presence.first, presence.last);
        }
        let (space, names) = (options.space(format), options.names());
        (
            format,
            Sheet {
                plan,
                rigs,
                people,
                first,
                last,
                space,
                names,
            },
        )
    };
    let mut sheets = Vec::new();
    for format in options.formats() {
        let with_rig = |person: &usize| !format.is_rig() || rigs[*person].is_some();
        let people: Vec<usize> = (0..plan.people.len()).filter(with_rig).collect();
        if people.is_empty() {
            continue;
        }
        if format.is_one_person() {
            sheets.extend(people.into_iter().map(|person| sheet(format, vec![person])));
        } else {
            sheets.push(sheet(format, people));
        }
    }
    sheets
}

/// The take, whose word it is if not the fused people's, the person where there is one, and the ending.
fn file_name(format: Format, sheet: &Sheet, options: &Options) -> String {
    let take = &sheet.plan.header.name;
    let ending = format.ending();
    match (format.is_one_person(), options.source) {
        (true, _) => format!("{take}-{}{ending}", sheet.plan.people[sheet.people[0]].who),
        (false, crate::Source::Fused) => format!("{take}{ending}"),
        (false, source) => format!("{take}-{source}{ending}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_files_of_an_export_are_one() {
        let paths = ["out/a.csv", "out/b.csv", "out/a.csv"].map(Path::new);
        check(paths[..2].iter().copied()).unwrap();
        let twice = check(paths.into_iter()).unwrap_err();
        assert!(matches!(&twice, ExportError::Twice(path) if path == paths[0]));
        assert!(twice.to_string().contains("--person"), "{twice}");
    }
}
