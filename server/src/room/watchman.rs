//! Looks after the room ten times a second: notes when a sensor comes, stalls, recovers or goes, and how full the disk is.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use posefuse_proto::v1::SensorState;
use posefuse_session::Event;
use posefuse_skeleton::Timestamp;

use super::{Room, sensors};
use crate::ingest::Sensor;

const BEAT: Duration = Duration::from_millis(100);
/// The disk is looked at every so many beats.
const DISK_BEATS: u64 = 10;

/// What each sensor did when it was last looked at.
#[derive(Debug, Default)]
pub(crate) struct Noted(Mutex<Vec<SensorState>>);

/// Runs until the server stops.
pub(crate) async fn watch_over(room: Arc<Room>) {
    for beat in 0_u64.. {
        if beat % DISK_BEATS == 0 {
            room.look_at_disk().await;
        }
        note_changes(&room);
        room.takes.notice_end(&room.clock.rfc3339());
        tokio::select! {
            () = room.clock.sleep(BEAT) => {}
            () = room.stop.cancelled() => return,
        }
    }
}

/// Notes each sensor whose state is another than when it was last looked at.
pub(super) fn note_changes(room: &Room) {
    let mut states = (room.noted.0.lock()).unwrap_or_else(PoisonError::into_inner);
    let now = room.clock.now();
    for (index, sensor) in room.registry.sensors().iter().enumerate() {
        let state = sensors::state(sensor, now);
        let before = states.get(index).copied();
        if before == Some(state) {
            continue;
        }
        match before {
            Some(_) => states[index] = state,
            None => states.push(state),
        }
        // A sensor that has just joined is live only with its first frame; that it is not yet, is no news.
        if let Some(event) = event(sensor, before, state, now) {
            tracing::info!(sensor = event.sensor, kind = event.kind, "{}", event.text);
            room.takes.event(event);
        }
    }
}

fn event(
    sensor: &Sensor,
    before: Option<SensorState>,
    state: SensorState,
    now: Timestamp,
) -> Option<Event> {
    let was_gone = matches!(before, None | Some(SensorState::Disconnected));
    let (kind, text) = match state {
        SensorState::Disconnected => ("sensor-disconnected", "its agent is gone"),
        _ if was_gone => ("sensor-connected", "its agent is connected"),
        SensorState::Stalled => ("sensor-stalled", "connected, but no frame for a second"),
        SensorState::Live => ("sensor-live", "frames come again"),
        SensorState::Unspecified => return None,
    };
    Some(Event {
        time_ns: now.ns(),
        kind: kind.to_owned(),
        sensor: sensor.name().to_owned(),
        text: text.to_owned(),
        ..Event::default()
    })
}

impl Room {
    /// Looks up how much space is free where takes go.
    pub(crate) async fn look_at_disk(&self) {
        let storage = self.storage.clone();
        let free = self.threads.blocking(move || storage.free_bytes()).await;
        let free = match free {
            Ok(Ok(free)) => free,
            _ => u64::MAX,
        };
        self.disk_free.store(free, Ordering::Relaxed);
    }
}
