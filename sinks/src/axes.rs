//! Which way a stream's axes point, and the way there from the room's.
//!
//! Room: X forward, Y left, Z up, right-handed, metres. A person of the rest pose faces X.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Which way the axes point, told by what is ahead, left and up of somebody who faces the room's X.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axes {
    /// X forward, Y left, Z up: as everywhere in Posefuse. Right-handed.
    #[default]
    Room,
    /// Z forward, X left, Y up: OpenGL, glTF, TouchDesigner. Right-handed.
    YUp,
    /// Z forward, X right, Y up: Unity, VMC. Left-handed.
    Unity,
    /// X forward, Y right, Z up: Unreal. Left-handed.
    Unreal,
}

impl Axes {
    /// Coordinates of the room in these axes.
    pub(crate) fn vector(self, room: Vector3<f64>) -> Vector3<f64> {
        self.axes() * room
    }

    /// A rotation of the room's axes as the same rotation of these: x, y, z, w.
    pub(crate) fn rotation(self, room: &UnitQuaternion<f64>) -> [f64; 4] {
        let axes = self.axes();
        // What is mirrored turns the other way.
        let axis = axes * room.imag() * axes.determinant();
        [axis.x, axis.y, axis.z, room.w]
    }

    fn axes(self) -> Matrix3<f64> {
        let (forward, left, up) = (Vector3::x(), Vector3::y(), Vector3::z());
        let [x, y, z] = match self {
            Self::Room => [forward, left, up],
            Self::YUp => [left, up, forward],
            Self::Unity => [-left, up, forward],
            Self::Unreal => [forward, -left, up],
        };
        Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()])
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Quaternion;

    use super::*;

    const ALL: [Axes; 4] = [Axes::Room, Axes::YUp, Axes::Unity, Axes::Unreal];

    #[test]
    fn ahead_left_and_up_are_where_tools_have_them() {
        let [forward, left, up] = [Vector3::x(), Vector3::y(), Vector3::z()];
        assert_eq!(Axes::Unity.vector(forward), Vector3::z());
        assert_eq!(Axes::Unity.vector(left), -Vector3::x());
        assert_eq!(Axes::Unity.vector(up), Vector3::y());
        assert_eq!(Axes::YUp.vector(left), Vector3::x());
        assert_eq!(Axes::Unreal.vector(left), -Vector3::y());
    }

    #[test]
    fn a_turn_stays_the_same_turn_in_other_axes() {
        let turn = UnitQuaternion::from_euler_angles(0.3, -1.1, 2.0);
        let way = Vector3::new(0.2, -0.5, 1.4);
        for axes in ALL {
            let [x, y, z, w] = axes.rotation(&turn);
            let there = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
            // A left-handed quaternion multiplies by the same formula: both tools and nalgebra use Hamilton's.
            let found = there * axes.vector(way);
            assert!((found - axes.vector(turn * way)).norm() < 1e-12, "{axes:?}");
        }
    }
}
