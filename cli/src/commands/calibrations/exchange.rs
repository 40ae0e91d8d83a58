//! Calibrations to and from other programs.

use std::io::Read;
use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use posefuse_proto::v1::{
    Calibration, CalibrationFormat, ExportCalibrationRequest, GetStatusRequest,
    ImportCalibrationRequest,
};

use super::print_poses;
use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{self, line};
use crate::room::{self, Room};

/// The forms of calibration files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Our own, to read and edit
    Toml,
    /// The same as JSON
    Json,
    /// ROS static transforms: a tf2_msgs/TFMessage in YAML
    Tf2,
    /// OpenCV's FileStorage in YAML: R and t of each sensor, room to sensor
    Opencv,
}

impl From<Form> for CalibrationFormat {
    fn from(form: Form) -> Self {
        match form {
            Form::Toml => Self::Toml,
            Form::Json => Self::Json,
            Form::Tf2 => Self::Tf2Yaml,
            Form::Opencv => Self::OpencvYaml,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// Its name; the one in force unless given
    name: Option<String>,
    /// In which form; TOML unless given, JSON with --json
    #[arg(long, value_enum)]
    format: Option<Form>,
    /// Write it to this file instead of printing it
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) async fn export(
    client: &mut Room,
    args: &ExportArgs,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let usual = if global.json { Form::Json } else { Form::Toml };
    let request = ExportCalibrationRequest {
        name: args.name.clone().unwrap_or_default(),
        format: CalibrationFormat::from(args.format.unwrap_or(usual)).into(),
    };
    let exported = client.export_calibration(request).await;
    let file = exported
        .map_err(|status| room::refused(&status))?
        .into_inner();
    match &args.output {
        None => line(file.text.trim_end())?,
        Some(path) => {
            let shown = path.display();
            std::fs::write(path, &file.text)
                .with_context(|| format!("the calibration cannot be written to `{shown}`"))?;
            output::note(format!("written to {shown}"));
        }
    }
    Ok(Outcome::Done)
}

#[derive(Debug, Args)]
pub(super) struct ImportArgs {
    /// The file; `-` is standard input
    file: PathBuf,
    /// In which form it is; found out unless given
    #[arg(long, value_enum)]
    format: Option<Form>,
    /// Read and check it, but leave the calibration in force as it is
    #[arg(long)]
    dry_run: bool,
}

pub(super) async fn import(
    client: &mut Room,
    args: &ImportArgs,
    global: &Global,
) -> anyhow::Result<Outcome> {
    let shown = args.file.display();
    let text = if args.file.as_os_str() == "-" {
        let mut text = String::new();
        std::io::stdin().read_to_string(&mut text).map(|_| text)
    } else {
        std::fs::read_to_string(&args.file)
    };
    let text = text.with_context(|| format!("the calibration `{shown}` cannot be read"))?;
    let format = args
        .format
        .map_or(CalibrationFormat::Unspecified, CalibrationFormat::from);
    let request = ImportCalibrationRequest {
        text,
        format: format.into(),
        dry_run: args.dry_run,
    };
    let imported = client.import_calibration(request).await;
    let imported = imported
        .map_err(|status| room::refused(&status))
        .with_context(|| format!("`{shown}` is not imported"))?
        .into_inner();
    print_poses(&imported.sensors, global)?;
    name_strangers(client, &imported).await?;
    if !global.json {
        line(if args.dry_run {
            "it can be imported; the calibration in force is as it was"
        } else {
            "in force now"
        })?;
    }
    Ok(Outcome::Done)
}

/// Says which sensors the calibration places that are not here, and which are here that it does not place.
async fn name_strangers(client: &mut Room, imported: &Calibration) -> anyhow::Result<()> {
    let status = client.get_status(GetStatusRequest {}).await;
    let status = status
        .map_err(|status| room::refused(&status))?
        .into_inner();
    let here = status.sensors.into_iter().filter_map(|sensor| sensor.info);
    let here: Vec<String> = here.map(|info| info.name).collect();
    let placed: Vec<&str> = imported.sensors.iter().map(|s| s.sensor.as_str()).collect();
    let absent: Vec<&str> = placed
        .iter()
        .filter(|name| !here.iter().any(|here| here == *name))
        .copied()
        .collect();
    let unplaced: Vec<&str> = here
        .iter()
        .map(String::as_str)
        .filter(|name| !placed.contains(name))
        .collect();
    if !unplaced.is_empty() {
        output::warn(&format!(
            "it does not place {}: what they see is not used; calibrate, or name them in the file",
            unplaced.join(", ")
        ));
    }
    if !here.is_empty() && !absent.is_empty() {
        output::warn(&format!(
            "it places {}, which this server has not seen yet",
            absent.join(", ")
        ));
    }
    Ok(())
}
