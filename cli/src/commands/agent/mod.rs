//! `posefuse agent`: the agent of one sensor, or of something that takes a sensor's place.

mod azure;
mod nite;
mod openni;
mod osc;
mod replay;

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};
use posefuse_agent::{
    AgentConfig, AgentError, AgentReport, Clock, End, Parts, SourceConfig, SystemClock, source,
};
use posefuse_simulator::{Layout, Scenario};
use serde::Serialize;

use self::azure::AzureArgs;
use self::nite::NiteArgs;
use self::openni::OpenNiArgs;
use self::osc::OscArgs;
use self::replay::ReplayArgs;
use crate::failure::{Outcome, usage};
use crate::global::Global;
use crate::takes_folder::TakesFolder;
use crate::values;
use crate::{output, shutdown};

/// Run the agent of one sensor. It may start before its server, and comes back by itself when the server does
#[derive(Debug, Args)]
pub(crate) struct AgentArgs {
    #[command(subcommand)]
    source: Source,
    #[command(flatten)]
    common: Common,
}

/// What every agent takes.
#[derive(Debug, Args)]
struct Common {
    /// The sensor's name, unique in the room
    #[arg(long, global = true, value_name = "NAME")]
    name: Option<String>,
    /// The server of the room
    #[arg(long, global = true, value_name = "URL", env = "POSEFUSE_SERVER", default_value = crate::room::DEFAULT_URL)]
    server: crate::room::ServerUrl,
    /// When the source has ended: how long to go on delivering what the server has not got yet
    #[arg(long, global = true, value_name = "S", default_value = "60", value_parser = values::seconds)]
    drain: f64,
    /// End when stdin ends
    #[arg(long, global = true, hide = true)]
    exit_with_parent: bool,
}

/// Where frames come from.
#[derive(Debug, Subcommand)]
enum Source {
    /// A depth camera read through OpenNI2 (Kinect v1, Xtion, Astra ...), or a recording of one (.oni)
    #[command(name = "openni")]
    OpenNi(OpenNiArgs),
    /// An Azure Kinect or Femto with Microsoft's Body Tracking SDK, where that is installed
    Azure(AzureArgs),
    /// A sensor with PrimeSense's NiTE 2.2, where that is installed
    Nite(NiteArgs),
    /// Skeletons that another program sends by OSC
    Osc(OscArgs),
    /// A sensor of a simulated room
    Sim(SimArgs),
    /// A sensor of a recorded take, played back
    Take(TakeArgs),
    /// One Kinect of a recorded session with two Kinects v2 (CSV)
    Csv(CsvArgs),
}

/// Which room, and which of its sensors.
#[derive(Debug, Args)]
struct SimArgs {
    /// Which of the room's sensors this is, from 1
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::whole(1u32, 64))]
    sensor: u32,
    /// How many sensors the room has
    #[arg(long, value_name = "N", default_value = "4", value_parser = values::whole(1u32, 64))]
    sensors: u32,
    /// How many people are in the room
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::whole(0u32, 8))]
    people: u32,
    /// What everything random is drawn from; the same for all agents of a room
    #[arg(long, value_name = "NUMBER", default_value = "1", value_parser = values::whole(0, u64::MAX))]
    seed: u64,
    /// Where the sensors stand
    #[arg(long, value_enum, default_value_t)]
    layout: LayoutArg,
    /// Everything about the room, as TOML, instead of the options above
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sensors", "people", "seed", "layout"])]
    scenario: Option<PathBuf>,
    /// When the simulation begins, ns since 1970: the same for all agents of a room [default: when the people last
    /// began their round of some minutes anew, so that agents started at any time see the same]
    #[arg(long, value_name = "NS", value_parser = values::whole(0, i64::MAX))]
    epoch_ns: Option<i64>,
    /// Render what a depth camera would see, and track the people in that, instead of skeletons with a tracker's usual errors
    #[arg(long, value_enum, value_name = "CAMERA", num_args = 0..=1, default_missing_value = "structured-light")]
    depth: Option<OpticsArg>,
}

/// Kinds of simulated depth cameras.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum OpticsArg {
    /// Kinect v1 and its like.
    StructuredLight,
    /// Kinect v2 and its like.
    TimeOfFlight,
}

impl From<OpticsArg> for source::SimOptics {
    fn from(optics: OpticsArg) -> Self {
        match optics {
            OpticsArg::StructuredLight => Self::StructuredLight,
            OpticsArg::TimeOfFlight => Self::TimeOfFlight,
        }
    }
}

/// Where simulated sensors stand.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum LayoutArg {
    /// All around.
    #[default]
    Ring,
    /// Over 100 degrees, in front.
    Arc,
}

impl From<LayoutArg> for Layout {
    fn from(layout: LayoutArg) -> Self {
        match layout {
            LayoutArg::Ring => Self::Ring,
            LayoutArg::Arc => Self::Arc,
        }
    }
}

/// Which take, and which of its sensors.
#[derive(Debug, Args)]
struct TakeArgs {
    /// The take: its name or its file
    take: PathBuf,
    /// Which of its sensors; also the name unless --name says another
    #[arg(long, value_name = "SENSOR")]
    sensor: String,
    #[command(flatten)]
    replay: ReplayArgs,
    #[command(flatten)]
    takes: TakesFolder,
}

/// Which recording, and which of its Kinects.
#[derive(Debug, Args)]
struct CsvArgs {
    /// The recording
    file: PathBuf,
    /// Which Kinect: 1 or 2, or its computer's address as the file has it
    #[arg(long, value_name = "WHICH", default_value = "1")]
    kinect: String,
    #[command(flatten)]
    replay: ReplayArgs,
    /// Hand frames on as they were captured, without the delays of the recording's logger
    #[arg(long)]
    prompt: bool,
}

/// What `--json` prints at the end.
#[derive(Serialize)]
struct ReportView {
    name: String,
    end: String,
    captured: u64,
    delivered: u64,
    dropped: u64,
    unacknowledged: u64,
    connections: u64,
}

pub(crate) async fn run(args: &AgentArgs, global: &Global) -> anyhow::Result<Outcome> {
    let stop = shutdown::service(args.common.exit_with_parent)?;
    let stopped = async move { stop.cancelled().await };
    let (config, parts) = (config(args)?, Parts::system());
    let name = config.name.clone();
    let report = posefuse_agent::run(config, parts, stopped).await;
    let report = report.map_err(|error| match error {
        AgentError::Config { reason } => usage(reason),
        other => other.into(),
    })?;
    tell(&name, &report, global)?;
    Ok(if report.dropped > 0 || report.unacknowledged > 0 {
        Outcome::DoneWithLoss
    } else {
        Outcome::Done
    })
}

fn config(args: &AgentArgs) -> anyhow::Result<AgentConfig> {
    let (source, usual_name) = match &args.source {
        Source::Sim(sim) => {
            let room = sim.config()?;
            let config = match sim.depth {
                Some(optics) => {
                    SourceConfig::SimDepth(source::SimDepthConfig::new(room, optics.into()))
                }
                None => SourceConfig::Sim(room),
            };
            (config, Some(format!("sim{}", sim.sensor)))
        }
        Source::Csv(csv) => (SourceConfig::Csv(csv.config()), None),
        Source::OpenNi(openni) => (SourceConfig::OpenNi(openni.config()), None),
        Source::Azure(azure) => (SourceConfig::Azure(azure.config()), None),
        Source::Nite(nite) => (SourceConfig::Nite(nite.config()), None),
        Source::Osc(osc) => (SourceConfig::Osc(osc.config()), None),
        Source::Take(take) => (
            SourceConfig::Take(take.config()?),
            Some(take.sensor.clone()),
        ),
    };
    let name = args.common.name.clone().or(usual_name);
    let name = name.ok_or_else(|| usage("the sensor needs a name: --name left, for example"))?;
    let mut config = AgentConfig::new(args.common.server.uri().clone(), name, source);
    config.drain = Duration::from_secs_f64(args.common.drain);
    Ok(config)
}

impl SimArgs {
    fn config(&self) -> anyhow::Result<source::SimConfig> {
        let scenario = match &self.scenario {
            Some(file) => read_scenario(file)?,
            None => Scenario {
                seed: self.seed,
                people: self.people as usize,
                sensors: self.sensors as usize,
                layout: self.layout.into(),
                ..Scenario::default()
            },
        };
        if self.sensor as usize > scenario.sensors {
            let (sensor, sensors) = (self.sensor, scenario.sensors);
            return Err(usage(format!(
                "--sensor {sensor}: the room has {}, 1 to {sensors}; see --sensors",
                output::sensors(sensors)
            )));
        }
        let epoch_ns = match self.epoch_ns {
            Some(epoch_ns) => epoch_ns,
            None => source::shared_epoch_unix_ns(&scenario, SystemClock::new().unix_ns())
                .map_err(usage)?,
        };
        Ok(source::SimConfig {
            sensor: self.sensor as usize - 1,
            epoch_unix_ns: Some(epoch_ns),
            scenario,
        })
    }
}

/// Reads a scenario. A mistake in it is a wrong usage.
pub(crate) fn read_scenario(file: &std::path::Path) -> anyhow::Result<Scenario> {
    let shown = file.display();
    let text = std::fs::read_to_string(file)
        .map_err(|error| usage(format!("the scenario `{shown}` cannot be read: {error}")))?;
    posefuse_fusion::parse_toml(&text)
        .map_err(|error| usage(format!("the scenario `{shown}`, {error}")))
}

impl TakeArgs {
    fn config(&self) -> anyhow::Result<source::TakeConfig> {
        let file = self.takes.find(&self.take)?.file();
        Ok(source::TakeConfig {
            replay: self.replay.config(),
            ..source::TakeConfig::new(file, &self.sensor)
        })
    }
}

impl CsvArgs {
    fn config(&self) -> source::CsvConfig {
        source::CsvConfig {
            replay: self.replay.config(),
            prompt: self.prompt,
            ..source::CsvConfig::new(&self.file, &self.kinect)
        }
    }
}

fn tell(name: &str, report: &AgentReport, global: &Global) -> anyhow::Result<()> {
    let end = match &report.end {
        End::SourceEnded => "the source ended".to_owned(),
        End::ShutDown => "asked to end".to_owned(),
        End::Stopped(reason) => format!("stopped by the server: {reason}"),
    };
    if global.json {
        return output::json(&ReportView {
            name: name.to_owned(),
            end,
            captured: report.captured,
            delivered: report.delivered,
            dropped: report.dropped,
            unacknowledged: report.unacknowledged,
            connections: report.connections,
        });
    }
    output::line(format!(
        "{name}: {end}; {} frames captured, {} delivered",
        report.captured, report.delivered
    ))?;
    if report.dropped > 0 {
        output::warn(&format!(
            "{} frames were dropped while no server took them",
            report.dropped
        ));
    }
    if report.unacknowledged > 0 {
        let why = report
            .trouble
            .as_deref()
            .map_or_else(String::new, |trouble| format!(": {trouble}"));
        output::warn(&format!(
            "{} frames were never acknowledged by the server{why}",
            report.unacknowledged
        ));
    }
    Ok(())
}
