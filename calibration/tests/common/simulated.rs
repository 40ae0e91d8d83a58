//! Walks of the project's simulator, and how far a calibration is off its truth.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "each test binary and the example use a part"
)]

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Point3};
use posefuse_calibration::{Walk, WalkBody, WalkFrame, WalkJoint};
use posefuse_simulator::{SimBody, SimSensor, World};
use posefuse_skeleton::{
    Body, Calibration, JointSet, JointState, Provenance, SensorId, SensorSet, Timestamp,
};

/// The first `seconds` of a world as its sensors see them, on the agents' own clocks: nobody has mapped them.
pub fn record(world: &Arc<World>, seconds: f64) -> Walk {
    let mut walk = Walk::default();
    for index in 0..world.sensor_count() {
        let mut sensor = SimSensor::new(Arc::clone(world), index);
        let frames = &mut walk.sensor_mut(world.sensor_name(index)).frames;
        while (sensor.next_at_ns() as f64) < seconds * 1e9 {
            let frame = sensor.next_frame();
            if !frame.dropped {
                frames.push(WalkFrame {
                    time: Timestamp::from_ns(frame.captured.ns()),
                    bodies: frame.bodies.iter().map(body).collect(),
                });
            }
        }
    }
    walk
}

fn body(body: &SimBody) -> WalkBody {
    WalkBody {
        tracking_id: body.tracking_id,
        joints: JointSet::KinectV2
            .to_canonical(&body.joints)
            .map(|_, joint| WalkJoint {
                position: joint.position,
                confidence: joint.confidence,
            }),
    }
}

/// How far the relation of two sensors is off the truth.
#[derive(Clone, Copy, Debug)]
pub struct PairError {
    /// RMS over the volume that people are in (3 x 3 x 2 m), mm.
    pub volume_mm: f64,
    /// Degrees.
    pub turn_deg: f64,
    /// Of the time offset, half-way through the walk (clocks drift), ms.
    pub time_ms: f64,
    /// The first sensor, as the second one sees it, mm.
    pub place_mm: f64,
}

/// The errors of every pair of sensors that `found` knows, by their indices.
pub fn pair_errors(
    world: &World,
    found: &Calibration,
    seconds: f64,
) -> Vec<((usize, usize), PairError)> {
    let mut errors = Vec::new();
    for a in 0..world.sensor_count() {
        for b in a + 1..world.sensor_count() {
            let of = |index: usize| found.sensors.get(world.sensor_name(index));
            let (Some(pose_a), Some(pose_b)) = (of(a), of(b)) else {
                continue;
            };
            let found_a_from_b =
                pose_a.room_from_sensor.isometry().inverse() * pose_b.room_from_sensor.isometry();
            let [room_from_a, room_from_b] = [a, b].map(|s| *world.room_from_sensor(s).isometry());
            let off = found_a_from_b * (room_from_b.inverse() * room_from_a);
            let late_ns = |s: usize| {
                let clock = world.sensor_clock(s);
                clock.offset_ns as f64 + clock.drift_ppm * 1e-6 * seconds * 0.5e9
            };
            let found_ns = (pose_a.time_offset_ns - pose_b.time_offset_ns) as f64;
            errors.push((
                (a, b),
                PairError {
                    volume_mm: volume_rms(&off, &room_from_a) * 1e3,
                    turn_deg: off.rotation.angle().to_degrees(),
                    time_ms: (found_ns - (late_ns(b) - late_ns(a))) * 1e-6,
                    place_mm: (off.translation.vector).norm() * 1e3,
                },
            ));
        }
    }
    errors
}

/// How far `off`, in a sensor's frame, moves points of the volume: RMS, metres.
fn volume_rms(off: &Isometry3<f64>, room_from_sensor: &Isometry3<f64>) -> f64 {
    let points = (0..125).map(|i| {
        let [x, y, z] = [i % 5, i / 5 % 5, i / 25].map(f64::from);
        room_from_sensor.inverse_transform_point(&Point3::new(
            x * 0.75 - 1.5,
            y * 0.75 - 1.5,
            z * 0.5,
        ))
    });
    let squares: f64 = points.map(|p| (off * p - p).norm_squared()).sum();
    (squares / 125.0).sqrt()
}

/// The bodies of a frame as the server has them.
pub fn bodies(sensor: SensorId, frame: &WalkFrame) -> Vec<Body> {
    let body = |body: &WalkBody| Body {
        tracking_id: body.tracking_id,
        skeleton: body.joints.map(|_, joint| JointState {
            position: joint.position,
            covariance: Matrix3::identity() * 1e-4,
            confidence: joint.confidence,
            provenance: Provenance::Measured(SensorSet::only(sensor)),
        }),
        orientations: None,
        hands_closed: [None; 2],
    };
    frame.bodies.iter().map(body).collect()
}
