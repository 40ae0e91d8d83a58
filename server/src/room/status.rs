//! The room's state in one message.

use std::sync::Arc;
use std::time::Duration;

use futures_util::{Stream, stream};
use posefuse_proto::{calibration_to_wire, v1};
use posefuse_skeleton::Calibration;
use tonic::Status;

use super::calibrations::listed;
use super::service::pause;
use super::{Room, calibration, sensors};
use crate::drift;

/// A status comes at least so often.
const AT_LEAST: Duration = Duration::from_secs(1);
/// Looked at so often unless the client says otherwise.
const USUAL_HZ: f64 = 5.0;

/// The room as it is now.
pub(super) fn status(room: &Room) -> v1::RoomStatus {
    let snapshot = room.snapshot.borrow().clone();
    let calibration = room.calibration.current();
    let now = room.clock.now();
    let unix_offset_ns = room.clock.unix_offset_ns();
    let unix_ns = now.ns().saturating_add(unix_offset_ns);
    let timecode = room.config.timecode.at(unix_ns);
    let sensors: Vec<_> = room
        .registry
        .sensors()
        .iter()
        .map(|sensor| {
            let view = snapshot.sensors.get(sensor.id().index());
            let drift = room.drift.of(sensor.id());
            let mut status = sensors::status(sensor, view, calibration.as_deref(), now);
            status.drift = drift.as_ref().map(drift::to_wire);
            if status.trouble.is_empty() {
                status.trouble = drift::trouble(&room.drift, sensor.id(), &room.registry);
            }
            status
        })
        .collect();
    v1::RoomStatus {
        time_ns: now.ns(),
        unix_offset_ns,
        server_version: env!("CARGO_PKG_VERSION").to_owned(),
        people: snapshot.people,
        frames_per_second: snapshot.frames_per_second,
        engine_us: snapshot.engine_us,
        latency_p50_ms: snapshot.latency_p50_ms,
        latency_p99_ms: snapshot.latency_p99_ms,
        recording: room.takes.recording(now),
        troubles: troubles(room, &sensors),
        sensors,
        calibration: calibration.as_deref().map(calibration_to_wire),
        calibrating: room.calibration.is_calibrating(),
        disk_free_bytes: room.disk_free().unwrap_or(0),
        sinks: room.sink_statuses(),
        take_folder: room.storage.place(),
        repair: Some(room.repair.to_wire()),
        timecode: timecode.at(unix_ns).to_string(),
        timecode_rate: timecode.rate.to_string(),
        timecode_utc_offset_s: timecode.utc_offset_s,
        triggers: room.triggers.statuses(),
    }
}

fn troubles(room: &Room, sensors: &[v1::SensorStatus]) -> Vec<String> {
    let mut troubles = Vec::new();
    if let Some(trouble) = room.calibration.trouble() {
        troubles.push(trouble);
    } else if room.calibration.current().is_none() {
        troubles.extend(no_calibration(sensors));
    }
    if let Some(current) = room.calibration.current() {
        troubles.extend(of_other_sensors(&current, sensors));
    }
    match room.disk_free() {
        Some(free) if free < room.config.takes.min_free_mb.saturating_mul(1_000_000) => troubles.push(format!(
            "only {} MB are free where takes go ({}), recording needs {}: delete takes or choose another folder",
            free / 1_000_000,
            room.storage.place(),
            room.config.takes.min_free_mb
        )),
        None => troubles.push(format!("the take folder {} cannot be reached", room.storage.place())),
        Some(_) => {}
    }
    troubles.extend(room.repair.trouble());
    if room.sinks.is_broken() {
        troubles.push(
            "live outputs get nothing any more by a fault of the program, its log says more: start the server anew".to_owned(),
        );
    }
    troubles.extend(room.takes.troubles());
    troubles
}

/// That the calibration is not, or not only, of the sensors that are here.
fn of_other_sensors(calibration: &Calibration, sensors: &[v1::SensorStatus]) -> Option<String> {
    let name = |sensor: &v1::SensorStatus| Some(sensor.info.as_ref()?.name.clone());
    let here: Vec<String> = sensors.iter().filter_map(name).collect();
    // Whoever is gone again may have been a test; there is nothing to calibrate.
    let is_here = |sensor: &&v1::SensorStatus| sensor.state() != v1::SensorState::Disconnected;
    let unknown = sensors.iter().filter(is_here);
    let unknown = unknown.filter(|sensor| !sensor.calibrated);
    let unknown: Vec<String> = unknown.filter_map(name).collect();
    if unknown.is_empty() {
        return None;
    }
    let absent = calibration
        .sensors
        .keys()
        .filter(|name| !here.contains(*name));
    let absent = listed(absent.map(String::as_str));
    let unknown = listed(unknown.iter().map(String::as_str));
    Some(
        if here
            .iter()
            .any(|name| calibration.sensors.contains_key(name))
        {
            let absent = match absent.as_str() {
                "" => String::new(),
                absent => format!(" (it places {absent}, which never connected)"),
            };
            format!(
                "the calibration does not know {unknown}{absent}: what they see is not used; {}",
                calibration::REMEDY
            )
        } else {
            format!(
                "the calibration in force is of other sensors: it places {absent}, this room has {unknown}, so nothing is \
             fused; restore the room's own (`posefuse calibrations`), start the agents under those names, or {}",
                calibration::REMEDY
            )
        },
    )
}

/// That sensors are connected, but nobody knows where they stand.
fn no_calibration(sensors: &[v1::SensorStatus]) -> Option<String> {
    let is_connected = |sensor: &v1::SensorStatus| sensor.state() != v1::SensorState::Disconnected;
    sensors.iter().any(is_connected).then(|| {
        format!(
            "no calibration: nobody knows where the sensors stand, so nothing is fused; {}",
            calibration::REMEDY
        )
    })
}

/// The status now, then whenever it has changed, at most `max_rate_hz` times and at least once a second.
pub(super) fn changes(
    room: Arc<Room>,
    max_rate_hz: f64,
) -> impl Stream<Item = Result<v1::RoomStatus, Status>> + Send {
    let pause = pause(max_rate_hz, USUAL_HZ, AT_LEAST);
    let start = Some((room, None::<v1::RoomStatus>));
    stream::unfold(start, move |state| async move {
        let (room, last) = state?;
        let Some(last) = last else {
            let first = status(&room);
            return Some((Ok(first.clone()), Some((room, Some(first)))));
        };
        let due = last.time_ns.saturating_add(AT_LEAST.as_nanos() as i64);
        loop {
            tokio::select! {
                () = room.clock.sleep(pause) => {}
                () = room.stop.cancelled() => {
                    return Some((Err(Status::unavailable("the server is stopping")), None));
                }
            }
            let next = status(&room);
            let same_but_for_time = v1::RoomStatus {
                time_ns: last.time_ns,
                unix_offset_ns: last.unix_offset_ns,
                timecode: last.timecode.clone(),
                ..next.clone()
            } == last;
            if !same_but_for_time || next.time_ns >= due {
                return Some((Ok(next.clone()), Some((room, Some(next)))));
            }
        }
    })
}
