//! `posefuse takes`: the takes of a folder, or of a server's.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, Subcommand};
use posefuse_proto::v1::ListTakesRequest;
use posefuse_session::{
    Catalogue, DiskStorage, Recovery, RecoveryOutcome, Storage, TakeReader, Topic, recover,
};
use serde::Serialize;

use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{Style, bytes, duration, line, paint, people};
use crate::room::{self, ServerUrl};
use crate::takes_folder::TakesFolder;
use crate::views::TakeView;
use crate::{output, paths};

/// List, show and repair takes, in a folder of this machine or of a server
#[derive(Debug, Args)]
pub(crate) struct TakesArgs {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    folder: TakesFolder,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the takes, the latest first
    List {
        /// Those of this server instead of a folder's
        #[arg(long, value_name = "URL")]
        server: Option<ServerUrl>,
    },
    /// Say everything about one take
    Show {
        /// Its name or its file
        take: PathBuf,
    },
    /// Repair takes that were cut off. A server does so by itself when it starts
    Recover,
    /// Print the folder with takes
    Path,
}

pub(crate) fn run(args: &TakesArgs, global: &Global) -> anyhow::Result<Outcome> {
    match args
        .action
        .as_ref()
        .unwrap_or(&Action::List { server: None })
    {
        Action::List {
            server: Some(server),
        } => super::block_on(list_of_server(server, global)),
        Action::List { server: None } => list(&args.folder, global),
        Action::Show { take } => show(&args.folder, take, global),
        Action::Recover => repair(&args.folder, global),
        Action::Path => {
            line(args.folder.path().display().to_string())?;
            Ok(Outcome::Done)
        }
    }
}

fn list(folder: &TakesFolder, global: &Global) -> anyhow::Result<Outcome> {
    let path = folder.path();
    let takes = if path.is_dir() {
        Catalogue::list(&DiskStorage::for_reading(&path))?
    } else {
        Vec::new()
    };
    let views: Vec<TakeView> = takes
        .iter()
        .map(|info| TakeView {
            path: Some(
                path.join(format!("{}.mcap", info.name))
                    .display()
                    .to_string(),
            ),
            ..TakeView::from(info)
        })
        .collect();
    print(&views, &paths::shown(&path), global)
}

async fn list_of_server(server: &ServerUrl, global: &Global) -> anyhow::Result<Outcome> {
    let (mut client, status) = room::connect_with_status(server).await?;
    let takes = client.list_takes(ListTakesRequest {}).await;
    let takes = takes
        .map_err(|status| room::refused(&status))?
        .into_inner()
        .takes;
    let views: Vec<TakeView> = takes.iter().map(TakeView::from).collect();
    print(
        &views,
        &format!("{} of {server}", status.take_folder),
        global,
    )
}

fn print(takes: &[TakeView], place: &str, global: &Global) -> anyhow::Result<Outcome> {
    if global.json {
        output::json_pretty(&takes)?;
    } else if takes.is_empty() {
        line(format!(
            "no takes yet in {place}; `posefuse record` makes one, `posefuse demo` too"
        ))?;
    } else {
        let head = [
            "take", "state", "length", "frames", "people", "sensors", "size", "slate", "notes",
        ];
        let mut rows = vec![head.map(|cell| paint(Style::Faint, cell)).to_vec()];
        rows.extend(takes.iter().map(row));
        output::print_table(&rows)?;
        for take in takes.iter().filter(|take| take.state == "damaged") {
            output::warn(&format!("{}: {}", take.name, take.trouble));
        }
    }
    Ok(Outcome::Done)
}

fn row(take: &TakeView) -> Vec<String> {
    vec![
        take.name.clone(),
        state(take),
        duration(take.seconds),
        take.frames.to_string(),
        take.people.to_string(),
        take.sensors.len().to_string(),
        bytes(take.bytes),
        take.slate.clone(),
        in_a_line(&take.notes),
    ]
}

/// Notes of several lines would break a table.
fn in_a_line(notes: &str) -> String {
    notes.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn state(take: &TakeView) -> String {
    let style = match take.state {
        "damaged" => Style::Bad,
        "recovered" => Style::Doubtful,
        "recording" => Style::Bold,
        _ => Style::Good,
    };
    paint(style, take.state)
}

/// What `takes show --json` prints.
#[derive(Serialize)]
struct TakeDetails {
    #[serde(flatten)]
    take: TakeView,
    /// Messages by topic.
    messages: Vec<(&'static str, u64)>,
    /// Fused frames as they read back, which must be as many as the take says.
    frames_read: u64,
    calibrated: Vec<String>,
    events: Vec<EventView>,
}

#[derive(Serialize)]
struct EventView {
    at_s: f64,
    kind: String,
    sensor: String,
    text: String,
}

fn show(folder: &TakesFolder, take: &std::path::Path, global: &Global) -> anyhow::Result<Outcome> {
    let located = folder.find(take)?;
    let details = details(&located.open()?, &located.file())?;
    let whole = details.frames_read == details.take.frames;
    if global.json {
        output::json_pretty(&details)?;
    } else {
        describe(&details)?;
        if !whole {
            let (read, said) = (details.frames_read, details.take.frames);
            output::warn(&format!("{read} frames read back, the take says {said}"));
        }
    }
    Ok(if whole {
        Outcome::Done
    } else {
        Outcome::DoneWithLoss
    })
}

/// Reads the whole take, so that what is said of it is known to be so.
fn details(reader: &TakeReader, file: &std::path::Path) -> anyhow::Result<TakeDetails> {
    let mut frames_read = 0;
    for frame in reader.frames() {
        frame?;
        frames_read += 1;
    }
    let start = reader.header().start.map_or(0, |start| start.ns());
    let events = reader.events().map(|event| {
        let event = event?;
        Ok(EventView {
            at_s: event.time_ns.saturating_sub(start) as f64 * 1e-9,
            kind: event.kind,
            sensor: event.sensor,
            text: event.text,
        })
    });
    let calibration = reader.header().calibration.as_ref();
    Ok(TakeDetails {
        take: TakeView {
            path: Some(file.display().to_string()),
            ..TakeView::from(reader.info())
        },
        messages: Topic::ALL
            .into_iter()
            .map(|topic| (topic.name(), reader.count(topic)))
            .collect(),
        frames_read,
        calibrated: calibration
            .map(|c| c.sensors.keys().cloned().collect())
            .unwrap_or_default(),
        events: events.collect::<anyhow::Result<_>>()?,
    })
}

fn describe(details: &TakeDetails) -> anyhow::Result<()> {
    let take = &details.take;
    let calibrated = if details.calibrated.is_empty() {
        "no sensor".to_owned()
    } else {
        details.calibrated.join(", ")
    };
    let messages: Vec<String> = details
        .messages
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(topic, count)| format!("{topic} {count}"))
        .collect();
    let facts = [
        ("take", paint(Style::Bold, &take.name)),
        ("file", take.path.clone().unwrap_or_default()),
        ("state", state(take)),
        ("trouble", take.trouble.clone()),
        ("started", take.started.clone()),
        (
            "timecode",
            match take.timecode.as_str() {
                "" => String::new(),
                timecode => format!("{timecode} at {}", take.timecode_rate),
            },
        ),
        (
            "length",
            format!(
                "{}, {} frames, {}",
                duration(take.seconds),
                take.frames,
                bytes(take.bytes)
            ),
        ),
        ("people", format!("at most {}", people(take.people))),
        ("sensors", take.sensors.join(", ")),
        ("calibrated", calibrated),
        ("slate", take.slate.clone()),
        ("notes", in_a_line(&take.notes)),
        (
            "dropped",
            if take.dropped > 0 {
                format!("{} inputs", take.dropped)
            } else {
                String::new()
            },
        ),
        ("messages", messages.join(", ")),
    ];
    for (what, fact) in facts.iter().filter(|(_, fact)| !fact.is_empty()) {
        line(format!(
            "{} {fact}",
            paint(Style::Faint, &format!("{what:<11}"))
        ))?;
    }
    for event in &details.events {
        let mark = paint(
            Style::Faint,
            &format!("{:<11}", format!("+{:.1} s", event.at_s)),
        );
        line(format!("{mark} {} {} {}", event.kind, event.sensor, event.text).trim_end())?;
    }
    Ok(())
}

/// What `takes recover --json` prints, one for each take that had no end.
#[derive(Serialize)]
struct RecoveryView {
    name: String,
    recovered: bool,
    frames: u64,
    lost_bytes: u64,
    trouble: String,
}

fn repair(folder: &TakesFolder, global: &Global) -> anyhow::Result<Outcome> {
    let storage: Arc<dyn Storage> = Arc::new(DiskStorage::new(folder.path())?);
    let views: Vec<RecoveryView> = recover(&storage)?
        .into_iter()
        .map(RecoveryView::from)
        .collect();
    if global.json {
        output::json_pretty(&views)?;
    } else if views.is_empty() {
        line(format!(
            "every take in {} has its end; nothing to repair",
            paths::shown(&folder.path())
        ))?;
    }
    for view in views.iter().filter(|_| !global.json) {
        let (name, frames) = (&view.name, view.frames);
        match view.recovered {
            true => line(format!(
                "{name}: repaired, {frames} frames; {} bytes could not be read",
                view.lost_bytes
            ))?,
            false => output::warn(&format!("{name}: left as it was: {}", view.trouble)),
        }
    }
    let worst = views
        .iter()
        .map(|view| (view.recovered, view.lost_bytes))
        .min();
    Ok(match worst {
        Some((false, _)) => Outcome::Failed,
        _ if views.iter().any(|view| view.lost_bytes > 0) => Outcome::DoneWithLoss,
        _ => Outcome::Done,
    })
}

impl From<Recovery> for RecoveryView {
    fn from(recovery: Recovery) -> Self {
        let name = recovery.name;
        match recovery.outcome {
            RecoveryOutcome::Recovered { info, lost_bytes } => Self {
                name,
                recovered: true,
                frames: info.frames,
                lost_bytes,
                trouble: info.trouble,
            },
            RecoveryOutcome::Damaged(trouble) => Self {
                name,
                recovered: false,
                frames: 0,
                lost_bytes: 0,
                trouble,
            },
        }
    }
}
