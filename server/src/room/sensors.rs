//! One sensor's status: state, rates, what is wrong and what to do.

use std::collections::HashMap;

use posefuse_fusion::{Contribution, RejectionReason};
use posefuse_planning::{Model, USUAL};
use posefuse_proto::{pose_to_wire, sensor_info_to_wire, v1};
use posefuse_skeleton::{Calibration, Timestamp};

use crate::fusion_thread::{SensorView, Unused};
use crate::ingest::{Refusal, Sensor};

use super::calibration::REMEDY;

/// A connected sensor without a frame for so long is stalled.
const STALLED_NS: i64 = 1_000_000_000;
/// A refused frame is mentioned for so long.
const MENTION_NS: i64 = 5_000_000_000;

/// What a sensor's depth camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    /// Whole horizontal and vertical field of view, degrees.
    pub(super) view_deg: [f64; 2],
    /// From where to where it measures, metres.
    pub(super) range_m: [f64; 2],
    /// Part of it is neither told by the agent nor known of the model.
    pub(super) assumed: bool,
}

/// As its agent says, else as is known of the model, else as usual.
pub(super) fn camera(device: &str, told: Option<&v1::CameraInfo>) -> Camera {
    let model = Model::of(device);
    let usual = model.unwrap_or(&USUAL);
    let view = told.filter(|camera| camera.fov_horizontal_deg > 0.0);
    let range = told.filter(|camera| camera.far_m > 0.0);
    Camera {
        view_deg: view.map_or(usual.view_deg, |camera| {
            [camera.fov_horizontal_deg, camera.fov_vertical_deg]
        }),
        range_m: range.map_or(usual.range_m, |camera| [camera.near_m, camera.far_m]),
        assumed: model.is_none() && (view.is_none() || range.is_none()),
    }
}

/// Whether a sensor delivers.
pub(super) fn state(sensor: &Sensor, now: Timestamp) -> v1::SensorState {
    if !sensor.is_connected() {
        return v1::SensorState::Disconnected;
    }
    match sensor.last_frame() {
        Some(last) if now.since_ns(last) < STALLED_NS => v1::SensorState::Live,
        _ => v1::SensorState::Stalled,
    }
}

/// One sensor as it is now.
pub(super) fn status(
    sensor: &Sensor,
    view: Option<&SensorView>,
    calibration: Option<&Calibration>,
    now: Timestamp,
) -> v1::SensorStatus {
    let state = state(sensor, now);
    let pose = calibration.and_then(|calibration| calibration.sensors.get(sensor.name()));
    let clock = view.and_then(|view| view.clock.as_ref());
    let trouble = trouble(sensor, view, state, calibration.is_some(), now);
    let greeting = sensor.greeting();
    let camera = camera(&greeting.info.model, greeting.camera.as_ref());
    v1::SensorStatus {
        info: Some(sensor_info_to_wire(&greeting.info)),
        state: state.into(),
        calibrated: pose.is_some(),
        room_from_sensor: pose.map(|pose| pose_to_wire(&pose.room_from_sensor)),
        fov_horizontal_deg: camera.view_deg[0],
        fov_vertical_deg: camera.view_deg[1],
        frames_per_second: view.map_or(0.0, |view| view.frames_per_second),
        latency_ms: view.and_then(|view| view.latency_ms),
        clock_offset_ms: clock.map(|clock| clock.offset_ns as f64 * 1e-6),
        clock_error_ms: clock.map(|clock| clock.error_ns as f64 * 1e-6),
        clock_drift_ppm: clock.map(|clock| clock.drift_ppm),
        frames_received: sensor.received(),
        frames_lost: sensor.lost(),
        rejected: rejected(sensor, view),
        bodies: match state {
            v1::SensorState::Live => view.map_or(0, |view| view.bodies),
            _ => 0,
        },
        residual_mm: view.and_then(|view| view.residual_mm),
        trouble,
        agent_version: greeting.agent_version.clone(),
        agent_dropped: greeting
            .health
            .as_ref()
            .and_then(|health| health.frames_dropped),
        muted: sensor.is_muted(),
        drift: None,
        contribution: view
            .and_then(|view| view.contribution.as_ref())
            .map(contribution),
        near_m: camera.range_m[0],
        far_m: camera.range_m[1],
        depth_preview: greeting.camera.is_some_and(|camera| camera.depth_preview),
    }
}

fn contribution(part: &Contribution) -> v1::Contribution {
    let millimetres = |metres: &Option<f32>| metres.map_or(-1.0, |metres| metres * 1e3);
    v1::Contribution {
        weight: part.weight,
        rejected_share: part.rejected_share,
        residual_mm: part.residual_m.map(|metres| metres * 1e3),
        joint_weights: part.joint_weights.to_vec(),
        joint_rejected_shares: part.joint_rejected.to_vec(),
        joint_residuals_mm: part.joint_residual_m.iter().map(millimetres).collect(),
    }
}

fn rejected(sensor: &Sensor, view: Option<&SensorView>) -> HashMap<String, u64> {
    let before = Refusal::ALL.map(|refusal| (refusal.name(), sensor.refused(refusal)));
    let by_engine = view.map_or(&[][..], |view| &view.rejected);
    let early = view.map_or(0, |view| view.before_calibration);
    let by_engine = by_engine.iter().map(|(reason, count)| {
        // That nothing was used before there was a calibration is no fault of the sensor's.
        let count = match reason {
            RejectionReason::Uncalibrated => count.saturating_sub(early),
            _ => *count,
        };
        (reason.name(), count)
    });
    before
        .into_iter()
        .chain(by_engine)
        .filter(|(_, count)| *count > 0)
        .map(|(reason, count)| (reason.to_owned(), count))
        .collect()
}

fn trouble(
    sensor: &Sensor,
    view: Option<&SensorView>,
    state: v1::SensorState,
    room_is_calibrated: bool,
    now: Timestamp,
) -> String {
    let name = sensor.name();
    let greeting = sensor.greeting();
    match state {
        v1::SensorState::Disconnected => {
            return format!(
                "its agent is gone: see whether it still runs, or start it again as `{name}`"
            );
        }
        v1::SensorState::Stalled => {
            let said = greeting
                .health
                .as_ref()
                .map(|health| health.trouble.as_str());
            return match said.filter(|said| !said.is_empty()) {
                Some(said) => format!("no frame for a second; its agent says: {said}"),
                None => "no frame for a second: see whether the sensor is plugged in and powered"
                    .to_owned(),
            };
        }
        _ => {}
    }
    if let Some((when, what)) = &greeting.last_refusal
        && now.since_ns(*when) < MENTION_NS
    {
        return what.clone();
    }
    if view.is_some_and(|view| view.clock.as_ref().is_some_and(|clock| clock.suspect)) {
        return "its agent's clock has jumped: frames are held back until it is mapped again"
            .to_owned();
    }
    let unused = view.and_then(|view| view.unused);
    unused.map_or_else(String::new, |unused| why_unused(unused, room_is_calibrated))
}

/// Why frames that came well are not used, and what to do; nothing where the room's own trouble says it.
fn why_unused(unused: Unused, room_is_calibrated: bool) -> String {
    let percent = (unused.share * 100.0).round();
    match unused.reason {
        RejectionReason::Late => format!(
            "{percent} % of its frames come too late to be used: lower the load on its machine, or use a cable \
             (`max_age_ms` and `max_lag_ms` under `[fusion.intake]` say how late they may come)"
        ),
        RejectionReason::OutOfOrder => format!(
            "{percent} % of its frames are older than one before them: its agent must send each frame once, in the \
             order of capture, with the time of capture"
        ),
        RejectionReason::Repeated => format!(
            "{percent} % of its frames repeat the last one bit by bit: its tracker is stuck, start its agent again"
        ),
        RejectionReason::ClockUnknown => format!(
            "{percent} % of its frames cannot be placed in time: its agent does not answer the server's clock probes; \
             use an agent of this release"
        ),
        RejectionReason::ClockStep => format!(
            "{percent} % of its frames are held back: its agent's clock has jumped; if it goes on, its capture times are of another \
             clock than its agent answers with (in Python that is `time.monotonic_ns()`), or start its agent again"
        ),
        RejectionReason::Uncalibrated if !room_is_calibrated => String::new(),
        RejectionReason::Uncalibrated => {
            format!("what it sees is not used: the calibration does not know it; {REMEDY}")
        }
        reason => {
            format!("{percent} % of its frames are refused ({reason}): start its agent again")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_agent_knows_its_camera_best_then_the_model_then_the_usual() {
        let told = v1::CameraInfo {
            fov_horizontal_deg: 90.0,
            fov_vertical_deg: 50.0,
            ..v1::CameraInfo::default()
        };
        let known = camera("Kinect v1 (OpenNI2)", Some(&told));
        assert_eq!((known.view_deg, known.range_m), ([90.0, 50.0], [0.8, 4.0]));
        assert!(!known.assumed);
        let unknown = camera("something", None);
        assert_eq!((unknown.view_deg, unknown.assumed), (USUAL.view_deg, true));
        assert!(
            camera("something", Some(&told)).assumed,
            "its range is not known"
        );
    }
}
