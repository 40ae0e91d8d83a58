//! `posefuse demo`: the whole product in one command. A server and simulated agents run as processes of their own;
//! this process conducts them over the same `Room` service that every client has.

mod browser;
mod fleet;
mod live;
mod scratch;

use std::path::PathBuf;
use std::time::Duration;

use anyhow::bail;
use clap::Args;
use posefuse_proto::v1::{CalibrateRequest, StartTakeRequest, StopTakeRequest, Take};
use serde::Serialize;
use tokio_util::sync::CancellationToken;
use tonic::Code;

use self::fleet::Fleet;
use super::{calibrate, record};
use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{Style, line, note, paint};
use crate::room::{self, Room};
use crate::takes_folder::TakesFolder;
use crate::values;
use crate::views::{CalibrationView, TakeView};
use crate::{output, shutdown};

/// Show everything at once: a server and simulated sensors as processes of their own, calibrated from the simulated
/// person's walk, recorded, on a dashboard. Ctrl-C ends all of it
#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// How many people are in the room
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::whole(1u32, 6))]
    pub(crate) people: u32,
    /// How many sensors, each with an agent of its own
    #[arg(long, value_name = "N", default_value = "4", value_parser = values::whole(1u32, 16))]
    pub(crate) sensors: u32,
    /// Record for this long, then end
    #[arg(long, value_name = "S", value_parser = values::seconds)]
    seconds: Option<f64>,
    /// How long the calibration watches the walk, instead of until every sensor has seen enough
    #[arg(long, value_name = "S", value_parser = values::seconds)]
    walk: Option<f64>,
    /// Leave it unknown where the sensors stand, to calibrate from the dashboard; records only with --seconds
    #[arg(long)]
    no_calibrate: bool,
    /// Do not open a browser
    #[arg(long)]
    no_browser: bool,
    /// What everything random is drawn from
    #[arg(long, value_name = "NUMBER", default_value = "1", value_parser = values::whole(0, u64::MAX))]
    pub(crate) seed: u64,
    /// Where the server listens; a taken port is replaced by a free one
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7400", value_parser = values::listen)]
    pub(crate) listen: std::net::SocketAddr,
    #[command(flatten)]
    pub(crate) takes: TakesFolder,
}

/// What `--json` prints at the end.
#[derive(Serialize)]
struct DemoView {
    url: String,
    calibration: Option<CalibrationView>,
    take: Option<TakeView>,
    /// Agents that ended before they were to.
    lost_agents: Vec<String>,
}

/// How long the sensors may take to be live.
const LIVE_WITHIN: Duration = Duration::from_secs(20);
/// How long a signal that went to the whole group may take to reach this process.
const HEAR_OF_SIGNAL: Duration = Duration::from_millis(50);

pub(crate) async fn run(args: &DemoArgs, global: &Global) -> anyhow::Result<Outcome> {
    let stop = shutdown::on_signal()?;
    let mut fleet = Fleet::new(args, global.verbose > 0)?;
    let mut show = Show::default();
    let mut shown = show.run(args, global, &mut fleet, &stop).await;
    if shown.is_err() {
        // A Ctrl-C that meets a child at its very start ends it before we have heard of it ourselves.
        tokio::time::sleep(HEAR_OF_SIGNAL).await;
    }
    if stop.is_cancelled() {
        shown = Ok(());
        note("\nending: the take, the agents, the server");
    }
    let stopped = show.end_take().await;
    show.lost_agents = fleet.lost().to_vec();
    let unclean = fleet.stop().await;
    if shown.is_err() && stopped.is_err() {
        note(show.left_behind(args));
    }
    shown?;
    stopped?;
    for name in unclean {
        output::warn(&format!("{name} did not end by itself and was killed"));
    }
    show.report(args, global)
}

/// What has come of the demo so far.
#[derive(Default)]
struct Show {
    url: String,
    folder: PathBuf,
    room: Option<Room>,
    calibration: Option<CalibrationView>,
    recording: bool,
    take: Option<Take>,
    lost_agents: Vec<String>,
}

impl Show {
    /// From the first process to the end of the show.
    async fn run(
        &mut self,
        args: &DemoArgs,
        global: &Global,
        fleet: &mut Fleet,
        stop: &CancellationToken,
    ) -> anyhow::Result<()> {
        let server = tokio::select! {
            () = stop.cancelled() => return Ok(()),
            server = fleet.start_server() => server?,
        };
        self.url = server.url.to_string();
        self.folder = server.takes;
        self.announce(global);
        fleet.start_agents(&server.url)?;
        let mut room = room::connect(&server.url).await?;
        self.room = Some(room.clone());
        tokio::select! {
            () = stop.cancelled() => return Ok(()),
            ready = live::until_all_live(&mut room, args.sensors as usize, LIVE_WITHIN) => ready?,
            ended = fleet.any_ended() => return Err(ended.error),
        }
        note(match args.sensors {
            1 => "1 sensor is live, an agent process of its own".to_owned(),
            n => format!("{n} sensors are live, each an agent process of its own"),
        });
        if !args.no_browser && !browser::open(&self.url) {
            note("no browser could be opened here; open the address above yourself");
        }
        if !args.no_calibrate {
            tokio::select! {
                calibrated = self.calibrate(&mut room, args, global, stop) => calibrated?,
                ended = fleet.any_ended() => return Err(ended.error),
            }
        }
        if stop.is_cancelled() {
            return Ok(());
        }
        // Nobody can calibrate while a take is recorded.
        if args.no_calibrate && args.seconds.is_none() {
            note(format!(
                "press Calibrate on the dashboard, or run: posefuse calibrate --server {}\nthen Record; Ctrl-C ends the demo",
                self.url
            ));
        } else {
            let take = room.start_take(take_request(args)).await;
            let take = take.map_err(|status| room::refused(&status))?.into_inner();
            note(format!("recording `{}`; Ctrl-C ends the demo", take.name));
            self.recording = true;
        }
        live::show(
            &mut room,
            args.seconds.map(Duration::from_secs_f64),
            fleet,
            stop,
        )
        .await
    }

    /// Says where to look, so that nobody can miss it.
    fn announce(&self, global: &Global) {
        let address = format!("  dashboard   {}  ", self.url);
        if global.json {
            return note(address);
        }
        let rule = "-".repeat(address.len());
        // A stdout that is closed already shows itself at the end again.
        let _ = line(format!("{rule}\n{}\n{rule}", paint(Style::Bold, &address)));
    }

    /// Calibrates from the person's walk; if that fails, once more, for twice as long where a length was given.
    async fn calibrate(
        &mut self,
        room: &mut Room,
        args: &DemoArgs,
        global: &Global,
        stop: &CancellationToken,
    ) -> anyhow::Result<()> {
        for times in [1.0, 2.0] {
            let seconds = args.walk.map(|seconds| times * seconds);
            note(match seconds {
                Some(seconds) => format!("calibrating from the simulated walk, {seconds:.0} s"),
                None => "calibrating from the simulated walk, until every sensor has seen enough"
                    .to_owned(),
            });
            let request = CalibrateRequest {
                seconds: seconds.unwrap_or(0.0),
                dry_run: false,
            };
            let Some(result) = calibrate::live::follow(room, request, stop).await? else {
                return Ok(());
            };
            let view = CalibrationView::from(&result);
            if !global.json {
                calibrate::verdict::summary(&view)?;
            }
            let failed = view.verdict == "failed";
            self.calibration = Some(view);
            if !failed {
                return Ok(());
            }
        }
        let reasons = self
            .calibration
            .as_ref()
            .map_or_else(String::new, |c| c.reasons.join("; "));
        bail!(
            "the simulated sensors could not be calibrated: {reasons}; try --walk 60 or another --seed"
        )
    }

    /// Ends the take, if one was begun.
    async fn end_take(&mut self) -> anyhow::Result<()> {
        if !self.recording {
            return Ok(());
        }
        let Some(room) = &mut self.room else {
            return Ok(());
        };
        match room.stop_take(StopTakeRequest {}).await {
            Ok(take) => self.take = Some(take.into_inner()),
            // Somebody has pressed Stop on the dashboard: the take is whole and among the takes.
            Err(status) if status.code() == Code::FailedPrecondition => {}
            Err(status) => return Err(room::refused(&status)),
        }
        Ok(())
    }

    /// What becomes of a take that the server could not end.
    fn left_behind(&self, args: &DemoArgs) -> String {
        let folder = folder_option(args);
        format!(
            "the take it was recording is kept up to its last moments in {}: it is repaired when `posefuse server{folder}` \
             starts next, or at once by `posefuse takes recover{folder}`",
            crate::paths::shown(&self.folder)
        )
    }

    /// Says what is there now and how to look at it again.
    fn report(self, args: &DemoArgs, global: &Global) -> anyhow::Result<Outcome> {
        let Some(take) = &self.take else {
            note(if self.recording {
                "the take was stopped from elsewhere before; `posefuse takes` lists it"
            } else {
                "ended before a take was begun; nothing was recorded"
            });
            return Ok(Outcome::Done);
        };
        let file = self.folder.join(format!("{}.mcap", take.name));
        if global.json {
            let view = TakeView {
                path: Some(file.display().to_string()),
                ..TakeView::from(take)
            };
            output::json_pretty(&DemoView {
                url: self.url,
                calibration: self.calibration,
                take: Some(view),
                lost_agents: self.lost_agents.clone(),
            })?;
        } else {
            record::summary(take, &self.folder.display().to_string())?;
            again(args, &take.name)?;
        }
        match (self.lost_agents.is_empty(), record::outcome(take)) {
            (true, outcome) => Ok(outcome),
            (false, _) => Ok(Outcome::DoneWithLoss),
        }
    }
}

fn take_request(args: &DemoArgs) -> StartTakeRequest {
    StartTakeRequest {
        name: String::new(),
        slate: "demo".to_owned(),
        notes: format!(
            "{} (simulated), {}, seed {}",
            output::sensors(args.sensors as usize),
            output::people(args.people),
            args.seed
        ),
    }
}

/// ` --takes DIR`, if the demo was given one.
fn folder_option(args: &DemoArgs) -> String {
    let named = args.takes.named();
    named.map_or_else(String::new, |dir| format!(" --takes {}", dir.display()))
}

/// How to look at the take again.
fn again(args: &DemoArgs, take: &str) -> anyhow::Result<()> {
    let folder = folder_option(args);
    line(format!(
        "\nsee it again   posefuse server{folder}   and pick it from the takes on the dashboard"
    ))?;
    line(format!("what is in it  posefuse takes show {take}{folder}"))?;
    line(format!(
        "as files       posefuse export {take} --preset blender{folder}   (or unity, unreal, opensim ...)"
    ))?;
    line(format!("fuse it again  posefuse refuse {take}{folder}"))?;
    line("in Foxglove    open the .mcap file: the people and the sensors move in its 3D panel")?;
    Ok(())
}
