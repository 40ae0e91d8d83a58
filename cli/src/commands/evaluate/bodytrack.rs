//! `posefuse evaluate bodytrack`: the body tracker on rendered depth, one sensor alone and four fused.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use clap::{Args, ValueEnum};
use posefuse_agent::source::SimOptics;
use posefuse_bodytrack::TrackerConfig;
use posefuse_evaluate::bodytrack::together::{Together, TogetherReport};
use posefuse_evaluate::bodytrack::{
    BodytrackReport, Trials, hand_rows, kind_rows, reliability_rows, speed_rows,
};
use posefuse_evaluate::preset;
use posefuse_evaluate::repair::Split;
use posefuse_simulator::depth::DepthCamera;
use posefuse_simulator::motion::Clip;
use posefuse_simulator::{Scenario, Situation, World, load};
use serde::Serialize;

use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::output::{self, Style, line, paint};
use crate::{progress, values};

/// Seeds of simulated people that no training has seen: those of training lie elsewhere.
const FIRST_SEED: u64 = 9_001;
/// Most recordings that are tried, spread over all that are held out.
const MOST_CLIPS: usize = 60;

/// The body tracker for depth sensors, on rendered depth of people nobody trained it with
#[derive(Debug, Args)]
pub(super) struct BodytrackArgs {
    /// Rooms with so many people
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "1,2,4", value_parser = values::whole(1usize, 8))]
    people: Vec<usize>,
    /// How often each, with other people
    #[arg(long, value_name = "N", default_value = "4", value_parser = values::whole(1u64, 1000))]
    seeds: u64,
    /// How long each is watched
    #[arg(long, value_name = "S", default_value = "20", value_parser = values::seconds)]
    seconds: f64,
    /// How much is left out at the start, while the tracker learns the room
    #[arg(long, value_name = "S", default_value = "2", value_parser = values::seconds)]
    skip: f64,
    /// The kind of sensor
    #[arg(long, value_enum, default_value_t)]
    camera: CameraArg,
    /// A folder of recordings (BVH, ASF/AMC, exponential maps): those held out of training are tried, too
    #[arg(long, value_name = "FOLDER")]
    motion: Option<PathBuf>,
    /// The manifest of another network
    #[arg(long, value_name = "NAME.toml")]
    network: Option<PathBuf>,
    /// How many rooms with four such sensors are fused; 0: none
    #[arg(long, value_name = "N", default_value = "2", value_parser = values::whole(0u64, 100))]
    fused: u64,
    /// How many rooms are worked on at once; times are right with 1 only
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::whole(1usize, 256))]
    threads: usize,
}

/// Kinds of simulated depth cameras.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum CameraArg {
    /// Kinect v1 and its like: 320 x 240.
    #[default]
    StructuredLight,
    /// The same with 640 x 480.
    StructuredLightVga,
    /// Kinect v2 and its like.
    TimeOfFlight,
}

/// What `--json` prints.
#[derive(Serialize)]
struct View<'a> {
    alone: &'a BodytrackReport,
    fused: &'a [TogetherReport],
}

pub(super) fn run(args: &BodytrackArgs, global: &Global) -> anyhow::Result<Outcome> {
    if args.skip >= args.seconds {
        return Err(usage("--skip leaves nothing of --seconds"));
    }
    let trials = args.trials()?;
    let bar = progress::bar(trials.count() as u64, "rooms");
    let alone = trials.run(&|done| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    let bar = progress::bar(args.fused, "fused rooms");
    let mut fused = Vec::new();
    for number in 0..args.fused {
        fused.push(args.together(&trials, FIRST_SEED + number)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if global.json {
        output::json_pretty(&View {
            alone: &alone,
            fused: &fused,
        })?;
        return Ok(Outcome::Done);
    }
    show(&alone)?;
    fused
        .iter()
        .zip(1..)
        .try_for_each(|(room, number)| show_fused(room, number))?;
    Ok(Outcome::Done)
}

impl BodytrackArgs {
    fn trials(&self) -> anyhow::Result<Trials> {
        let camera = match self.camera {
            CameraArg::StructuredLight => SimOptics::StructuredLight.camera(),
            CameraArg::StructuredLightVga => DepthCamera::structured_light(640, 480),
            CameraArg::TimeOfFlight => SimOptics::TimeOfFlight.camera(),
        };
        let clips = self.motion.as_deref().map(held_out).transpose()?;
        Ok(Trials {
            people: self.people.clone(),
            situations: vec![Situation::Everyday],
            seeds: (FIRST_SEED..FIRST_SEED + self.seeds).collect(),
            clips: clips.unwrap_or_default(),
            seconds: self.seconds,
            skip_s: self.skip,
            camera,
            tracker: TrackerConfig {
                network: self.network.clone().unwrap_or_default(),
                ..TrackerConfig::default()
            },
            threads: self.threads,
        })
    }

    fn together(&self, trials: &Trials, seed: u64) -> anyhow::Result<TogetherReport> {
        let scenario = Scenario {
            seed,
            ..Scenario::default()
        };
        let together = Together {
            world: World::new(&scenario)?,
            seconds: self.seconds,
            skip_s: self.skip,
            camera: trials.camera,
            tracker: trials.tracker.clone(),
            method: preset("kalman").context("the method `kalman`")?,
            threads: self.threads,
        };
        Ok(together.run()?)
    }
}

/// The recordings below `folder` that no training has seen.
fn held_out(folder: &Path) -> anyhow::Result<Vec<Arc<Clip>>> {
    let (split, shown) = (Split::shipped()?, folder.display());
    let files = load::find(folder).with_context(|| format!("the recordings in `{shown}`"))?;
    let is_tested = |file: &&PathBuf| {
        let place = file.strip_prefix(folder).unwrap_or(file);
        let parts = place.iter().map(|part| part.to_string_lossy());
        split.tests(&parts.collect::<Vec<_>>().join("/")).is_some()
    };
    let tested: Vec<&PathBuf> = files.iter().filter(is_tested).collect();
    let step = tested.len().div_ceil(MOST_CLIPS).max(1);
    let loaded = tested
        .into_iter()
        .step_by(step)
        .map(|file| load::load(file));
    let clips: Vec<Arc<Clip>> = loaded.filter_map(Result::ok).map(Arc::new).collect();
    anyhow::ensure!(
        !clips.is_empty(),
        "of the {} recordings in `{shown}` none is for testing; expected the folder that holds CMU's, unpacked",
        files.len()
    );
    Ok(clips)
}

fn show(report: &BodytrackReport) -> anyhow::Result<()> {
    line(format!("network on {}", report.runtime))?;
    headed("One sensor alone", &kind_rows(report))?;
    line(format!(
        "bodies of nobody: {} in {} images; ids changed {} times in {:.0} s of people followed",
        report.of_nobody, report.images, report.id_changes, report.followed_s
    ))?;
    headed(
        "Confidence against what was right",
        &reliability_rows(&report.reliability, ["confidence", "joints", "right %"]),
    )?;
    if let (Some(gap), Some([intercept, slope])) =
        (report.reliability.gap(), report.reliability.correction())
    {
        line(format!(
            "mean gap {gap:.3}; logits would be right by {intercept:+.2} and a factor of {slope:.2}"
        ))?;
    }
    headed("Hands: open or closed", &hand_rows(report))?;
    headed(
        "Probability of a closed hand against what was true",
        &reliability_rows(&report.hands, ["said", "votes", "closed %"]),
    )?;
    if let Some(gap) = report.hands.gap() {
        line(format!("mean gap {gap:.3}"))?;
    }
    headed("Time per image", &speed_rows(report))
}

fn show_fused(report: &TogetherReport, number: usize) -> anyhow::Result<()> {
    let mm = |value: Option<f64>| value.map_or("-".to_owned(), |mm| format!("{mm:.1}"));
    let row = |name: String, errors: &posefuse_evaluate::bodytrack::together::Errors| {
        let found = 100.0 * errors.found as f64 / errors.people.max(1) as f64;
        let right = errors.distances.right_share().map(|share| 100.0 * share);
        vec![
            name,
            mm(errors.distances.mean_mm()),
            mm(right),
            format!("{found:.1}"),
        ]
    };
    let mut rows = vec![
        ["", "error mm", "<10cm %", "found %"]
            .map(str::to_owned)
            .to_vec(),
    ];
    let alone = report.alone.iter().zip(1..);
    rows.extend(alone.map(|(errors, sensor)| row(format!("sensor {sensor} alone"), errors)));
    rows.push(row("fused".to_owned(), &report.fused));
    headed(&format!("Room {number}: four sensors, one person"), &rows)?;
    if let Some(ratio) = report.ratio() {
        line(format!("fused error: {ratio:.2} of a sensor's alone"))?;
    }
    Ok(())
}

fn headed(heading: &str, rows: &[Vec<String>]) -> anyhow::Result<()> {
    line(paint(Style::Bold, heading))?;
    output::print_table(rows)?;
    Ok(())
}
