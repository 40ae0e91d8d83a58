//! `posefuse evaluate takes`: takes fused again by each method, against their truth or sensor against sensor.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::bail;
use clap::Args;
use posefuse_evaluate::{Judged, Method, RecordedTruth, Report, in_parallel, versus};
use posefuse_fusion::Input;
use posefuse_simulator::TruePerson;
use posefuse_skeleton::{Calibration, Joint, Timestamp};

use super::material::{Inputs, Material, groups};
use super::shown::CompareArgs;
use crate::commands::refuse::read_calibration;
use crate::failure::{Outcome, in_words, usage};
use crate::global::Global;
use crate::takes_folder::{Located, TakesFolder};
use crate::{output, progress};

pub(super) const METHODS: [&str; 4] = ["menard", "weighted", SHIPS, "offline"];
/// The preset with the settings that a server begins with.
const SHIPS: &str = "kalman";

/// Takes: against their truth if they are simulated, else each sensor against all others
#[derive(Debug, Args)]
pub(super) struct TakesArgs {
    /// The takes: names or files
    #[arg(required = true, value_name = "TAKE")]
    take: Vec<PathBuf>,
    /// Another calibration than the recorded ones
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    #[command(flatten)]
    compare: CompareArgs,
    #[command(flatten)]
    takes: TakesFolder,
}

pub(super) fn run(args: &TakesArgs, global: &Global) -> anyhow::Result<Outcome> {
    let calibration = args
        .calibration
        .as_deref()
        .map(read_calibration)
        .transpose()?;
    let calibration = calibration.map(Arc::new);
    let materials = args.take.iter().map(|take| {
        let located = args.takes.find(take)?;
        material(located, calibration.clone())
    });
    let materials: Vec<Material> = materials.collect::<anyhow::Result<_>>()?;
    let with_truth = materials.iter().filter(|m| !m.truth.is_empty()).count();
    if with_truth != 0 && with_truth != materials.len() {
        let without = materials.iter().find(|m| m.truth.is_empty());
        return Err(usage(format!(
            "takes with truth (simulated) and without cannot be compared in one table; `{}` has none",
            without.map_or("", |m| m.name.as_str())
        )));
    }
    args.compare
        .judge("Methods on takes", &materials, Vec::new(), global)
}

impl CompareArgs {
    /// Fuses everything with every method and shows what came out.
    pub(super) fn judge(
        &self,
        title: &str,
        materials: &[Material],
        mut about: Vec<String>,
        global: &Global,
    ) -> anyhow::Result<Outcome> {
        let methods = self.methods.methods(&METHODS)?;
        let bar = progress::bar((materials.len() * methods.len()) as u64, "fusing");
        let judged = in_parallel(materials.len(), self.work.threads(), &|index| {
            materials[index].judged(&methods, self.skip, &|| bar.inc(1))
        });
        bar.finish_and_clear();
        let (judged, left_out) = usable(materials, judged)?;
        let with_truth = materials.iter().all(|m| !m.truth.is_empty());
        if !left_out.is_empty() {
            about.push(format!("Left out: {}.", left_out.join("; ")));
        }
        about.push(match with_truth {
            true => "The truth is recorded with the takes.".to_owned(),
            false => "There is no truth: each sensor is left out in turn, and what it saw itself is compared with what \
                      the others make of it. With two sensors that is one against the other."
                .to_owned(),
        });
        let groups = groups(&methods, &judged);
        let several = groups.get(1..).filter(|_| judged.len() > 1);
        let versus = several.map_or_else(Vec::new, |takes| {
            let pairs = side_by_side(&methods).into_iter();
            pairs
                .map(|(one, other)| versus(takes, one, other, with_truth))
                .collect()
        });
        let report = Report {
            title: title.to_owned(),
            about,
            with_truth,
            groups,
            versus,
            ..Report::default()
        };
        self.work.show(&report, global)?;
        Ok(match left_out.is_empty() {
            true => Outcome::Done,
            false => Outcome::DoneWithLoss,
        })
    }
}

/// What is compared take by take: what ships and the last method, each with those before it.
fn side_by_side(methods: &[Method]) -> Vec<(&str, &str)> {
    let mut pairs = Vec::new();
    for (index, one) in methods.iter().enumerate() {
        if one.name == SHIPS || index + 1 == methods.len() {
            let before = methods[..index].iter();
            pairs.extend(before.map(|other| (one.name.as_str(), other.name.as_str())));
        }
    }
    pairs
}

type Usable<'a> = Vec<(&'a Material, Vec<Judged>)>;

/// Those that could be evaluated, and why the others could not. If none could, that is an error.
fn usable(
    materials: &[Material],
    judged: Vec<anyhow::Result<Vec<Judged>>>,
) -> anyhow::Result<(Usable<'_>, Vec<String>)> {
    let (mut usable, mut problems) = (Vec::new(), Vec::new());
    for (material, judged) in materials.iter().zip(judged) {
        match judged {
            Ok(judged) => usable.push((material, judged)),
            Err(error) => problems.push(in_words(&error)),
        }
    }
    if usable.is_empty() {
        bail!("{}", problems.join("; "));
    }
    for problem in &problems {
        output::warn(problem);
    }
    Ok((usable, problems))
}

/// A take, read anew for each method.
fn material(located: Located, calibration: Option<Arc<Calibration>>) -> anyhow::Result<Material> {
    let reader = located.open()?;
    let mut instants = Vec::new();
    for truth in reader.truth() {
        let truth = truth?;
        let person = |person: &posefuse_session::TruePerson| TruePerson {
            id: person.id,
            joints: Joint::ALL.into_iter().zip(person.joints).collect(),
        };
        instants.push((truth.time, truth.people.iter().map(person).collect()));
    }
    Ok(Material {
        name: located.name.clone(),
        note: String::new(),
        truth: RecordedTruth::new(instants),
        open: Box::new(move || inputs(&located, calibration.clone())),
    })
}

fn inputs(located: &Located, calibration: Option<Arc<Calibration>>) -> anyhow::Result<Inputs> {
    let reader = located.open()?;
    let (_, preamble) = reader.beginning()?;
    let given = calibration.is_some();
    let first = calibration.map(Input::Calibration);
    let mut now = reader.header().start.unwrap_or(Timestamp::ZERO);
    let all = preamble.into_iter().map(Ok).chain(reader.inputs());
    let kept = all.filter(move |input| !given || !matches!(input, Ok(Input::Calibration(_))));
    Ok(Box::new(first.into_iter().map(Ok).chain(kept).map(
        move |input| {
            let input = input?;
            now = input.time().map_or(now, |time| time.max(now));
            Ok((now, input))
        },
    )))
}
