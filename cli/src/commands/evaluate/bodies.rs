//! `posefuse evaluate bodies`: what kinematics makes of fused people in simulated rooms, function by function.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use posefuse_evaluate::kinematics::{Trials, Variant, variants};
use posefuse_evaluate::suite::Setting;
use posefuse_fusion::parse_toml;
use posefuse_kinematics::Config;

use super::shown::CompareArgs;
use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::{progress, values};

/// How people are fused unless told otherwise: live, and as takes are smoothed.
const METHODS: [&str; 2] = ["kalman", "offline"];

/// What kinematics makes of fused people: what ships and each of its functions off, beside the people as fused
#[derive(Debug, Args)]
pub(super) struct BodiesArgs {
    /// The rooms: `ring`, `arc` or `desk` and how many sensors
    #[arg(
        long,
        value_name = "ROOM,...",
        value_delimiter = ',',
        default_value = "ring4,arc2"
    )]
    rooms: Vec<String>,
    /// How often each room is simulated, with other sensors, people and noise
    #[arg(long, value_name = "N", default_value = "3", value_parser = values::whole(1u64, 1000))]
    seeds: u64,
    /// How long each is
    #[arg(long, value_name = "S", default_value = "60", value_parser = values::seconds)]
    seconds: f64,
    /// Compare these, too: a TOML file of tables, each a configuration of bodies (its `fit`, `feet` and so on), by its name
    #[arg(long, value_name = "FILE")]
    bodies: Option<PathBuf>,
    #[command(flatten)]
    compare: CompareArgs,
}

pub(super) fn run(args: &BodiesArgs, global: &Global) -> anyhow::Result<Outcome> {
    if args.compare.skip >= args.seconds {
        return Err(usage("--skip leaves nothing of --seconds"));
    }
    let trials = Trials {
        settings: args
            .rooms
            .iter()
            .map(|name| setting(name))
            .collect::<anyhow::Result<_>>()?,
        seeds: (1..=args.seeds).collect(),
        seconds: args.seconds,
        skip_s: args.compare.skip,
        methods: args.compare.methods.methods(&METHODS)?,
        variants: args.variants()?,
        threads: args.compare.work.threads(),
    };
    let bar = progress::bar(trials.count() as u64, "rooms");
    let report = trials.run(&|done| bar.set_position(done as u64));
    bar.finish_and_clear();
    let mut report = report?;
    report.about = vec![
        format!(
            "Each room is simulated {} times for {} s, with one person and all errors that real sensors have; the first {} s are \
             left out. Where the sensors stand is known exactly.",
            args.seeds, args.seconds, args.compare.skip
        ),
        "Every way to make bodies gets the same fused people; lengths are learned from all their frames, as an export does."
            .to_owned(),
    ];
    args.compare.work.show_bodies(&report, global)?;
    Ok(Outcome::Done)
}

fn setting(name: &str) -> anyhow::Result<Setting> {
    Setting::named(name).ok_or_else(|| {
        usage(format!(
            "there is no room `{name}`; expected `ring`, `arc` or `desk` and a number of sensors from 1 to 64, like ring4 or arc2"
        ))
    })
}

impl BodiesArgs {
    /// Those of the program, then those of the file.
    fn variants(&self) -> anyhow::Result<Vec<Variant>> {
        let mut all = variants();
        let given = self.bodies.as_deref().map(given).transpose()?;
        for (name, config) in given.unwrap_or_default() {
            let about = "given".to_owned();
            let config = Some(config);
            all.retain(|known| known.name != name);
            all.push(Variant {
                name,
                about,
                config,
            });
        }
        Ok(all)
    }
}

fn given(file: &Path) -> anyhow::Result<BTreeMap<String, Config>> {
    let shown = file.display();
    let text = std::fs::read_to_string(file).with_context(|| format!("`{shown}`"))?;
    let refused = |error: String| usage(format!("the bodies in `{shown}`: {error}"));
    let configs: BTreeMap<String, Config> =
        parse_toml(&text).map_err(|error| refused(error.to_string()))?;
    for (name, config) in &configs {
        let checked = config.validate();
        checked.map_err(|error| refused(format!("{name}: {error}")))?;
    }
    Ok(configs)
}
