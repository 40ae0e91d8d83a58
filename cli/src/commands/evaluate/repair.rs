//! `posefuse evaluate repair`: occlusion models side by side, on gaps in recorded motion.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use posefuse_evaluate::repair::{Contender, Motion, Riding, Split, Trials};
use posefuse_fusion::{OcclusionModel, SimpleModel};
use posefuse_models::{Config, Kind, Library, NeuralModel, Refused};
use posefuse_simulator::load;

use super::shown::WorkArgs;
use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::{output, progress};

/// Occlusion models: how well they fill in joints that no sensor saw
#[derive(Debug, Args)]
pub(super) struct RepairArgs {
    /// The folder of recordings (BVH, ASF/AMC, exponential maps), unpacked; those that trained the models are left out
    #[arg(long, value_name = "FOLDER")]
    motion: PathBuf,
    /// Which recordings test: a TOML file with lists of patterns, `held_out` and `unseen` [default: the split that
    /// the program's models were trained by]
    #[arg(long, value_name = "FILE")]
    split: Option<PathBuf>,
    /// The networks to compare with the simple methods: names, or paths of manifests (NAME.toml) [default: all in the
    /// program]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    models: Vec<String>,
    /// The simple methods only
    #[arg(long, conflicts_with = "models")]
    simple: bool,
    /// Fewer gaps and fewer poses of each: for a first look
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    work: WorkArgs,
}

pub(super) fn run(args: &RepairArgs, global: &Global) -> anyhow::Result<Outcome> {
    let split = args.split()?;
    let (motions, broken) = motions(&args.motion, &split)?;
    for problem in &broken {
        output::warn(problem);
    }
    let (contenders, refused) = args.contenders()?;
    for problem in &refused {
        output::warn(problem);
    }
    let trials = Trials {
        motions: &motions,
        quick: args.quick,
        threads: args.work.threads(),
    };
    let bar = progress::bar(contenders.len() as u64, "models");
    let mut report = trials.run(contenders, &|done| bar.set_position(done as u64));
    bar.finish_and_clear();
    let left_out: Vec<&str> = broken.iter().chain(&refused).map(String::as_str).collect();
    if !left_out.is_empty() {
        report
            .about
            .push(format!("Left out: {}.", left_out.join("; ")));
    }
    args.work.show_repair(&report, global)?;
    Ok(match left_out.is_empty() {
        true => Outcome::Done,
        false => Outcome::DoneWithLoss,
    })
}

impl RepairArgs {
    fn split(&self) -> anyhow::Result<Split> {
        let Some(file) = &self.split else {
            return Ok(Split::shipped()?);
        };
        let shown = file.display();
        let text = std::fs::read_to_string(file).with_context(|| format!("`{shown}`"))?;
        Split::parse(&text).map_err(|error| usage(format!("the split `{shown}`: {error}")))
    }

    /// The simple methods and the networks, and why others could not be had. One that was asked for by name must be there.
    fn contenders(&self) -> anyhow::Result<(Vec<Contender>, Vec<String>)> {
        let config = Config::default();
        let library = Library::new(&config);
        let defaults = [Kind::Live, Kind::Offline].map(|kind| library.default_model(kind));
        let networks: Vec<String> = match (self.simple, self.models.is_empty()) {
            (true, _) => Vec::new(),
            (false, true) => library.names(),
            (false, false) => self.models.clone(),
        };
        let mut contenders: Vec<Contender> = SimpleModel::ALL.map(|m| simple(m, &defaults)).into();
        contenders.extend(Riding::ALL.map(|model| Contender {
            model: Box::new(model),
            about: model.about().to_owned(),
            simple: true,
            default: false,
        }));
        let mut refused = Vec::new();
        for name in networks {
            let opened = library.read(&name).and_then(|file| {
                let about = file.manifest.about.summary.clone();
                Ok((NeuralModel::open(&file, &config)?, about))
            });
            match opened {
                Ok((model, about)) => contenders.push(Contender {
                    default: defaults
                        .iter()
                        .flatten()
                        .any(|default| default == model.name()),
                    model: Box::new(model),
                    about,
                    simple: false,
                }),
                Err(problem @ Refused::Unknown { .. }) => return Err(usage(problem.to_string())),
                Err(problem) => refused.push(problem.to_string()),
            }
        }
        Ok((contenders, refused))
    }
}

/// One of the simple methods; it is the default where no network is.
fn simple(model: SimpleModel, [live, offline]: &[Option<String>; 2]) -> Contender {
    let default = match model {
        SimpleModel::BEST => live.is_none(),
        SimpleModel::BEST_TWO_SIDED => offline.is_none(),
        _ => false,
    };
    let about = match model {
        SimpleModel::Hold => "a joint stays where it was last seen",
        SimpleModel::Damped => "it goes on as it last moved, slower and slower",
        SimpleModel::Linear => "it goes straight to where it is seen again",
        SimpleModel::Gaussian => "what bodies do that look like what is seen of this one",
        SimpleModel::GaussianTwoSided => "the same, knowing what comes after",
    };
    Contender {
        model: Box::new(model),
        about: about.to_owned(),
        simple: true,
        default,
    }
}

/// What tests of the recordings below `folder`, and what is wrong with those that cannot be read.
fn motions(folder: &Path, split: &Split) -> anyhow::Result<(Vec<Motion>, Vec<String>)> {
    let shown = folder.display();
    let files = load::find(folder).with_context(|| format!("the recordings in `{shown}`"))?;
    let (mut motions, mut broken) = (Vec::new(), Vec::new());
    for file in &files {
        let place = file.strip_prefix(folder).unwrap_or(file);
        let parts = place.iter().map(|part| part.to_string_lossy());
        let place = parts.collect::<Vec<_>>().join("/");
        let Some(tests) = split.tests(&place) else {
            continue;
        };
        match load::load(file) {
            Ok(clip) => motions.extend(Motion::of(clip, &place, tests)),
            Err(error) => broken.push(error.to_string()),
        }
    }
    anyhow::ensure!(
        !motions.is_empty(),
        "of the {} recordings in `{shown}` none is for testing; expected the folder that holds CMU's, unpacked, or a \
         --split of your own",
        files.len()
    );
    Ok((motions, broken))
}
