//! Coordinate frames as type parameters, so that a sensor-frame point cannot meet a room-frame point.
//!
//! - [`Sensor`]: optical axes of one sensor: x right, y down, z forward (out of the lens), metres.
//! - [`Room`]: right-handed, x forward, y left, z up, metres, origin on the floor.
//!
//! A transform is named `to_from_from`, e.g. `room_from_sensor`; adjacent names must match when composing:
//!
//! ```
//! use posefuse_skeleton::{Position, Room, Sensor, Transform};
//! let room_from_sensor: Transform<Room, Sensor> = Transform::identity();
//! let seen: Position<Sensor> = Position::new(0.1, 0.2, 3.0);
//! let placed: Position<Room> = room_from_sensor.apply(seen);
//! ```
//!
//! ```compile_fail
//! use posefuse_skeleton::{Position, Room, Sensor};
//! let seen: Position<Sensor> = Position::new(0.0, 0.0, 1.0);
//! let placed: Position<Room> = Position::new(0.0, 0.0, 1.0);
//! let nonsense = seen.distance(placed); // different frames do not mix
//! ```

use std::fmt;
use std::marker::PhantomData;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Something positions can be expressed in. Implemented by the markers of this module only.
pub trait Frame: Copy + fmt::Debug + PartialEq + Send + Sync + 'static {
    /// The word used in messages.
    const NAME: &'static str;
}

/// One sensor's optical frame: x right, y down, z forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {}

/// The room: x forward, y left, z up, origin on the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Room {}

impl Frame for Sensor {
    const NAME: &'static str = "sensor";
}

impl Frame for Room {
    const NAME: &'static str = "room";
}

/// A point in frame `F`, metres.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Position<F: Frame> {
    point: Point3<f64>,
    #[serde(skip)]
    frame: PhantomData<F>,
}

impl<F: Frame> fmt::Debug for Position<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let p = &self.point;
        write!(f, "{}({:.4}, {:.4}, {:.4})", F::NAME, p.x, p.y, p.z)
    }
}

impl<F: Frame> Position<F> {
    /// The point with these coordinates, metres.
    pub fn new(x: f64, y: f64, z: f64) -> Self {
        Self::from_point(Point3::new(x, y, z))
    }

    /// States that `point` is expressed in `F`.
    pub fn from_point(point: Point3<f64>) -> Self {
        Self {
            point,
            frame: PhantomData,
        }
    }

    /// States that `coordinates` are those of a point in `F`.
    pub fn from_vector(coordinates: Vector3<f64>) -> Self {
        Self::from_point(Point3::from(coordinates))
    }

    /// The bare point, metres.
    pub fn point(self) -> Point3<f64> {
        self.point
    }

    /// The bare coordinates, metres.
    pub fn vector(self) -> Vector3<f64> {
        self.point.coords
    }

    /// Distance between two points of the same frame, metres.
    pub fn distance(self, other: Self) -> f64 {
        (self.point - other.point).norm()
    }

    /// Whether no coordinate is NaN or infinite.
    pub fn is_finite(self) -> bool {
        self.point.iter().all(|c| c.is_finite())
    }

    /// The point moved by `offset`, metres.
    pub fn moved(self, offset: Vector3<f64>) -> Self {
        Self::from_point(self.point + offset)
    }

    /// The point at `share` (0 here, 1 there) of the way to `other`.
    pub fn lerp(self, other: Self, share: f64) -> Self {
        Self::from_point(self.point + (other.point - self.point) * share)
    }
}

/// A rigid motion that takes coordinates of `From` to coordinates of `To`.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Transform<To: Frame, From: Frame> {
    isometry: Isometry3<f64>,
    #[serde(skip)]
    frames: PhantomData<(To, From)>,
}

impl<To: Frame, From: Frame> Default for Transform<To, From> {
    fn default() -> Self {
        Self::identity()
    }
}

impl<To: Frame, From: Frame> fmt::Debug for Transform<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let t = &self.isometry.translation.vector;
        let (roll, pitch, yaw) = self.isometry.rotation.euler_angles();
        write!(
            f,
            "{}_from_{}(t {:.4} {:.4} {:.4} m, rpy {:.2} {:.2} {:.2} deg)",
            To::NAME,
            From::NAME,
            t.x,
            t.y,
            t.z,
            roll.to_degrees(),
            pitch.to_degrees(),
            yaw.to_degrees()
        )
    }
}

impl<To: Frame, From: Frame> Transform<To, From> {
    /// The motion that changes nothing.
    pub fn identity() -> Self {
        Self::from_isometry(Isometry3::identity())
    }

    /// States that `isometry` maps `From` to `To`.
    pub fn from_isometry(isometry: Isometry3<f64>) -> Self {
        Self {
            isometry,
            frames: PhantomData,
        }
    }

    /// From a translation (metres) and a rotation, applied rotation first.
    pub fn from_parts(translation: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        Self::from_isometry(Isometry3::from_parts(translation.into(), rotation))
    }

    /// The bare motion.
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }

    /// Where the origin of `From` lies in `To`.
    pub fn origin(&self) -> Position<To> {
        Position::from_vector(self.isometry.translation.vector)
    }

    /// The rotation part.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.isometry.rotation
    }

    /// The same point, expressed in `To`.
    pub fn apply(&self, position: Position<From>) -> Position<To> {
        Position::from_point(self.isometry.transform_point(&position.point))
    }

    /// The same free vector (velocity, offset), expressed in `To`.
    pub fn rotate(&self, vector: Vector3<f64>) -> Vector3<f64> {
        self.isometry.rotation * vector
    }

    /// The same covariance (m^2), expressed in `To`.
    pub fn rotate_covariance(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        let rotation: Rotation3<f64> = self.isometry.rotation.to_rotation_matrix();
        rotation.matrix() * covariance * rotation.matrix().transpose()
    }

    /// The way back.
    pub fn inverse(&self) -> Transform<From, To> {
        Transform::from_isometry(self.isometry.inverse())
    }

    /// `to_from_from * from_from_other = to_from_other`.
    pub fn then<Other: Frame>(
        &self,
        from_from_other: &Transform<From, Other>,
    ) -> Transform<To, Other> {
        Transform::from_isometry(self.isometry * from_from_other.isometry)
    }

    /// Whether every number of it is finite.
    pub fn is_finite(&self) -> bool {
        self.isometry
            .translation
            .vector
            .iter()
            .all(|v| v.is_finite())
            && self.isometry.rotation.coords.iter().all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transform_and_its_inverse_cancel() {
        let room_from_sensor: Transform<Room, Sensor> = Transform::from_parts(
            Vector3::new(1.0, -2.0, 0.5),
            UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0),
        );
        let seen = Position::<Sensor>::new(0.3, -0.4, 2.7);
        let back = room_from_sensor
            .inverse()
            .apply(room_from_sensor.apply(seen));
        assert!(seen.distance(back) < 1e-12);
        let round: Transform<Sensor, Sensor> = room_from_sensor.inverse().then(&room_from_sensor);
        assert!(round.isometry().translation.vector.norm() < 1e-12);
    }

    #[test]
    fn covariance_turns_with_the_frame() {
        let quarter_turn: Transform<Room, Sensor> = Transform::from_parts(
            Vector3::zeros(),
            UnitQuaternion::from_euler_angles(0.0, 0.0, 90f64.to_radians()),
        );
        let turned =
            quarter_turn.rotate_covariance(&Matrix3::from_diagonal(&Vector3::new(4.0, 1.0, 1.0)));
        assert!((turned[(1, 1)] - 4.0).abs() < 1e-12 && (turned[(0, 0)] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn lerp_ends_where_it_says() {
        let a = Position::<Room>::new(1.0, 2.0, 3.0);
        let b = Position::<Room>::new(-1.0, 0.0, 9.0);
        assert_eq!(a.lerp(b, 0.0), a);
        assert!(a.lerp(b, 1.0).distance(b) < 1e-12);
    }
}
