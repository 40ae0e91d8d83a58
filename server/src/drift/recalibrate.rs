//! One sensor's place found anew from what all saw of late; the others stay where they are.

use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_calibration::{Options, Solution, Verdict, Walk, solve};
use posefuse_proto::{calibration_to_wire, v1};
use posefuse_skeleton::{Calibration, SensorPose, Timestamp};
use tonic::Status;

use super::recent::Recent;
use crate::room::{REMEDY, Room, calibration_failed, calibration_result};

/// Finds the place of the sensor that is asked for, and puts it in force unless it failed.
pub(crate) async fn recalibrate(
    room: &Arc<Room>,
    request: v1::RecalibrateSensorRequest,
) -> Result<v1::CalibrateResult, Status> {
    let name = request.sensor;
    check(room, &name)?;
    let _right = room.begin_calibrating().await?;
    let Some(current) = room.calibration.current() else {
        return Err(Status::failed_precondition(format!(
            "no calibration is in force, so there are no other sensors to place `{name}` beside; {REMEDY}"
        )));
    };
    let walk = recent_walk(room, &name, &current)?;
    let options = options(room, &name, &current, &walk);
    let solving = room.threads.blocking(move || solve(&walk, &options)).await;
    let solution = match solving.map_err(|error| Status::internal(error.to_string()))? {
        Ok(solution) => solution,
        Err(error) => return Ok(calibration_failed(error.to_string())),
    };
    let verdict = solution.report.verdict;
    tracing::info!(sensor = name, %verdict, "a sensor's place was solved");
    let mut result = calibration_result(&solution.report);
    if verdict == Verdict::Failed {
        return Ok(result);
    }
    let calibration = with_sensor(&current, &name, &solution)?;
    result.calibration = Some(calibration_to_wire(&calibration));
    if !request.dry_run {
        room.put_in_force(calibration).await?;
        result.in_force = true;
    }
    Ok(result)
}

fn check(room: &Room, name: &str) -> Result<(), Status> {
    let sensors = room.registry.sensors();
    if sensors.iter().any(|sensor| sensor.name() == name) {
        return Ok(());
    }
    Err(room.unknown_sensor(name))
}

/// What `name` and the sensors whose places are known and not in doubt saw in the last minute; of a sensor that has moved,
/// what came after that.
fn recent_walk(room: &Room, name: &str, current: &Calibration) -> Result<Walk, Status> {
    let mut since = Timestamp::from_ns(i64::MIN);
    let mut sensors = Vec::new();
    for sensor in room.registry.sensors() {
        let found = room.drift.of(sensor.id());
        let moved = found.filter(|found| found.alarm);
        if sensor.name() == name {
            since = moved.and_then(|found| found.since).unwrap_or(since);
        } else if !current.sensors.contains_key(sensor.name())
            || moved.is_some_and(|found| found.instead.is_none())
        {
            continue;
        }
        let joint_set = sensor.greeting().info.joint_set;
        sensors.push((sensor.id(), sensor.name().to_owned(), joint_set));
    }
    let walk = {
        let mut recent = room.drift.recent();
        recent.forget_before(Recent::start(room.clock.now()));
        recent.walk(sensors.into_iter(), since)
    };
    let saw = |wanted: bool| {
        walk.sensors
            .iter()
            .any(|seen| (seen.name == name) == wanted)
    };
    if !saw(true) {
        return Err(Status::failed_precondition(format!(
            "`{name}` has seen nobody in the last minute: walk about for 20 s where it and another sensor see you, then \
             try again"
        )));
    }
    if !saw(false) {
        return Err(Status::failed_precondition(format!(
            "no other sensor whose place is known has seen anybody in the last minute: walk about for 20 s where \
             `{name}` and another sensor see you, then try again; or {REMEDY}"
        )));
    }
    Ok(walk)
}

fn options(room: &Room, name: &str, current: &Calibration, walk: &Walk) -> Options {
    let others = walk.sensors.iter().filter(|seen| seen.name != name);
    let fixed = others.filter_map(|seen| {
        let pose = current.sensors.get(&seen.name)?;
        Some((seen.name.clone(), pose.clone()))
    });
    Options {
        created: room.clock.rfc3339(),
        fixed: fixed.collect(),
        // Without a bias in it the others stand where they fit best without one, and so must this.
        ray_bias: !current.ray_bias_m.is_empty(),
        held_ray_bias_m: current.ray_bias_m.clone(),
        held_joint_offsets_m: current.joint_offsets_m.clone(),
        ..Options::default()
    }
}

/// `current` with the place of `name` from `solution`.
fn with_sensor(
    current: &Calibration,
    name: &str,
    solution: &Solution,
) -> Result<Calibration, Status> {
    let missing = || Status::internal("the solution lacks the sensor that was to be placed");
    let solved = &solution.calibration;
    let found = solved.sensors.get(name).ok_or_else(missing)?;
    let mut sensors: BTreeMap<String, SensorPose> = current.sensors.clone();
    let pose = SensorPose {
        time_offset_ns: offset_ns(current, name, solution).ok_or_else(missing)?,
        ..found.clone()
    };
    sensors.insert(name.to_owned(), pose);
    // Offsets are given with the largest as 0.
    let largest_ns = sensors.values().map(|pose| pose.time_offset_ns).max();
    for pose in sensors.values_mut() {
        pose.time_offset_ns -= largest_ns.unwrap_or(0);
    }
    Ok(Calibration {
        created: solved.created.clone(),
        verdict: solved.verdict.clone(),
        sensors,
        ..current.clone()
    })
}

/// What is added to the sensor's capture times beside the others' of `current`: only differences within the report count.
fn offset_ns(current: &Calibration, name: &str, solution: &Solution) -> Option<i64> {
    let rows = &solution.report.sensors;
    let own = rows.iter().find(|row| row.name == name)?;
    let other = rows.iter().find(|row| row.name != name)?;
    let beside_ms = own.time_offset_ms - other.time_offset_ms;
    let known = current.sensors.get(&other.name)?.time_offset_ns;
    Some(known + (beside_ms * 1e6).round() as i64)
}
