//! What is not known of each sensor, from the bundle's covariance: in the room, beside the other sensors.

use nalgebra::{DMatrix, Isometry3, SMatrix, Vector3};
use posefuse_skeleton::PoseSigma;

use crate::SensorCovariance;
use crate::graph::Placed;
use crate::normal::PER_SENSOR;

type Seven = SMatrix<f64, 7, 7>;

/// Covariance and standard deviations of every sensor; `None` for those that were held.
///
/// A motion, a delay and a drift that all sensors share are no error unless some are held: the mean over the sensors is taken
/// off.
pub(crate) fn posterior(
    covariance: &DMatrix<f64>,
    names: &[&str],
    placed: &[Placed],
    held: &[bool],
    room_from_world: &Isometry3<f64>,
) -> Vec<Option<(SensorCovariance, PoseSigma)>> {
    let sensors = placed.len();
    let size = PER_SENSOR * sensors;
    let mut all = covariance.view((0, 0), (size, size)).into_owned();
    if !held.iter().any(|held| *held) {
        let mut aligned = DMatrix::<f64>::identity(size, size);
        for i in 0..size {
            for sensor in 0..sensors {
                aligned[(i, PER_SENSOR * sensor + i % PER_SENSOR)] -= 1.0 / sensors as f64;
            }
        }
        all = &aligned * all * aligned.transpose();
    }
    let to_room = to_room(room_from_world);
    (0..sensors)
        .map(|sensor| {
            if held[sensor] {
                return None;
            }
            let first = PER_SENSOR * sensor;
            let own = all.fixed_view::<7, 7>(first, first).into_owned();
            let matrix = to_room * own * to_room.transpose();
            let lens = room_from_world * placed[sensor].world_from_sensor.translation.vector;
            let row = SensorCovariance {
                name: names[sensor].to_owned(),
                matrix: std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)])),
            };
            Some((row, sigma(&matrix, &lens)))
        })
        .collect()
}

/// A turn about the world's origin and a shift of what is there, as turn about and shift of the room's origin.
fn to_room(room_from_world: &Isometry3<f64>) -> Seven {
    let rotation = room_from_world.rotation.to_rotation_matrix();
    let origin = room_from_world.inverse().translation.vector;
    let mut map = Seven::identity();
    map.fixed_view_mut::<3, 3>(0, 0)
        .copy_from(rotation.matrix());
    map.fixed_view_mut::<3, 3>(3, 3)
        .copy_from(rotation.matrix());
    map.fixed_view_mut::<3, 3>(3, 0)
        .copy_from(&(-rotation.matrix() * origin.cross_matrix()));
    map
}

/// Of a sensor whose lens is at `lens` in the room.
fn sigma(matrix: &Seven, lens: &Vector3<f64>) -> PoseSigma {
    let mut shift = SMatrix::<f64, 3, 7>::zeros();
    shift
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&-lens.cross_matrix());
    shift.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    let position = shift * matrix * shift.transpose();
    PoseSigma {
        position_m: position.trace().max(0.0).sqrt(),
        rotation_rad: matrix.fixed_view::<3, 3>(0, 0).trace().max(0.0).sqrt(),
        time_s: matrix[(6, 6)].max(0.0).sqrt(),
    }
}
