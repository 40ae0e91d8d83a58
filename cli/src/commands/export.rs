//! `posefuse export`: takes as files that other tools read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use posefuse_export::{
    Axes, Format, Names, Options, PersonReport, Phase, Preset, Progress, Report, Source, Unit,
};
use posefuse_fusion::parse_toml;
use posefuse_kinematics::{Config, LookAt};
use posefuse_session::{Catalogue, DiskStorage, TakeState};
use serde::Serialize;

use crate::failure::{Outcome, in_words, usage};
use crate::global::Global;
use crate::output::{Style, bytes, line, paint};
use crate::takes_folder::{Located, TakesFolder};
use crate::{output, progress};

/// Write takes as files that other tools read: Blender, Unity, Unreal, MotionBuilder, OpenSim, tables and more
///
/// Say for which tool with --preset, or which kind of file with --format. Files get the take's name, the person's where
/// each person has their own file, and the format's ending.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// The takes: names, files, or folders with takes
    #[arg(required = true, value_name = "TAKE")]
    take: Vec<PathBuf>,
    /// The tool: blender, unity, unreal, motionbuilder, opensim, mixamo or kinect
    #[arg(short, long, value_name = "TOOL")]
    preset: Option<Preset>,
    /// The kinds of files: csv, csv-tidy, csv-bones, parquet, trc, c3d, bvh, glb, fbx [default: the preset's]
    #[arg(short, long, value_name = "FORMAT", value_delimiter = ',')]
    format: Vec<Format>,
    /// The folder to write to
    #[arg(short, long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    /// Write over files that are there
    #[arg(long)]
    force: bool,
    /// Only these people, by their numbers [default: all]
    #[arg(long, value_name = "NUMBER", value_delimiter = ',')]
    person: Vec<u64>,
    /// Begin so many seconds after the take's start
    #[arg(long, value_name = "SECONDS")]
    from: Option<f64>,
    /// End so many seconds after the take's start
    #[arg(long, value_name = "SECONDS")]
    to: Option<f64>,
    /// Frames per second [default: the preset's, else the take's own]
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Whose word: fused people, sensors' bodies before fusion, or the truth of simulated people
    #[arg(long, value_name = "SOURCE", default_value = "fused")]
    source: Source,
    /// Which way axes point: room, y-up, opensim, blender, unity or unreal [default: the tool's]
    #[arg(long, value_name = "AXES")]
    axes: Option<Axes>,
    /// What lengths are counted in: m, cm or mm [default: the tool's]
    #[arg(long, value_name = "UNIT")]
    unit: Option<Unit>,
    /// What bones are called: humanoid, motionbuilder, mixamo, unreal or kinect [default: the tool's]
    #[arg(long, value_name = "NAMES")]
    names: Option<Names>,
    /// How rigs are moved: a TOML file with keys of `[fit]`, `[limits]`, `[feet]`, `[look]`, `[hands]` and so on; `docs/KINEMATICS.md`
    /// says what they are
    #[arg(long, value_name = "FILE.toml")]
    bodies: Option<PathBuf>,
    /// Where heads look: off, hands, near, far or auto [default: as --bodies says, else off]
    #[arg(long, value_name = "WHERE")]
    look: Option<Look>,
    /// Leave joints that no sensor measured with trust out of tables, TRC and C3D; rigs need all
    #[arg(long)]
    only_measured: bool,
    /// Let every file go from the first person's first frame to the last one's last, so that several people line up
    #[arg(long)]
    whole: bool,
    /// The longest gap in seconds that is filled by interpolating
    #[arg(long, value_name = "SECONDS", default_value_t = 0.2)]
    max_gap: f64,
    /// Leave out who was there for fewer seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    least: f64,
    #[command(flatten)]
    takes: TakesFolder,
}

/// Where heads look.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Look {
    /// As the chest does.
    Off,
    /// At the hands.
    Hands,
    /// One step ahead, on the floor.
    Near,
    /// Far ahead.
    Far,
    /// At raised hands, near where the person stands, far where they walk.
    Auto,
}

impl From<Look> for LookAt {
    fn from(look: Look) -> Self {
        match look {
            Look::Off => Self::Off,
            Look::Hands => Self::Hands,
            Look::Near => Self::Near,
            Look::Far => Self::Far,
            Look::Auto => Self::Auto,
        }
    }
}

/// What `--json` prints for each take.
#[derive(Serialize)]
#[serde(untagged)]
enum TakeExport {
    Made(Box<Report>),
    Failed { take: String, error: String },
}

pub(crate) fn run(args: &ExportArgs, global: &Global) -> anyhow::Result<Outcome> {
    let options = args.options()?;
    options.check().map_err(usage)?;
    let takes = args.located()?;
    no_name_twice(&takes)?;
    let mut results = Vec::with_capacity(takes.len());
    for (number, take) in takes.iter().enumerate() {
        let made = args.export(take, &options, (number, takes.len()));
        let result = match made {
            Ok(report) => {
                if !global.json {
                    tell(&report)?;
                }
                TakeExport::Made(Box::new(report))
            }
            Err(error) if takes.len() == 1 => return Err(error),
            Err(error) => {
                let error = in_words(&error);
                if !global.json {
                    output::error(&error);
                }
                let take = take.name.clone();
                TakeExport::Failed { take, error }
            }
        };
        results.push(result);
    }
    if global.json {
        output::json_pretty(&results)?;
    }
    let failed = |result: &&TakeExport| matches!(result, TakeExport::Failed { .. });
    let failures = results.iter().filter(failed).count();
    Ok(match failures {
        0 => Outcome::Done,
        some if some < results.len() => Outcome::DoneWithLoss,
        _ => Outcome::Failed,
    })
}

impl ExportArgs {
    fn options(&self) -> anyhow::Result<Options> {
        let usual = self.preset.map(Options::of_preset).unwrap_or_default();
        Ok(Options {
            bodies: self.bodies()?,
            formats: self.format.clone(),
            source: self.source,
            people: self.person.clone(),
            from_s: self.from,
            to_s: self.to,
            rate_hz: self.rate.or(usual.rate_hz),
            max_gap_s: self.max_gap,
            least_s: self.least,
            axes: self.axes,
            unit: self.unit,
            names: self.names,
            only_measured: self.only_measured,
            whole: self.whole,
            ..usual
        })
    }

    fn bodies(&self) -> anyhow::Result<Config> {
        let mut bodies = match &self.bodies {
            Some(file) => {
                let shown = file.display();
                let text = std::fs::read_to_string(file).with_context(|| format!("`{shown}`"))?;
                let refused = |error: String| usage(format!("the bodies in `{shown}`: {error}"));
                let bodies: Config = parse_toml(&text).map_err(|e| refused(e.to_string()))?;
                bodies.validate().map_err(|e| refused(e.to_string()))?;
                bodies
            }
            None => Config::default(),
        };
        if let Some(look) = self.look {
            bodies.look.at = look.into();
        }
        Ok(bodies)
    }

    /// Every take that was named, those of folders in order of their names.
    fn located(&self) -> anyhow::Result<Vec<Located>> {
        let mut takes = Vec::new();
        for path in &self.take {
            if path.is_dir() {
                takes.extend(takes_of(path)?);
            } else {
                takes.push(self.takes.find(path)?);
            }
        }
        Ok(takes)
    }

    fn export(
        &self,
        take: &Located,
        options: &Options,
        (number, of): (usize, usize),
    ) -> anyhow::Result<Report> {
        let reader = take.open()?;
        let what = match of {
            1 => "exporting".to_owned(),
            of => format!("export {}/{of}", number + 1),
        };
        let bar = progress::bar(1, &what);
        bar.set_message(take.name.clone());
        let mut show = |progress: Progress| {
            bar.set_length((2 * progress.total).max(1));
            bar.set_position(match progress.phase {
                Phase::Looking => progress.done,
                Phase::Writing => progress.total + progress.done,
            });
        };
        let report = posefuse_export::export(&reader, options, &self.out, self.force, &mut show);
        bar.finish_and_clear();
        Ok(report?)
    }
}

/// Refuses takes of the same name: the files of the one would take the place of the other's.
fn no_name_twice(takes: &[Located]) -> anyhow::Result<()> {
    let mut known: BTreeMap<&str, &Located> = BTreeMap::new();
    for take in takes {
        if let Some(other) = known.insert(&take.name, take) {
            let (one, two) = (other.file(), take.file());
            return Err(usage(format!(
                "{} and {} would be exported to files of the same names; export them one after the other, each to its own \
                 folder with --out",
                one.display(),
                two.display()
            )));
        }
    }
    Ok(())
}

/// The takes of a folder; one that is still being recorded is left out.
fn takes_of(folder: &Path) -> anyhow::Result<Vec<Located>> {
    let takes = Catalogue::list(&DiskStorage::for_reading(folder))?;
    let (recording, done): (Vec<_>, Vec<_>) = takes
        .into_iter()
        .partition(|take| take.state == TakeState::Recording);
    for take in recording {
        output::warn(&format!("{} is being recorded and left out", take.name));
    }
    let mut names: Vec<String> = done.into_iter().map(|take| take.name).collect();
    names.sort();
    if names.is_empty() {
        bail!("there are no takes in the folder {}", folder.display());
    }
    let located = |name| Located {
        folder: folder.to_owned(),
        name,
    };
    Ok(names.into_iter().map(located).collect())
}

fn tell(report: &Report) -> anyhow::Result<()> {
    // Not "-0.0".
    let rounded = |seconds: f64| (seconds * 10.0).round() / 10.0 + 0.0;
    let seconds = |person: &PersonReport| {
        let [from, to] = [person.from_s, person.to_s].map(rounded);
        format!("{from:.1} to {to:.1} s")
    };
    let people = report.people.iter();
    let people = people.map(|person| format!("{} ({})", person.person, seconds(person)));
    line(format!(
        "take {}: {}, {} frames per second",
        paint(Style::Bold, &report.take),
        people.collect::<Vec<_>>().join(", "),
        report.rate_hz,
    ))?;
    for file in &report.files {
        line(format!(
            "     {} ({}, {} frames)",
            file.path.display(),
            bytes(file.bytes),
            file.frames
        ))?;
    }
    for person in report
        .people
        .iter()
        .filter(|person| person.frames_without > 0)
    {
        output::warn(&format!(
            "{} is not seen in {} of {} frames: joints are missing there, rigs keep their pose",
            person.person, person.frames_without, person.frames
        ));
    }
    for number in &report.absent {
        output::warn(&format!("nobody of number {number} is in what is exported"));
    }
    for person in &report.without_rig {
        output::warn(&format!(
            "{person} is in no file with a rig: their trunk is never seen in what is exported"
        ));
    }
    if report.passers_by > 0 {
        output::note(format!(
            "{} more were there for too short to be exported (--least)",
            report.passers_by
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::failure::Usage;

    #[test]
    fn takes_of_the_same_name_are_refused_before_anything_is_written() {
        let take = |folder: &str, name: &str| Located {
            folder: folder.into(),
            name: name.to_owned(),
        };
        no_name_twice(&[take("monday", "walk"), take("monday", "run")]).unwrap();
        let same = [take("monday", "walk"), take("tuesday", "walk")];
        let refusal = no_name_twice(&same).unwrap_err();
        assert!(refusal.is::<Usage>(), "exit code 2");
        let text = refusal.to_string();
        let files = same.map(|take| take.file().display().to_string());
        assert!(files.iter().all(|file| text.contains(file)), "{text}");
        assert!(text.contains("--out"), "{text}");
    }
}
