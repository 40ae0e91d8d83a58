//! `posefuse simulate`: simulated sensors into a take, faster than real time, with the error against the truth.

mod calibrated;
mod error;
mod recorder;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use posefuse_evaluate::SimulatedRoom;
use posefuse_fusion::Config;
use posefuse_session::Catalogue;
use posefuse_simulator::load::load;
use posefuse_simulator::{Scenario, World};
use serde::Serialize;

use self::error::{ErrorView, Errors};
use self::recorder::Recorder;
use super::agent::{LayoutArg, read_scenario};
use super::server::read_config;
use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::output::{Style, line, paint};
use crate::takes_folder::TakesFolder;
use crate::values;
use crate::views::{CalibrationView, TakeView};
use crate::{output, progress};

/// Make a take from simulated sensors, faster than real time, and measure the error against the truth
#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// How long the take is
    #[arg(long, value_name = "S", default_value = "60", value_parser = values::seconds)]
    seconds: f64,
    /// The take's name; a number is appended if it exists
    #[arg(long, value_name = "NAME", default_value = "simulated")]
    out: String,
    /// How many people are in the room
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::whole(1u32, 8))]
    people: u32,
    /// How many sensors the room has
    #[arg(long, value_name = "N", default_value = "4", value_parser = values::whole(1u32, 64))]
    sensors: u32,
    /// What everything random is drawn from
    #[arg(long, value_name = "NUMBER", default_value = "1", value_parser = values::whole(0, u64::MAX))]
    seed: u64,
    /// Where the sensors stand
    #[arg(long, value_enum, default_value_t)]
    layout: LayoutArg,
    /// Everything about the room, as TOML, instead of the options above
    #[arg(long, value_name = "FILE", conflicts_with_all = ["people", "sensors", "seed", "layout"])]
    scenario: Option<PathBuf>,
    /// Recorded motion instead of made-up people, one file each: BVH, ASF with AMC, exponential maps
    #[arg(long, value_name = "FILE", num_args = 1..)]
    motion: Vec<PathBuf>,
    /// Put the sensors where they truly stand, instead of calibrating from a walk
    #[arg(long)]
    true_calibration: bool,
    /// How long the simulated walk for the calibration is
    #[arg(long, value_name = "S", default_value = "40", value_parser = values::seconds, conflicts_with = "true_calibration")]
    walk: f64,
    /// Settings: a server's configuration, whose `[fusion]` part is used
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    takes: TakesFolder,
}

/// What `--json` prints.
#[derive(Serialize)]
struct SimulateView {
    take: TakeView,
    calibration: Option<CalibrationView>,
    error: ErrorView,
    seconds: f64,
    /// How much faster than real time it went.
    speed: f64,
}

pub(crate) fn run(args: &SimulateArgs, global: &Global) -> anyhow::Result<Outcome> {
    let scenario = scenario(args)?;
    let config = args.config.as_deref().map(read_config).transpose()?;
    let config = config.map_or_else(Config::default, |config| config.fusion);
    let world = Arc::new(world(&scenario, &args.motion)?);
    let storage = args.takes.storage()?;
    let name = Catalogue::unused_name(&storage, &args.out).map_err(usage)?;
    let (calibration, verdict) = match args.true_calibration {
        true => (calibrated::truly(&world), None),
        false => {
            let (calibration, view) = calibrated::from_walk(&world, args.walk, &config)?;
            (calibration, Some(view))
        }
    };
    if let Some(view) = verdict.as_ref().filter(|_| !global.json) {
        super::calibrate::verdict::summary(view)?;
    }

    let begun = Instant::now();
    let mut recorder = Recorder::new(Arc::new(storage), &name, config, calibration, &scenario)?;
    let mut errors = Errors::new(&world);
    let room = SimulatedRoom::new(&world, args.seconds)?;
    let bar = progress::bar((args.seconds * 10.0) as u64, "simulating");
    for (time, input) in room {
        recorder.feed(time, input, &mut errors)?;
        bar.set_position((SimulatedRoom::scenario_seconds(time).max(0.0) * 10.0) as u64);
    }
    bar.finish_and_clear();
    let take = recorder.finish()?;
    let speed = args.seconds / begun.elapsed().as_secs_f64().max(1e-6);

    let path = args.takes.path().join(format!("{}.mcap", take.name));
    let view = SimulateView {
        take: TakeView {
            path: Some(path.display().to_string()),
            ..TakeView::from(&take)
        },
        calibration: verdict,
        error: errors.view(),
        seconds: args.seconds,
        speed,
    };
    if global.json {
        output::json_pretty(&view)?;
    } else {
        tell(&view)?;
    }
    Ok(if take.dropped > 0 || !take.trouble.is_empty() {
        Outcome::DoneWithLoss
    } else {
        Outcome::Done
    })
}

fn scenario(args: &SimulateArgs) -> anyhow::Result<Scenario> {
    match &args.scenario {
        Some(file) => read_scenario(file),
        None => Ok(Scenario {
            seed: args.seed,
            people: args.people as usize,
            sensors: args.sensors as usize,
            layout: args.layout.into(),
            ..Scenario::default()
        }),
    }
}

fn world(scenario: &Scenario, motion: &[PathBuf]) -> anyhow::Result<World> {
    if motion.is_empty() {
        return World::new(scenario).map_err(usage);
    }
    let clips = motion.iter().map(|file| load(file).map(Arc::new));
    let clips = clips.collect::<Result<Vec<_>, _>>().map_err(usage)?;
    World::with_clips(scenario, clips).map_err(usage)
}

fn tell(view: &SimulateView) -> anyhow::Result<()> {
    let (take, error) = (&view.take, &view.error);
    line(format!(
        "take {}: {:.0} s in {:.1} s ({:.0} times real time), {} frames, {}",
        paint(Style::Bold, &take.name),
        view.seconds,
        view.seconds / view.speed,
        view.speed,
        take.frames,
        output::bytes(take.bytes),
    ))?;
    line(format!("     {}", take.path.as_deref().unwrap_or_default()))?;
    line(format!(
        "error {} mm mean per joint (MPJPE), {:.0} mm median, {:.0} mm at the 95th percentile",
        paint(Style::Bold, &format!("{:.1}", error.mpjpe_mm)),
        error.median_mm,
        error.p95_mm,
    ))?;
    line(format!(
        "      {:.2} % of people missed, {:.2} % of tracks follow nobody, {} changes of identity",
        100.0 * error.missed_share,
        100.0 * error.extra_share,
        error.identity_changes,
    ))?;
    Ok(())
}
