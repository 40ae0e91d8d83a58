//! `posefuse record`: one take, from now until Ctrl-C or for a given time.

use std::collections::BTreeSet;
use std::time::Duration;

use anyhow::anyhow;
use clap::Args;
use posefuse_proto::v1::{
    GetStatusRequest, RoomStatus, SensorState, StartTakeRequest, StopTakeRequest, Take,
};
use tokio_util::sync::CancellationToken;

use crate::failure::Outcome;
use crate::global::Global;
use crate::output::{Style, bytes, duration, line, paint, people};
use crate::room::{self, Room, ServerOption};
use crate::views::TakeView;
use crate::{output, progress, shutdown, values};

/// How often the running time is brought up to date.
const REFRESH: Duration = Duration::from_millis(500);

/// Record a take. Ctrl-C ends it; so does --seconds
#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    /// The take's name; a number is appended if it exists [default: date and time]
    #[arg(default_value = "", hide_default_value = true)]
    name: String,
    /// End after this time
    #[arg(long, value_name = "S", value_parser = values::seconds)]
    seconds: Option<f64>,
    /// Scene and take as on the clapperboard, e.g. 12A/3
    #[arg(long, default_value = "", hide_default_value = true)]
    slate: String,
    /// Anything worth knowing later
    #[arg(long, default_value = "", hide_default_value = true)]
    notes: String,
    #[command(flatten)]
    server: ServerOption,
}

pub(crate) async fn run(args: &RecordArgs, global: &Global) -> anyhow::Result<Outcome> {
    let stop = shutdown::on_signal()?;
    let (mut client, status) = room::connect_with_status(&args.server.server).await?;
    warn_of_what_is_missing(&status);
    let request = StartTakeRequest {
        name: args.name.clone(),
        slate: args.slate.clone(),
        notes: args.notes.clone(),
    };
    let started = client
        .start_take(request)
        .await
        .map_err(|status| room::refused(&status))?
        .into_inner();
    output::note(format!(
        "recording `{}`; Ctrl-C ends the take",
        started.name
    ));
    let limit = args.seconds.map(Duration::from_secs_f64);
    let lost = follow(&mut client, &status, limit, &stop).await.err();
    let take = match client.stop_take(StopTakeRequest {}).await {
        Ok(take) => take.into_inner(),
        Err(status) if room::went_away(&status) => {
            return Err(anyhow!(
                "the server went away while it recorded `{}`; what came until then is kept, and repaired when the server \
                 starts again: `posefuse takes` lists it",
                started.name
            ));
        }
        Err(status) => return Err(lost.unwrap_or_else(|| room::refused(&status))),
    };
    if global.json {
        output::json_pretty(&TakeView::from(&take))?;
    } else {
        summary(&take, &status.take_folder)?;
    }
    Ok(outcome(&take))
}

/// Done, or done with loss when something did not reach the file.
pub(crate) fn outcome(take: &Take) -> Outcome {
    if take.dropped > 0 || !take.trouble.is_empty() {
        Outcome::DoneWithLoss
    } else {
        Outcome::Done
    }
}

/// Says what the take is and where.
pub(crate) fn summary(take: &Take, folder: &str) -> anyhow::Result<()> {
    line(format!(
        "{} {}: {}, {} frames, {}, {}, {}",
        paint(Style::Good, "take"),
        paint(Style::Bold, &take.name),
        duration(take.duration_ns as f64 * 1e-9),
        take.frames,
        people(take.people),
        output::sensors(take.sensors.len()),
        bytes(take.size_bytes),
    ))?;
    line(format!("     {folder}/{}.mcap", take.name))?;
    line(format!(
        "     posefuse export {} --preset blender   writes files; --help lists the other programs",
        take.name
    ))?;
    if take.dropped > 0 {
        output::warn(&format!(
            "{} inputs did not reach the file: the disk did not keep up; record to a faster one",
            take.dropped
        ));
    }
    if !take.trouble.is_empty() {
        output::warn(&take.trouble);
    }
    Ok(())
}

fn warn_of_what_is_missing(status: &RoomStatus) {
    let live = |s: &&posefuse_proto::v1::SensorStatus| s.state() == SensorState::Live;
    if !status.sensors.iter().any(|s| live(&s)) {
        output::warn("no sensor is live: the take will hold only what comes later");
    } else if status.sensors.iter().filter(live).any(|s| !s.calibrated) {
        output::warn(
            "not every live sensor is calibrated: their frames are recorded, and `posefuse refuse` can fuse them once \
             `posefuse calibrate` has placed them",
        );
    }
    status
        .troubles
        .iter()
        .for_each(|trouble| output::warn(trouble));
}

/// The names of those that deliver.
fn live_sensors(status: &RoomStatus) -> BTreeSet<String> {
    let live = status
        .sensors
        .iter()
        .filter(|sensor| sensor.state() == SensorState::Live);
    live.filter_map(|sensor| Some(sensor.info.as_ref()?.name.clone()))
        .collect()
}

/// Shows the running time until the end comes, or until the server ended the take by itself.
async fn follow(
    client: &mut Room,
    status: &RoomStatus,
    limit: Option<Duration>,
    stop: &CancellationToken,
) -> anyhow::Result<()> {
    let running = progress::spinner("recording");
    let mut live = live_sensors(status);
    let begun = tokio::time::Instant::now();
    let end = async {
        match limit {
            Some(limit) => tokio::time::sleep_until(begun + limit).await,
            None => std::future::pending().await,
        }
    };
    tokio::pin!(end);
    let result = loop {
        tokio::select! {
            () = stop.cancelled() => break Ok(()),
            () = &mut end => break Ok(()),
            () = tokio::time::sleep(REFRESH) => {}
        }
        let status = match client.get_status(GetStatusRequest {}).await {
            Ok(status) => status.into_inner(),
            Err(status) => break Err(room::refused(&status)),
        };
        let now = live_sensors(&status);
        for name in live.difference(&now) {
            output::warn(&format!(
                "{name} delivers nothing any more; the take goes on without it"
            ));
        }
        for name in now.difference(&live) {
            output::note(format!("{name} delivers"));
        }
        live = now;
        let Some(take) = status.recording else {
            output::warn("the server ended the take by itself");
            break Ok(());
        };
        running.set_message(format!(
            "{}  {} frames  {}  {}  {:.1} fps",
            duration(begun.elapsed().as_secs_f64()),
            take.frames,
            bytes(take.size_bytes),
            people(status.people),
            status.frames_per_second,
        ));
    };
    running.finish_and_clear();
    result
}
