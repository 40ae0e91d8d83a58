//! Origin and heading of the room set by hand: all sensors are moved together, so nothing that was measured changes.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use posefuse_skeleton::{Calibration, FloorSource, Room, Transform};

/// The calibration in a room whose frame is moved: what stood at `p` stands at `turned(p) + shift_m`, turned about the
/// old origin's vertical by `turn_rad`, anticlockwise seen from above. Its floor then counts as set by hand.
pub fn moved(calibration: &Calibration, turn_rad: f64, shift_m: Vector3<f64>) -> Calibration {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad);
    let new_from_old: Transform<Room, Room> =
        Transform::from_isometry(Isometry3::from_parts(shift_m.into(), turn));
    let mut moved = calibration.clone();
    moved.floor = FloorSource::Manual;
    for pose in moved.sensors.values_mut() {
        pose.room_from_sensor = new_from_old.then(&pose.room_from_sensor);
    }
    moved
}
