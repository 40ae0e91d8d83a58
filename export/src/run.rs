//! An export from end to end: two readings of a take, files that appear when they are whole.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use posefuse_session::TakeReader;
use posefuse_skeleton::Timestamp;
use serde::Serialize;

use crate::body::{Learners, Mover};
use crate::format::Format;
use crate::plan::Plan;
use crate::resample::Resampler;
use crate::write::{self, Figure, Moment, Sheet, Sink};
use crate::{ExportError, Options, Result, Who};

/// Which reading of the take it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The first: who is there.
    Looking,
    /// The second: files are written.
    Writing,
}

/// How far an export is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Which reading.
    pub phase: Phase,
    /// Messages of the take that were read in it.
    pub done: u64,
    /// Of so many.
    pub total: u64,
}

/// What an export made.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The take.
    pub take: String,
    /// Civil time of the take's start (UTC), RFC 3339.
    pub started: String,
    /// Frames per second of the files.
    pub rate_hz: f64,
    /// The people, in order.
    pub people: Vec<PersonReport>,
    /// How many more were seen for too short.
    pub passers_by: usize,
    /// The files.
    pub files: Vec<FileReport>,
}

/// A person of an export.
#[derive(Clone, Debug, Serialize)]
pub struct PersonReport {
    /// Who, as in the files.
    pub person: Who,
    /// When they came, seconds since the take's start.
    pub from_s: f64,
    /// When they left.
    pub to_s: f64,
    /// From the one to the other.
    pub frames: u64,
    /// Frames among them in which no joint is known. A rig keeps its pose in them.
    pub frames_without: u64,
    /// The share of joints that are missing in the other frames.
    pub missing_share: f64,
}

/// A file of an export.
#[derive(Clone, Debug, Serialize)]
pub struct FileReport {
    /// Where it is.
    pub path: PathBuf,
    /// What it is.
    pub format: Format,
    /// Whose motion it has.
    pub people: Vec<Who>,
    /// When its first frame is, seconds since the take's start.
    pub from_s: f64,
    /// The same as civil time (UTC), RFC 3339.
    pub from_utc: String,
    /// How many frames it has.
    pub frames: u64,
    /// Its size.
    pub bytes: u64,
}

/// Exports a take into files of `folder`, which is made if it is not there. Files get the take's name, the person's
/// where each has their own, and the format's ending; they appear when they are whole.
///
/// # Errors
/// [`ExportError`]; without `force` also if a file is there already, before anything is written.
pub fn export(
    take: &TakeReader,
    options: &Options,
    folder: &Path,
    force: bool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Report> {
    options.check()?;
    let mut learners = Learners::default();
    let with_rigs = options.needs_rig();
    let mut learn = |who: &Who, skeleton: &_| {
        if with_rigs {
            learners.add(who, skeleton);
        }
    };
    let plan = Plan::of(take, options, &mut learn, progress)?;
    let movers = plan.people.iter().map(|person| learners.mover(&person.who));
    let movers: Vec<Option<Mover>> = movers.collect();
    drop(learners);
    let rigs: Vec<_> = movers
        .iter()
        .map(|mover| mover.as_ref().map(|mover| mover.rig().clone()))
        .collect();
    fs::create_dir_all(folder).map_err(ExportError::write(folder))?;
    let sheets = sheets(&plan, &rigs, options);
    let paths: Vec<PathBuf> = sheets
        .iter()
        .map(|sheet| folder.join(file_name(sheet, options)))
        .collect();
    if let Some(path) = paths.iter().find(|path| !force && path.exists()) {
        return Err(ExportError::Exists(path.clone()));
    }
    let mut files = Vec::with_capacity(sheets.len());
    for ((format, sheet), path) in sheets.into_iter().zip(paths) {
        files.push(Draft::open(format, sheet, path)?);
    }
    let mut writing = Writing {
        plan: &plan,
        options,
        movers,
        files,
        people: tallies(&plan),
    };
    writing.run(take, progress)?;
    let Writing { files, people, .. } = writing;
    let mut reports = Vec::with_capacity(files.len());
    for file in files {
        reports.push(file.finish(&plan)?);
    }
    Ok(Report {
        take: plan.header.name.clone(),
        started: plan.header.started.clone(),
        rate_hz: plan.grid.rate_hz,
        people: people
            .iter()
            .zip(&plan.people)
            .map(|(tally, person)| tally.report(&plan, person))
            .collect(),
        passers_by: plan.passers_by,
        files: reports,
    })
}

/// What the second reading works with.
struct Writing<'a> {
    plan: &'a Plan,
    options: &'a Options,
    movers: Vec<Option<Mover>>,
    files: Vec<Draft<'a>>,
    people: Vec<Tally>,
}

impl Writing<'_> {
    fn run(&mut self, take: &TakeReader, progress: &mut dyn FnMut(Progress)) -> Result<()> {
        let source = self.options.source;
        let max_gap_ns = (self.options.max_gap_s * 1e9) as i64;
        // When a frame this much later has come, nothing that matters to an instant can come any more.
        let patience_ns = max_gap_ns.saturating_add(source.disorder_ns());
        let mut resampler = Resampler::new(max_gap_ns);
        let (mut frame, last) = self.plan.frames();
        let total = source.messages(take);
        let mut newest: Option<Timestamp> = None;
        for (done, seen) in source.read(take)?.enumerate() {
            progress(Progress {
                phase: Phase::Writing,
                done: done as u64 + 1,
                total,
            });
            let Some(mut seen) = seen? else { continue };
            newest = newest.max(Some(seen.time));
            seen.people.retain(|(who, _)| self.person(who).is_some());
            resampler.push(seen);
            let ripe = |frame| {
                newest
                    .is_some_and(|newest| newest.since_ns(self.plan.grid.time(frame)) > patience_ns)
            };
            let mut ready = frame;
            while ready <= last && ripe(ready) {
                ready += 1;
            }
            for frame in frame..ready {
                self.write(frame, &mut resampler)?;
            }
            frame = ready;
            if frame > last {
                break;
            }
        }
        (frame..=last).try_for_each(|frame| self.write(frame, &mut resampler))
    }

    /// The index of a person in the plan.
    fn person(&self, who: &Who) -> Option<usize> {
        self.plan
            .people
            .binary_search_by(|person| person.who.cmp(who))
            .ok()
    }

    fn write(&mut self, frame: u64, resampler: &mut Resampler) -> Result<()> {
        let time = self.plan.grid.time(frame);
        let mut people = Vec::new();
        for (who, skeleton) in resampler.at(time) {
            let Some(person) = self.person(&who) else {
                continue;
            };
            let presence = &self.plan.people[person];
            if !(presence.first..=presence.last).contains(&frame) {
                continue;
            }
            self.people[person].count(skeleton.len());
            let mover = self.movers[person].as_mut();
            let pose = mover.and_then(|mover| mover.pose(time, &skeleton));
            people.push(Figure {
                person,
                skeleton,
                pose,
            });
        }
        let moment = Moment { frame, people };
        self.files
            .iter_mut()
            .try_for_each(|file| file.moment(&moment))
    }
}

/// Counts what was known of a person.
#[derive(Clone, Default)]
struct Tally {
    frames_with: u64,
    joints: u64,
}

fn tallies(plan: &Plan) -> Vec<Tally> {
    vec![Tally::default(); plan.people.len()]
}

impl Tally {
    fn count(&mut self, joints: usize) {
        self.frames_with += 1;
        self.joints += joints as u64;
    }

    fn report(&self, plan: &Plan, person: &crate::plan::Presence) -> PersonReport {
        let frames = person.last - person.first + 1;
        let joints = self.frames_with * posefuse_skeleton::JOINT_COUNT as u64;
        PersonReport {
            person: person.who.clone(),
            from_s: plan.seconds(person.first),
            to_s: plan.seconds(person.last),
            frames,
            frames_without: frames - self.frames_with,
            missing_share: match joints {
                0 => 1.0,
                joints => 1.0 - self.joints as f64 / joints as f64,
            },
        }
    }
}

/// What goes into which file.
fn sheets<'a>(
    plan: &'a Plan,
    rigs: &'a [Option<posefuse_kinematics::Rig>],
    options: &Options,
) -> Vec<(Format, Sheet<'a>)> {
    let everybody: Vec<usize> = (0..plan.people.len()).collect();
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
        if format.is_one_person() {
            sheets.extend(everybody.iter().map(|person| sheet(format, vec![*person])));
        } else {
            sheets.push(sheet(format, everybody.clone()));
        }
    }
    sheets
}

/// The take, whose word it is if not the fused people's, the person where there is one, and the ending.
fn file_name((format, sheet): &(Format, Sheet), options: &Options) -> String {
    let take = &sheet.plan.header.name;
    let ending = format.ending();
    match (format.is_one_person(), options.source) {
        (true, _) => format!("{take}-{}{ending}", sheet.plan.people[sheet.people[0]].who),
        (false, crate::Source::Fused) => format!("{take}{ending}"),
        (false, source) => format!("{take}-{source}{ending}"),
    }
}

/// A file under another name until it is whole. It vanishes if it never becomes so.
struct Draft<'a> {
    format: Format,
    people: Vec<Who>,
    first: u64,
    last: u64,
    sink: Option<Box<dyn Sink + 'a>>,
    part: PathBuf,
    path: PathBuf,
}

impl<'a> Draft<'a> {
    fn open(format: Format, sheet: Sheet<'a>, path: PathBuf) -> Result<Self> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let part = path.with_file_name(format!(".{name}.part"));
        let file = File::create(&part).map_err(ExportError::write(&part))?;
        let mut draft = Self {
            format,
            people: sheet.who().cloned().collect(),
            first: sheet.first,
            last: sheet.last,
            sink: None,
            part,
            path,
        };
        let sink = write::open(format, sheet, BufWriter::new(file));
        draft.sink = Some(sink.map_err(ExportError::write(&draft.path))?);
        Ok(draft)
    }

    fn moment(&mut self, moment: &Moment) -> Result<()> {
        match &mut self.sink {
            Some(sink) if (self.first..=self.last).contains(&moment.frame) => {
                sink.moment(moment).map_err(ExportError::write(&self.path))
            }
            _ => Ok(()),
        }
    }

    fn finish(mut self, plan: &Plan) -> Result<FileReport> {
        if let Some(sink) = self.sink.take() {
            sink.finish().map_err(ExportError::write(&self.path))?;
        }
        let bytes = fs::metadata(&self.part)
            .map_err(ExportError::write(&self.part))?
            .len();
        fs::rename(&self.part, &self.path).map_err(ExportError::write(&self.path))?;
        Ok(FileReport {
            path: std::mem::take(&mut self.path),
            format: self.format,
            people: std::mem::take(&mut self.people),
            from_s: plan.seconds(self.first),
            from_utc: plan.civil(self.first),
            frames: self.last - self.first + 1,
            bytes,
        })
    }
}

impl Drop for Draft<'_> {
    fn drop(&mut self) {
        // What was finished has its own name by now; for the rest there is nobody to tell.
        let _ = fs::remove_file(&self.part);
    }
}
