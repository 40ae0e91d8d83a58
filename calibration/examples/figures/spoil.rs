//! Ways to spoil what a sensor saw.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use posefuse_calibration::{SensorWalk, Walk};
use posefuse_skeleton::Position;

/// Changes every position of the sensor's frames from `since` seconds on.
pub(crate) fn positions(
    sensor: &mut SensorWalk,
    since: f64,
    change: impl Fn(Vector3<f64>) -> Vector3<f64>,
) {
    let frames = sensor.frames.iter_mut();
    for frame in frames.filter(|frame| frame.time.seconds() >= since) {
        for body in &mut frame.bodies {
            for (_, joint) in body.joints.iter_mut() {
                joint.position = Position::from_vector(change(joint.position.vector()));
            }
        }
    }
}

/// Exchanges left and right.
pub(crate) fn labels(sensor: &mut SensorWalk) {
    for body in sensor.frames.iter_mut().flat_map(|f| &mut f.bodies) {
        let joints = body.joints.iter();
        body.joints = joints
            .map(|(joint, seen)| (joint.mirrored(), *seen))
            .collect();
    }
}

/// Somebody runs into the tripod at `since` seconds.
pub(crate) fn bump(sensor: &mut SensorWalk, since: f64, shift: Vector3<f64>, turn: Vector3<f64>) {
    let after_from_before = Isometry3::from_parts(
        Translation3::from(shift),
        UnitQuaternion::from_scaled_axis(turn),
    );
    positions(sensor, since, |p| {
        after_from_before.transform_point(&p.into()).coords
    });
}

/// Keeps what lies between these seconds.
pub(crate) fn keep(sensor: &mut SensorWalk, from: f64, to: f64) {
    sensor
        .frames
        .retain(|frame| (from..to).contains(&frame.time.seconds()));
}

/// Keeps the body nearest to each sensor's `person`: its tracking ids of that person are told by `of`.
pub(crate) fn only(walk: &mut Walk, sensor: usize, of: impl Fn(f64, Vector3<f64>) -> bool) {
    for frame in &mut walk.sensors[sensor].frames {
        let seconds = frame.time.seconds();
        frame.bodies.retain(|body| {
            let joints: Vec<Vector3<f64>> = body
                .joints
                .iter()
                .map(|(_, joint)| joint.position.vector())
                .collect();
            let centre = joints.iter().sum::<Vector3<f64>>() / joints.len().max(1) as f64;
            of(seconds, centre)
        });
    }
}
