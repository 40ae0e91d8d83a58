//! `posefuse refuse`: a take fused again, into a new take beside it.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use clap::Args;
use posefuse_fusion::{OcclusionModel, parse_toml};
use posefuse_models::Kind;
use posefuse_server::Config;
use posefuse_session::{
    DiskStorage, RefuseOptions, RefuseReport, Storage, TakeReader, refuse_with,
};
use serde::Serialize;

use crate::commands::server::read_config;
use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::output::{Style, line, paint};
use crate::repair::{self, Repair};
use crate::takes_folder::{Located, TakesFolder};
use crate::views::TakeView;
use crate::{output, progress};

/// Fuse a take again, into a new take beside it: with other settings, another calibration, or the same ones to show
/// that the same comes out
#[derive(Debug, Args)]
pub(crate) struct RefuseArgs {
    /// The take: its name or its file
    take: PathBuf,
    /// Other settings: a server's configuration, whose `[fusion]` part is used
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Another calibration, e.g. from `posefuse calibrate --from TAKE --out FILE`
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Smooth every frame by what came after it (fusing method `kalman`): what only a recording allows
    #[arg(long)]
    smooth: bool,
    #[arg(long, value_name = "MODEL", help = repair::HELP)]
    repair: Option<String>,
    /// The new take's name [default: the old one's with -refused]
    #[arg(long, value_name = "NAME")]
    out: Option<String>,
    #[command(flatten)]
    takes: TakesFolder,
}

/// What `--json` prints.
#[derive(Serialize)]
struct RefuseView {
    take: TakeView,
    inputs: u64,
    recorded_frames: u64,
    frames: u64,
    identical: bool,
    from_snapshot: bool,
    /// How many frames before the first that differs were the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    same_until: Option<u64>,
}

pub(crate) fn run(args: &RefuseArgs, global: &Global) -> anyhow::Result<Outcome> {
    let located = args.takes.find(&args.take)?;
    let config = args.config.as_deref().map(read_config).transpose()?;
    // Says what can be done about a take that cannot be read.
    let old = located.open()?;
    let mut repair = args.repairing(config.as_ref(), &old)?;
    let options = RefuseOptions {
        config: config.map(|config| config.fusion),
        repair: args.repair.as_ref().map(|_| repair.name.clone()),
        calibration: args
            .calibration
            .as_deref()
            .map(read_calibration)
            .transpose()?,
        build: posefuse_server::BUILD.to_owned(),
        smooth: args.smooth,
        name: args.out.clone(),
    };
    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(&located.folder)?);
    let bar = progress::bar(1, "fusing");
    let mut show = |progress: posefuse_session::RefuseProgress| {
        bar.set_length(progress.total.max(1));
        bar.set_position(progress.done);
    };
    let model = repair.model.as_mut();
    let model = model.map(|model| model as &mut dyn OcclusionModel);
    let report = refuse_with(&storage, &located.name, &options, model, &mut show);
    bar.finish_and_clear();
    let report = report?;
    if global.json {
        output::json_pretty(&view(&report, &located))?;
    } else {
        tell(&report, &located, args)?;
    }
    let lost = report.take.dropped > 0 || !report.take.trouble.is_empty();
    Ok(if lost {
        Outcome::DoneWithLoss
    } else {
        Outcome::Done
    })
}

impl RefuseArgs {
    /// What fills in: as the command line says, else as the configuration does. Recorded answers need no model.
    fn repairing(&self, config: Option<&Config>, old: &TakeReader) -> anyhow::Result<Repair> {
        let models = config
            .map(|config| config.models.clone())
            .unwrap_or_default();
        let kind = match self.smooth {
            true => Kind::Offline,
            false => Kind::Live,
        };
        if let Some(name) = &self.repair {
            return Repair::find(name, kind, &models)
                .map_err(|refused| usage(format!("--repair: {refused}")));
        }
        let recorded = || parse_toml::<posefuse_fusion::Config>(&old.header().config_toml).ok();
        let fusion = config.map(|config| config.fusion.clone()).or_else(recorded);
        let name = fusion.unwrap_or_default().repair.model;
        if !self.changes() {
            return Ok(Repair { name, model: None });
        }
        Repair::find(&name, kind, &models).or_else(|refused| {
            output::warn(&format!("a simple model fills in: {refused}"));
            Ok(Repair { name, model: None })
        })
    }

    /// Whether other frames may come than the recorded ones.
    fn changes(&self) -> bool {
        let other = self.config.is_some() || self.calibration.is_some();
        other || self.smooth || self.repair.is_some()
    }
}

/// Reads a calibration file. A mistake in it is a wrong usage.
pub(crate) fn read_calibration(
    file: &std::path::Path,
) -> anyhow::Result<posefuse_skeleton::Calibration> {
    let shown = file.display();
    let text = std::fs::read_to_string(file)
        .with_context(|| format!("the calibration `{shown}` cannot be read"));
    let text = text.map_err(|error| usage(format!("{error:#}")))?;
    posefuse_calibration::from_toml(&text)
        .map_err(|error| usage(format!("the calibration `{shown}`: {error}")))
}

fn view(report: &RefuseReport, located: &Located) -> RefuseView {
    let path = located.folder.join(format!("{}.mcap", report.take.name));
    RefuseView {
        take: TakeView {
            path: Some(path.display().to_string()),
            ..TakeView::from(&report.take)
        },
        inputs: report.inputs,
        recorded_frames: report.recorded_frames,
        frames: report.frames,
        identical: report.identical,
        from_snapshot: report.from_snapshot,
        same_until: report
            .first_difference
            .as_ref()
            .map(|difference| difference.after),
    }
}

/// Nobody is fused before it is known where the sensors stand.
fn nothing_fused(args: &RefuseArgs) -> anyhow::Result<()> {
    let none = paint(Style::Doubtful, "no frame was fused");
    if args.calibration.is_some() {
        line(format!(
            "{none}: the calibration knows none of the take's sensors, or nobody was in view"
        ))?;
        return Ok(());
    }
    let folder = args.takes.named();
    let folder = folder.map_or_else(String::new, |dir| format!(" --takes {}", dir.display()));
    let take = args.take.display();
    line(format!(
        "{none}: there is no calibration in it; make one from its walk, then fuse it again:"
    ))?;
    line(format!(
        "     posefuse calibrate --from {take} --out room.toml{folder}"
    ))?;
    line(format!(
        "     posefuse refuse {take} --calibration room.toml{folder}"
    ))?;
    Ok(())
}

fn tell(report: &RefuseReport, located: &Located, args: &RefuseArgs) -> anyhow::Result<()> {
    let name = &report.take.name;
    line(format!(
        "take {} from {}: {} frames out of {} inputs (before: {} frames)",
        paint(Style::Bold, name),
        located.name,
        report.frames,
        report.inputs,
        report.recorded_frames,
    ))?;
    line(format!(
        "     {}",
        located.folder.join(format!("{name}.mcap")).display()
    ))?;
    if report.frames == 0 && report.recorded_frames == 0 {
        return nothing_fused(args);
    }
    match &report.first_difference {
        None => line(format!(
            "{}: every frame is byte for byte the recorded one",
            paint(Style::Good, "identical")
        ))?,
        Some(first) => line(format!(
            "{}: frame {} is the first that differs",
            paint(Style::Bold, "different"),
            first.after + 1
        ))?,
    }
    if args.changes() && !report.from_snapshot {
        output::note(
            "other settings begin without what was known before the take: people may have other numbers than in it",
        );
    }
    if !args.changes() && !report.identical {
        output::warn(if report.from_snapshot {
            "with the same settings and build every frame should be the same; please report this take"
        } else {
            "the take was made by another build or began mid-stream without its snapshot, so the engine began cold"
        });
    }
    Ok(())
}
