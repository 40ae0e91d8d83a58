//! `posefuse evaluate simulated`: many rooms, every method on the same sensors' frames.

use std::sync::Arc;

use clap::{Args, ValueEnum};
use posefuse_evaluate::suite::{Setting, Suite};
use posefuse_evaluate::{Report, aims, perfect_calibration};
use posefuse_fusion::Config;
use posefuse_simulator::{Scenario, SensorErrors, World};
use posefuse_skeleton::Calibration;

use super::models;
use super::shown::CompareArgs;
use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::offline::from_simulated_walk;
use crate::{output, progress, values};

/// The rooms of the project's own figures.
const ROOMS: &str = "ring3,ring4,ring6,arc2,arc3";
const METHODS: [&str; 6] = [
    "mean", "menard", "weighted", "kalman-0", "kalman-1", "offline",
];

/// What repair is tried with.
const REPAIRED: [&str; 2] = ["kalman", "offline"];

/// Simulated rooms, where the truth is known
#[derive(Debug, Args)]
pub(super) struct SimulatedArgs {
    /// The rooms: `ring`, `arc` (100 degrees in front) or `desk` (an arc with a desk before each sensor, which hides legs)
    /// and how many sensors
    #[arg(long, value_name = "ROOM,...", value_delimiter = ',', default_value = ROOMS)]
    rooms: Vec<String>,
    /// How many people are in each
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::whole(1u32, 8))]
    people: u32,
    /// How often each room is simulated, with other sensors, people and noise
    #[arg(long, value_name = "N", default_value = "10", value_parser = values::whole(1u64, 1000))]
    seeds: u64,
    /// How long each is
    #[arg(long, value_name = "S", default_value = "20", value_parser = room_seconds)]
    seconds: f64,
    /// What is wrong with the sensors
    #[arg(long, value_enum, default_value_t)]
    errors: ErrorsArg,
    /// Where the engine takes the sensors to stand: as they truly do, or as a simulated walk of 40 s tells
    #[arg(long, value_enum, default_value_t)]
    calibration: CalibrationArg,
    /// Make up what no sensor sees, too, and tell what that changes: `gaussian` and the other simple ones, `auto`, the name
    /// of a network or the path of its manifest; `none` is always compared
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    repair: Vec<String>,
    #[command(flatten)]
    compare: CompareArgs,
}

/// What is wrong with simulated sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum ErrorsArg {
    /// Nothing.
    None,
    /// Noise, biases, hidden joints, perfect mirror images.
    Default,
    /// All of it: mirror images that are not perfect, biases of single sensors, stale frames, interference.
    #[default]
    Harsh,
}

/// Where the engine takes the sensors to stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum CalibrationArg {
    /// Where they truly stand, with the bias along their rays truly known.
    #[default]
    True,
    /// As the solver finds from a simulated walk.
    Walk,
}

/// All frames of a room are held in memory while its methods take turns.
const LONGEST_S: f64 = 600.0;

fn room_seconds(text: &str) -> Result<f64, String> {
    values::seconds(text)
        .ok()
        .filter(|s| *s <= LONGEST_S)
        .ok_or_else(|| format!("expected seconds, more than 0 and at most {LONGEST_S}"))
}

/// How long the walk of `--calibration walk` is, seconds.
const WALK_S: f64 = 40.0;

pub(super) fn run(args: &SimulatedArgs, global: &Global) -> anyhow::Result<Outcome> {
    if args.compare.skip >= args.seconds {
        return Err(usage("--skip leaves nothing of --seconds"));
    }
    let usual: &[&str] = match args.repair.is_empty() {
        true => &METHODS,
        false => &REPAIRED,
    };
    let methods = models::with_repairs(args.compare.methods.methods(usual)?, &args.repair)?;
    let calibrate = |world: &Arc<World>| calibration(args.calibration, world);
    let suite = Suite {
        settings: args.settings()?,
        seeds: (1..=args.seeds).collect(),
        seconds: args.seconds,
        skip_s: args.compare.skip,
        methods,
        calibrate: &calibrate,
        threads: args.compare.work.threads(),
    };
    let jobs = suite.settings.len() * suite.seeds.len();
    let bar = progress::bar(jobs as u64, "rooms");
    let cells = suite.run(&|done, _| bar.set_position(done as u64));
    bar.finish_and_clear();
    let groups = suite.groups(&cells?);
    // The aims are about rooms with everything that real ones add.
    let checked = args.errors == ErrorsArg::Harsh
        && aims::METHODS
            .iter()
            .all(|name| suite.methods.iter().any(|method| method.name == *name));
    let report = Report {
        title: "Methods in simulated rooms".into(),
        about: args.about(),
        with_truth: true,
        aims: match checked {
            true => [aims::check(&groups), aims::check_repair(&groups)].concat(),
            false => aims::check_repair(&groups),
        },
        groups,
        versus: Vec::new(),
    };
    args.compare.work.show(&report, global)?;
    Ok(Outcome::Done)
}

impl SimulatedArgs {
    fn about(&self) -> Vec<String> {
        let errors = match self.errors {
            ErrorsArg::None => "Sensors without any error.",
            ErrorsArg::Default => {
                "Sensors with noise, biases, hidden joints and perfect mirror images."
            }
            ErrorsArg::Harsh => {
                "Sensors with all that real ones have: noise that interferes, biases also of single sensors, hidden \
                 joints, jumps, mirror images that are not perfect, stale and lost frames."
            }
        };
        let calibration = match self.calibration {
            CalibrationArg::True => "Where the sensors stand is known exactly.",
            CalibrationArg::Walk => "Where the sensors stand was found from a simulated walk.",
        };
        vec![
            format!(
                "Each room is simulated {} times for {} s, with {}; the first {} s are left out.",
                self.seeds,
                self.seconds,
                output::people(self.people),
                self.compare.skip
            ),
            format!(
                "{errors} {calibration} Every method gets the same frames of the same sensors."
            ),
        ]
    }

    fn settings(&self) -> anyhow::Result<Vec<Setting>> {
        let setting = |name: &String| {
            let setting = Setting::named(name).ok_or_else(|| {
                usage(format!(
                    "there is no room `{name}`; expected `ring`, `arc` or `desk` and a number of sensors from 1 to 64, \
                     like ring4 or arc2"
                ))
            })?;
            let scenario = Scenario {
                people: self.people as usize,
                ..setting.scenario
            };
            let scenario = match self.errors {
                ErrorsArg::Harsh => scenario,
                ErrorsArg::Default => plain(scenario, SensorErrors::default()),
                ErrorsArg::None => plain(scenario, SensorErrors::none()),
            };
            Ok(Setting {
                scenario,
                ..setting
            })
        };
        self.rooms.iter().map(setting).collect()
    }
}

fn plain(scenario: Scenario, errors: SensorErrors) -> Scenario {
    Scenario {
        errors,
        structured_light: 0,
        ..scenario
    }
}

fn calibration(which: CalibrationArg, world: &Arc<World>) -> Result<Calibration, String> {
    match which {
        CalibrationArg::True => Ok(perfect_calibration(world)),
        CalibrationArg::Walk => {
            let solution = from_simulated_walk(world, WALK_S, &Config::default(), &mut |_| {});
            let solution = solution.map_err(|error| crate::failure::in_words(&error))?;
            Ok(solution.calibration)
        }
    }
}
