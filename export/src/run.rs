//! An export from end to end: two readings of a take, files that appear when they are whole.

use std::fs;
use std::path::Path;

use posefuse_session::TakeReader;
use posefuse_skeleton::{Provenance, Timestamp};

use crate::body::{Hands, Learners, Mover};
use crate::draft::Draft;
use crate::plan::Plan;
use crate::report::{Report, Tally, tallies};
use crate::resample::Resampler;
use crate::targets::{Target, targets};
use crate::write::{Figure, Moment};
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

/// Exports a take into files of `folder`, which is made if it is not there. Files get the take's name, the person's
/// where each has their own, and the format's ending; they appear when they are whole.
///
/// # Errors
/// [`ExportError`]; before anything is written where a file is there already (without `force`), or where there would be more
/// files than can be open at once.
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
    let mut learn = |who: &Who, skeleton: &_, asked| {
        if with_rigs {
            learners.add(who, skeleton, asked);
        }
    };
    let plan = Plan::of(take, options, &mut learn, progress)?;
    let movers = plan
        .people
        .iter()
        .map(|person| learners.mover(&person.who, &options.bodies));
    let movers: Vec<Option<Mover>> = movers.collect();
    drop(learners);
    let rigs: Vec<_> = movers
        .iter()
        .map(|mover| mover.as_ref().map(|mover| mover.rig().clone()))
        .collect();
    let targets = targets(&plan, &rigs, options, folder)?;
    let rigless = plan.people.iter().zip(&rigs);
    let rigless = rigless.filter(|(_, rig)| with_rigs && rig.is_none());
    let without_rig: Vec<Who> = rigless.map(|(person, _)| person.who.clone()).collect();
    fs::create_dir_all(folder).map_err(ExportError::write(folder))?;
    let there = targets.iter().find(|target| !force && target.path.exists());
    if let Some(target) = there {
        return Err(ExportError::Exists(target.path.clone()));
    }
    let mut files = Vec::with_capacity(targets.len());
    for Target {
        format,
        sheet,
        path,
    } in targets
    {
        files.push(Draft::open(format, sheet, path)?);
    }
    let mut writing = Writing {
        plan: &plan,
        options,
        hands: plan
            .people
            .iter()
            .map(|_| Hands::new(&options.bodies.hands))
            .collect(),
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
        absent: plan.absent(options),
        without_rig,
        files: reports,
    })
}

/// What the second reading works with.
struct Writing<'a> {
    plan: &'a Plan,
    options: &'a Options,
    movers: Vec<Option<Mover>>,
    hands: Vec<Hands>,
    files: Vec<Draft<'a>>,
    people: Vec<Tally>,
}

impl Writing<'_> {
    fn run(&mut self, take: &TakeReader, progress: &mut dyn FnMut(Progress)) -> Result<()> {
        let source = self.options.source;
        let max_gap_ns = (self.options.max_gap_s * 1e9) as i64;
        // When a frame this much later has come, nothing that matters to an instant can come any more.
        let patience_ns = max_gap_ns.saturating_add(source.disorder_ns());
        let (mut frame, last) = self.plan.frames();
        let mut resampler = Resampler::new(max_gap_ns, self.plan.grid.time(frame));
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
        for (who, seen) in resampler.at(time) {
            let Some(person) = self.person(&who) else {
                continue;
            };
            let presence = &self.plan.people[person];
            if !(presence.first..=presence.last).contains(&frame) {
                continue;
            }
            self.people[person].count(seen.skeleton.len());
            let mover = self.movers[person].as_mut();
            let pose = mover.and_then(|mover| mover.pose(time, &seen));
            let hands = match self.options.bodies.hands.enabled {
                true => self.hands[person].step(time, &seen),
                false => [None; 2],
            };
            let skeleton = match self.options.only_measured {
                true => seen.skeleton.filter_map(|_, state| {
                    matches!(state.provenance, Provenance::Measured(_)).then_some(*state)
                }),
                false => seen.skeleton,
            };
            people.push(Figure {
                person,
                skeleton,
                hands,
                pose,
            });
        }
        let moment = Moment { frame, people };
        self.files
            .iter_mut()
            .try_for_each(|file| file.moment(&moment))
    }
}
