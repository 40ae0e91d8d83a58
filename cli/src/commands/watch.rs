//! `posefuse watch`: the fused people, as lines for people or as JSON lines for scripts.

use std::time::Duration;

use anyhow::Context;
use clap::Args;
use posefuse_proto::room_frame_from_wire;
use posefuse_proto::v1::{GetStatusRequest, RoomStatus, WatchRequest};
use posefuse_skeleton::{Joint, Provenance, Room, RoomFrame, Skeleton, Track};

use crate::failure::Outcome;
use crate::global::Global;
use crate::room::{self, ServerOption};
use crate::views::FrameView;
use crate::{output, shutdown, values};

/// How long the first frame may take before the reason is said.
const PATIENCE: Duration = Duration::from_secs(2);

/// Print the fused people as they move, one line a frame; with --json one JSON object a frame
#[derive(Debug, Args)]
pub(crate) struct WatchArgs {
    #[command(flatten)]
    server: ServerOption,
    /// At most this many frames a second; 0 for all [default: 2, with --json all]
    #[arg(long, value_name = "HZ", value_parser = values::rate)]
    rate: Option<f64>,
    /// End after this many frames
    #[arg(long, value_name = "N", value_parser = values::whole(1, u64::MAX))]
    frames: Option<u64>,
}

pub(crate) async fn run(args: &WatchArgs, global: &Global) -> anyhow::Result<Outcome> {
    let stop = shutdown::on_signal()?;
    let (mut client, mut status) = room::connect_with_status(&args.server.server).await?;
    let max_rate_hz = args.rate.unwrap_or(if global.json { 0.0 } else { 2.0 });
    let frames = client.watch(WatchRequest { max_rate_hz }).await;
    let mut frames = frames
        .map_err(|status| room::refused(&status))?
        .into_inner();
    let mut left = args.frames.unwrap_or(u64::MAX);
    let mut patience = Some(PATIENCE);
    while left > 0 {
        let next = tokio::select! {
            () = stop.cancelled() => return Ok(Outcome::Done),
            next = frames.message() => next,
            () = tokio::time::sleep(patience.unwrap_or_default()), if patience.is_some() => {
                patience = None;
                output::note(why_nothing_comes(&status));
                continue;
            }
        };
        let next = match next {
            Ok(next) => next,
            Err(status) => return Err(room::broken(&args.server.server, &status).await),
        };
        let Some(frame) = next else {
            anyhow::bail!("the server ended the stream; it is stopping");
        };
        let civil = (frame.unix_ns, frame.timecode.clone());
        let frame = room_frame_from_wire(&frame).context("a frame of the server")?;
        patience = None;
        if sensors(&frame).any(|index| name(&status, index).is_none()) {
            // A sensor that joined since: ask once for its name.
            if let Ok(newer) = client.get_status(GetStatusRequest {}).await {
                status = newer.into_inner();
            }
        }
        let named = |index| name(&status, index).unwrap_or_else(|| format!("#{index}"));
        if global.json {
            output::json(&FrameView::new(&frame, civil, named))?;
        } else {
            output::line(text(&frame, named))?;
        }
        left -= 1;
    }
    Ok(Outcome::Done)
}

fn why_nothing_comes(status: &RoomStatus) -> String {
    match status.troubles.first() {
        Some(trouble) => format!("no frames yet: {trouble}"),
        None if status.sensors.is_empty() => "no frames yet: no sensor has joined".to_owned(),
        None => "no frames yet; `posefuse doctor` says how the room is".to_owned(),
    }
}

fn sensors(frame: &RoomFrame) -> impl Iterator<Item = usize> {
    frame
        .tracks
        .iter()
        .flat_map(|track| track.sensors.iter())
        .map(|id| id.index())
}

fn name(status: &RoomStatus, index: usize) -> Option<String> {
    let infos = status
        .sensors
        .iter()
        .filter_map(|sensor| sensor.info.as_ref());
    infos
        .into_iter()
        .find(|info| info.id as usize == index)
        .map(|info| info.name.clone())
}

fn text(frame: &RoomFrame, name: impl Fn(usize) -> String) -> String {
    let mut line = format!(
        "{:9.2} s  {}",
        frame.time.seconds(),
        output::people(frame.tracks.len() as u32)
    );
    for track in &frame.tracks {
        line += &format!("  |  {}", person(track, &name));
    }
    line
}

fn person(track: &Track, name: impl Fn(usize) -> String) -> String {
    let sensors: Vec<String> = track.sensors.iter().map(|id| name(id.index())).collect();
    let place = track.skeleton.centre().map_or_else(String::new, |centre| {
        let p = centre.vector();
        format!(" at x {:+.2} y {:+.2} m", p.x, p.y)
    });
    let head = track
        .skeleton
        .position(Joint::Head)
        .map_or_else(String::new, |head| {
            format!(", head {:.2} m", head.vector().z)
        });
    format!(
        "#{}{place}{head}, {}/{} joints measured, by {}",
        track.id,
        measured(&track.skeleton),
        track.skeleton.len(),
        if sensors.is_empty() {
            "nobody now".to_owned()
        } else {
            sensors.join(" ")
        }
    )
}

fn measured(skeleton: &Skeleton<Room>) -> usize {
    skeleton
        .iter()
        .filter(|(_, joint)| matches!(joint.provenance, Provenance::Measured(_)))
        .count()
}
