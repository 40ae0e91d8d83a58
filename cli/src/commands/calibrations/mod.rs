//! `posefuse calibrations`: those that a server keeps, and calibrations to and from other programs.

mod exchange;
mod room_frame;

use clap::{Args, Subcommand};
use posefuse_proto::v1::{
    CompareCalibrationsRequest, GetCalibrationRequest, ListCalibrationsRequest,
    RestoreCalibrationRequest, SensorPose, StoredCalibration,
};

use super::calibrate::verdict::{headed, sensors as sensor_table};
use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{self, Style, line, paint, print_table};
use crate::room::{self, DEFAULT_URL, Room, ServerUrl};
use crate::views::{KeptView, MoveView, SensorPoseView};

/// List, compare, restore, export and import calibrations of a server, or move its room's origin
///
/// Every calibration that was put in force is kept, the last hundred, under the time when it was.
#[derive(Debug, Args)]
pub(crate) struct CalibrationsArgs {
    #[command(subcommand)]
    action: Option<Action>,
    /// The server of the room
    #[arg(long, value_name = "URL", env = "POSEFUSE_SERVER", default_value = DEFAULT_URL, global = true)]
    server: ServerUrl,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List those that are kept, the newest first
    List,
    /// Say where the sensors stand in one of them
    Show {
        /// Its name; the one in force unless given
        name: Option<String>,
    },
    /// Say how far each sensor stands from where another calibration has it
    Compare {
        /// The name of the earlier one
        before: String,
        /// The name of the later one; the one in force unless given
        after: Option<String>,
    },
    /// Put one of them in force again
    Restore {
        /// Its name
        name: String,
    },
    /// Write one in a form that other programs read
    Export(exchange::ExportArgs),
    /// Put one in force that was exported or that another program wrote
    Import(exchange::ImportArgs),
    /// Set the room's origin and heading by hand: all sensors are moved together
    Move(room_frame::MoveArgs),
}

pub(crate) async fn run(args: &CalibrationsArgs, global: &Global) -> anyhow::Result<Outcome> {
    let mut client = room::connect(&args.server).await?;
    let client = &mut client;
    match args.action.as_ref().unwrap_or(&Action::List) {
        Action::List => list(client, global).await,
        Action::Show { name } => show(client, name.as_deref(), global).await,
        Action::Compare { before, after } => {
            compare(client, before, after.as_deref(), global).await
        }
        Action::Restore { name } => restore(client, name, global).await,
        Action::Export(args) => exchange::export(client, args, global).await,
        Action::Import(args) => exchange::import(client, args, global).await,
        Action::Move(args) => room_frame::run(client, args, global).await,
    }
}

async fn kept(client: &mut Room) -> anyhow::Result<Vec<StoredCalibration>> {
    let list = client.list_calibrations(ListCalibrationsRequest {}).await;
    let list = list.map_err(|status| room::refused(&status))?;
    Ok(list.into_inner().calibrations)
}

async fn list(client: &mut Room, global: &Global) -> anyhow::Result<Outcome> {
    let views: Vec<KeptView> = kept(client).await?.iter().map(KeptView::from).collect();
    if global.json {
        output::json_pretty(&views)?;
        return Ok(Outcome::Done);
    }
    if views.is_empty() {
        line("no calibration yet; `posefuse calibrate` makes one")?;
        return Ok(Outcome::Done);
    }
    let head = ["calibration", "", "verdict", "made by", "floor", "sensors"];
    print_table(&headed(&head, views.iter().map(row)))?;
    for view in views.iter().filter(|view| !view.trouble.is_empty()) {
        output::warn(&format!("{} cannot be used: {}", view.name, view.trouble));
    }
    Ok(Outcome::Done)
}

fn row(view: &KeptView) -> Vec<String> {
    let verdict = match view.verdict.as_str() {
        "passed" => paint(Style::Good, "passed"),
        "weak" => paint(Style::Doubtful, "weak"),
        _ if !view.trouble.is_empty() => paint(Style::Bad, "unreadable"),
        _ => "-".to_owned(),
    };
    let in_force = if view.in_force { "in force" } else { "" };
    vec![
        view.name.clone(),
        paint(Style::Bold, in_force),
        verdict,
        view.method.clone(),
        view.floor.clone(),
        view.sensors.join(", "),
    ]
}

async fn show(client: &mut Room, name: Option<&str>, global: &Global) -> anyhow::Result<Outcome> {
    let calibration = match name {
        None => {
            let current = client.get_calibration(GetCalibrationRequest {}).await;
            current
                .map_err(|status| room::refused(&status))?
                .into_inner()
        }
        Some(name) => {
            let all = kept(client).await?;
            let found = all.into_iter().find(|kept| kept.name == name);
            let found = found.ok_or_else(|| {
                anyhow::anyhow!(
                    "no calibration is kept as `{name}`; `posefuse calibrations` lists them"
                )
            })?;
            found.calibration.ok_or_else(|| {
                anyhow::anyhow!("the calibration `{name}` cannot be used: {}", found.trouble)
            })?
        }
    };
    print_poses(&calibration.sensors, global)?;
    Ok(Outcome::Done)
}

/// Where sensors stand, as a table or JSON.
fn print_poses(poses: &[SensorPose], global: &Global) -> anyhow::Result<()> {
    let views: Vec<SensorPoseView> = poses.iter().map(SensorPoseView::from).collect();
    if global.json {
        return output::json_pretty(&views);
    }
    print_table(&sensor_table(&views))?;
    Ok(())
}

async fn compare(
    client: &mut Room,
    before: &str,
    after: Option<&str>,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let request = CompareCalibrationsRequest {
        before: before.to_owned(),
        after: after.unwrap_or_default().to_owned(),
    };
    let compared = client.compare_calibrations(request).await;
    let compared = compared
        .map_err(|status| room::refused(&status))?
        .into_inner();
    let views: Vec<MoveView> = compared.moves.iter().map(MoveView::from).collect();
    if global.json {
        output::json_pretty(&views)?;
        return Ok(Outcome::Done);
    }
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
    };
    let row = |view: &MoveView| {
        let missing = match view.missing_in.as_str() {
            "" => String::new(),
            which => format!("not in the one {which}"),
        };
        vec![
            view.sensor.clone(),
            number(view.moved_mm, 1),
            number(view.moved_deg, 2),
            number(view.moved_ms, 1),
            missing,
        ]
    };
    let head = ["sensor", "moved mm", "turned °", "later ms", ""];
    print_table(&headed(&head, views.iter().map(row)))?;
    line(paint(
        Style::Faint,
        "both rooms are laid over each other so that most sensors agree; of two sensors nobody can tell which has moved",
    ))?;
    Ok(Outcome::Done)
}

async fn restore(client: &mut Room, name: &str, global: &Global) -> anyhow::Result<Outcome> {
    let request = RestoreCalibrationRequest {
        name: name.to_owned(),
    };
    let restored = client.restore_calibration(request).await;
    let restored = restored
        .map_err(|status| room::refused(&status))?
        .into_inner();
    print_poses(&restored.sensors, global)?;
    if !global.json {
        line(format!("`{name}` is in force"))?;
    }
    Ok(Outcome::Done)
}
