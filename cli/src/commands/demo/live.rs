//! Waiting for the sensors, and the line that says how the room does.

use std::time::Duration;

use anyhow::bail;
use posefuse_proto::v1::{GetStatusRequest, RoomStatus, SensorState};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::fleet::Fleet;
use crate::output::{bytes, duration, people};
use crate::room::{self, Room};
use crate::{output, progress};

const REFRESH: Duration = Duration::from_millis(500);
/// Without a terminal the line comes this rarely.
const REFRESH_PLAIN: Duration = Duration::from_secs(10);

/// Comes back when `wanted` sensors are live.
pub(super) async fn until_all_live(
    room: &mut Room,
    wanted: usize,
    limit: Duration,
) -> anyhow::Result<()> {
    let waiting = progress::spinner("starting");
    let deadline = Instant::now() + limit;
    loop {
        let status = status(room).await?;
        let live = count_live(&status);
        if live >= wanted {
            waiting.finish_and_clear();
            return Ok(());
        }
        waiting.set_message(format!("{live} of {wanted} sensors live"));
        if Instant::now() > deadline {
            waiting.finish_and_clear();
            bail!(
                "only {live} of {wanted} sensors came up within {} s: is this machine very busy? \
                 try fewer with --sensors, and -v to see what the agents say",
                limit.as_secs()
            );
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

/// Shows how the room does until `limit` has passed, `stop` comes, or the server is gone. An agent that ends is
/// said, and the rest goes on.
pub(super) async fn show(
    room: &mut Room,
    limit: Option<Duration>,
    fleet: &mut Fleet,
    stop: &CancellationToken,
) -> anyhow::Result<()> {
    let line = progress::spinner("live");
    let begun = Instant::now();
    let end = async {
        match limit {
            Some(limit) => tokio::time::sleep_until(begun + limit).await,
            None => std::future::pending().await,
        }
    };
    tokio::pin!(end);
    let mut said = begun;
    let result = loop {
        tokio::select! {
            () = stop.cancelled() => break Ok(()),
            () = &mut end => break Ok(()),
            ended = fleet.any_ended() => match fleet.goes_on_without(ended) {
                Ok(()) => continue,
                Err(error) => break Err(error),
            },
            () = tokio::time::sleep(REFRESH) => {}
        }
        let text = match status(room).await {
            Ok(status) => summary(&status, begun.elapsed()),
            Err(error) => break Err(error),
        };
        if !progress::visible() && said.elapsed() >= REFRESH_PLAIN {
            said = Instant::now();
            output::note(&text);
        }
        line.set_message(text);
    };
    line.finish_and_clear();
    result
}

async fn status(room: &mut Room) -> anyhow::Result<RoomStatus> {
    let status = room.get_status(GetStatusRequest {}).await;
    Ok(status
        .map_err(|status| room::refused(&status))?
        .into_inner())
}

fn count_live(status: &RoomStatus) -> usize {
    status
        .sensors
        .iter()
        .filter(|sensor| sensor.state() == SensorState::Live)
        .count()
}

fn summary(status: &RoomStatus, running: Duration) -> String {
    let take = status
        .recording
        .as_ref()
        .map_or_else(String::new, |take| format!(", {}", bytes(take.size_bytes)));
    format!(
        "{}  {}  {:.0} fps  latency {:.1} ms (p99 {:.1})  {}/{} sensors{take}",
        duration(running.as_secs_f64()),
        people(status.people),
        status.frames_per_second,
        status.latency_p50_ms,
        status.latency_p99_ms,
        count_live(status),
        status.sensors.len(),
    )
}
