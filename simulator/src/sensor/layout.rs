//! Where simulated sensors stand and what they can see.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_skeleton::{Room, Sensor, Transform};

use crate::random::{Purpose, Stream};
use crate::scenario::{Layout, Scenario};

/// Half the width and height of the view as tangents: 57 x 43 degrees.
const VIEW_TAN: [f64; 2] = [0.542_957, 0.393_910];

/// Nearest and furthest depth that is seen, metres.
const RANGE_M: [f64; 2] = [0.5, 8.0];

/// Whether a sensor sees the point with these coordinates in its frame, metres.
pub(crate) fn in_view(point: Vector3<f64>) -> bool {
    (RANGE_M[0]..=RANGE_M[1]).contains(&point.z)
        && point.x.abs() <= VIEW_TAN[0] * point.z
        && point.y.abs() <= VIEW_TAN[1] * point.z
}

/// The pose of sensor `index`: around the room, looking at its middle.
pub(crate) fn room_from_sensor(scenario: &Scenario, index: usize) -> Transform<Room, Sensor> {
    let mut stream = Stream::new(scenario.seed, Purpose::Layout, &[index as u64]);
    let count = scenario.sensors;
    let degrees = match scenario.layout {
        Layout::Ring => 360.0 * index as f64 / count as f64,
        Layout::Arc if count == 1 => 0.0,
        Layout::Arc => -50.0 + 100.0 * index as f64 / (count - 1) as f64,
    };
    let spacing = if count == 1 {
        0.0
    } else {
        (60.0 / count as f64).min(6.0)
    };
    let angle = (degrees + spacing * stream.between(-1.0, 1.0)).to_radians();
    let distance = stream.between(2.6, 3.2) + 0.5 * (scenario.area_m - 2.6).max(0.0);
    let height = stream.between(0.7, 1.9);
    let from = Vector3::new(distance * angle.cos(), distance * angle.sin(), height);
    let aside = |stream: &mut Stream| stream.between(-0.1, 0.1);
    let target = Vector3::new(
        aside(&mut stream),
        aside(&mut stream),
        0.95 + aside(&mut stream),
    );
    let roll = stream.between(-2.0, 2.0).to_radians();
    looking(from, target, roll)
}

fn looking(from: Vector3<f64>, target: Vector3<f64>, roll: f64) -> Transform<Room, Sensor> {
    let ahead = (target - from).normalize();
    let right = ahead.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[right, ahead.cross(&right), ahead]);
    let level = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let rolled = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
    Transform::from_parts(from, level * rolled)
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::Position;

    use super::*;

    #[test]
    fn every_sensor_looks_at_the_middle_upright_from_where_it_should() {
        for layout in [Layout::Ring, Layout::Arc] {
            let scenario = Scenario {
                sensors: 6,
                layout,
                ..Scenario::default()
            };
            for index in 0..6 {
                let pose = room_from_sensor(&scenario, index);
                let middle = pose.inverse().apply(Position::new(0.0, 0.0, 0.95)).vector();
                assert!(middle.x.abs() < 0.25 && middle.y.abs() < 0.25 && middle.z > 2.4);
                let above = pose.inverse().apply(Position::new(0.0, 0.0, 1.95)).vector();
                assert!(above.y < middle.y - 0.8, "y points down");
                let place = pose.origin().vector();
                assert!((0.7..=1.9).contains(&place.z));
                assert!((2.6..=3.2).contains(&place.xy().norm()));
                if layout == Layout::Arc {
                    assert!(place.y.atan2(place.x).abs() <= 56f64.to_radians());
                }
            }
        }
    }

    #[test]
    fn the_view_is_57_by_43_degrees() {
        let at = |x_deg: f64, y_deg: f64| {
            in_view(Vector3::new(x_deg.to_radians().tan(), y_deg.to_radians().tan(), 1.0) * 2.0)
        };
        assert!(at(28.4, 0.0) && !at(28.6, 0.0) && at(0.0, 21.4) && !at(0.0, 21.6));
        assert!(!in_view(Vector3::new(0.0, 0.0, -1.0)));
    }
}
