//! The axes and units that tools expect, and the way there from the room's.
//!
//! Room: X forward, Y left, Z up, right-handed, metres. A person of the rest pose faces X.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::choice::choices;

choices! {
    /// Which way the axes of a file point, told by what is ahead, left and up of somebody who faces the room's X.
    Axes, "axes" {
        /// X forward, Y left, Z up: as everywhere in Posefuse. Right-handed.
        Room = "room",
        /// Z forward, X left, Y up: BVH, glTF, FBX. Right-handed.
        YUp = "y-up",
        /// X forward, Y up, Z right: OpenSim. Right-handed.
        OpenSim = "opensim",
        /// -Y forward, X left, Z up: a figure as Blender's front view shows it. Right-handed.
        Blender = "blender",
        /// Z forward, X right, Y up: Unity. Left-handed.
        Unity = "unity",
        /// X forward, Y right, Z up: Unreal. Left-handed.
        Unreal = "unreal",
    }
}

choices! {
    /// What lengths of a file are counted in.
    Unit, "unit" {
        /// Metres.
        Metre = "m",
        /// Centimetres.
        Centimetre = "cm",
        /// Millimetres.
        Millimetre = "mm",
    }
}

impl Axes {
    /// Takes coordinates of the room to these axes. Its determinant is -1 for left-handed axes.
    pub fn from_room(self) -> Matrix3<f64> {
        let (forward, left, up) = (Vector3::x(), Vector3::y(), Vector3::z());
        let [x, y, z] = match self {
            Self::Room => [forward, left, up],
            Self::YUp => [left, up, forward],
            Self::OpenSim => [forward, up, -left],
            Self::Blender => [left, -forward, up],
            Self::Unity => [-left, up, forward],
            Self::Unreal => [forward, -left, up],
        };
        Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()])
    }

    /// Whether a screw that turns clockwise goes ahead.
    pub fn is_right_handed(self) -> bool {
        self.from_room().determinant() > 0.0
    }

    /// A rotation of the room's axes, as the same rotation of these.
    pub(crate) fn rotation(self, rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let axes = self.from_room();
        // What is mirrored turns the other way.
        let axis = axes * rotation.imag() * axes.determinant();
        UnitQuaternion::new_unchecked(Quaternion::from_parts(rotation.w, axis))
    }
}

impl Unit {
    /// How many of it are a metre.
    pub fn per_metre(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 100.0,
            Self::Millimetre => 1000.0,
        }
    }

    /// Decimals that give a micrometre.
    pub(crate) fn decimals(self) -> usize {
        match self {
            Self::Metre => 6,
            Self::Centimetre => 4,
            Self::Millimetre => 3,
        }
    }
}

/// The axes and the unit of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Space {
    /// Which way the axes point.
    pub axes: Axes,
    /// What lengths are counted in.
    pub unit: Unit,
}

impl Space {
    /// A length or place of the room (metres) as the file has it.
    pub fn vector(self, room: Vector3<f64>) -> Vector3<f64> {
        self.axes.from_room() * room * self.unit.per_metre()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_see_a_person_who_looks_ahead_as_they_say() {
        let (forward, up) = (Vector3::x(), Vector3::z());
        for (axes, ahead, above) in [
            (Axes::YUp, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
            (Axes::OpenSim, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            (Axes::Blender, [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]),
            (Axes::Unity, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
            (Axes::Unreal, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        ] {
            assert_eq!(axes.from_room() * forward, Vector3::from(ahead), "{axes}");
            assert_eq!(axes.from_room() * up, Vector3::from(above), "{axes}");
        }
        let left_handed: Vec<Axes> = Axes::ALL
            .iter()
            .copied()
            .filter(|axes| !axes.is_right_handed())
            .collect();
        assert_eq!(left_handed, [Axes::Unity, Axes::Unreal]);
    }

    #[test]
    fn a_turn_stays_the_same_turn_in_other_axes() {
        let turn = UnitQuaternion::from_euler_angles(0.3, -1.1, 2.0);
        let way = Vector3::new(0.2, -0.5, 1.4);
        for axes in Axes::ALL.iter() {
            let there = axes.rotation(&turn) * (axes.from_room() * way);
            assert!((there - axes.from_room() * (turn * way)).norm() < 1e-12);
        }
    }
}
