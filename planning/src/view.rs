//! What one sensor sees.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_skeleton::{Position, Room, Sensor, Transform};

use crate::Light;

/// A sensor in the room, there or only planned.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// What it is called.
    pub name: String,
    /// The device.
    pub model: String,
    /// Whether it is only planned.
    pub planned: bool,
    /// Where it stands and looks.
    pub room_from_sensor: Transform<Room, Sensor>,
    /// Whole horizontal and vertical field of view, degrees.
    pub view_deg: [f64; 2],
    /// From where to where it measures, metres along the optical axis.
    pub range_m: [f64; 2],
    /// How it measures.
    pub light: Light,
    /// View or range are not known, and the usual ones were taken.
    pub assumed: bool,
}

/// Sensors look into each other when each stands within 30 degrees of the other's axis; the cosine of that.
const STARE: f64 = 0.866;

/// A view made ready for many questions.
#[derive(Clone, Debug)]
pub(crate) struct Cone {
    sensor_from_room: Transform<Sensor, Room>,
    place: Vector3<f64>,
    slopes: [f64; 2],
    range_m: [f64; 2],
}

impl View {
    pub(crate) fn cone(&self) -> Cone {
        Cone {
            sensor_from_room: self.room_from_sensor.inverse(),
            place: self.room_from_sensor.origin().vector(),
            slopes: self.view_deg.map(slope),
            range_m: self.range_m,
        }
    }

    /// Whether it looks into a sensor that stands there.
    pub(crate) fn stares_at(&self, at: Position<Room>) -> bool {
        let way = at.vector() - self.room_from_sensor.origin().vector();
        self.forward().dot(&way) > STARE * way.norm()
    }

    /// The direction it looks in.
    pub(crate) fn forward(&self) -> Vector3<f64> {
        self.room_from_sensor.rotate(Vector3::z())
    }
}

/// The tangent of half a field of view.
pub(crate) fn slope(view_deg: f64) -> f64 {
    (view_deg.clamp(0.0, 179.0) / 2.0).to_radians().tan()
}

impl Cone {
    /// Whether a point is within view and range.
    pub(crate) fn sees(&self, at: Position<Room>) -> bool {
        let at = self.sensor_from_room.apply(at).vector();
        (self.range_m[0]..=self.range_m[1]).contains(&at.z) && self.looks_at(&at)
    }

    /// In which direction of the floor the sensor stands, seen from a place, radians.
    pub(crate) fn bearing_from(&self, [x, y]: [f64; 2]) -> f64 {
        (self.place.y - y).atan2(self.place.x - x)
    }

    fn looks_at(&self, at: &Vector3<f64>) -> bool {
        at.x.abs() <= at.z * self.slopes[0] && at.y.abs() <= at.z * self.slopes[1]
    }
}

/// A sensor that stands upright at one place and looks at another. `None`: the two are the same, or not finite.
pub fn look_at(from: Position<Room>, target: Position<Room>) -> Option<Transform<Room, Sensor>> {
    let forward = (target.vector() - from.vector()).try_normalize(1e-6)?;
    if !from.is_finite() || !target.is_finite() {
        return None;
    }
    // Straight down or up, the room's x is above.
    let right = forward
        .cross(&Vector3::z())
        .try_normalize(1e-6)
        .or_else(|| forward.cross(&Vector3::x()).try_normalize(1e-6))?;
    let down = forward.cross(&right);
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]));
    let rotation = UnitQuaternion::from_rotation_matrix(&axes);
    Some(Transform::from_parts(from.vector(), rotation))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{MODELS, View};

    pub(crate) fn at(from: [f64; 3], target: [f64; 3]) -> View {
        let [from, target] = [from, target].map(|[x, y, z]| Position::new(x, y, z));
        let model = &MODELS[0];
        View {
            name: "a".to_owned(),
            model: model.name.to_owned(),
            planned: true,
            room_from_sensor: look_at(from, target).unwrap(),
            view_deg: model.view_deg,
            range_m: model.range_m,
            light: model.light,
            assumed: false,
        }
    }

    #[test]
    fn a_sensor_stands_upright_and_sees_what_is_before_it() {
        let view = at([0.0, 0.0, 1.0], [3.0, 0.0, 1.0]);
        let right = view.room_from_sensor.rotate(Vector3::x());
        assert!(
            (right - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-12,
            "{right}"
        );
        let cone = view.cone();
        let sees = |x: f64, y: f64, z: f64| cone.sees(Position::new(x, y, z));
        assert!(sees(2.0, 0.0, 1.0) && sees(2.0, 1.4, 1.0) && !sees(2.0, 1.5, 1.0));
        assert!(sees(2.0, 0.0, 2.1) && !sees(2.0, 0.0, 2.2));
        assert!(!sees(0.4, 0.0, 1.0) && !sees(4.6, 0.0, 1.0) && !sees(-2.0, 0.0, 1.0));
    }

    #[test]
    fn straight_down_is_a_direction_too_and_nowhere_is_none() {
        let down = at([0.0, 0.0, 3.0], [0.0, 0.0, 0.0]);
        assert!(down.cone().sees(Position::new(0.0, 0.0, 0.2)));
        let here = Position::new(1.0, 1.0, 1.0);
        assert_eq!(look_at(here, here), None);
        assert_eq!(look_at(here, Position::new(f64::NAN, 0.0, 0.0)), None);
    }

    proptest! {
        #[test]
        fn it_always_sees_what_it_looks_at(
            from in prop::array::uniform3(-5.0..5.0f64), turn in 0.0..6.3f64, tilt in -1.5..1.5f64, distance in 0.6..4.4f64,
        ) {
            let way = [tilt.cos() * turn.cos(), tilt.cos() * turn.sin(), tilt.sin()];
            let to = [0, 1, 2].map(|axis| from[axis] + distance * way[axis]);
            let view = at(from, to);
            prop_assert!(view.cone().sees(Position::new(to[0], to[1], to[2])));
            let right = view.room_from_sensor.rotate(Vector3::x());
            prop_assert!(right.z.abs() < 1e-9, "level");
        }
    }
}
