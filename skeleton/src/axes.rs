//! The axes that tools expect, and the way there from the room's.
//!
//! Room: X forward, Y left, Z up, right-handed, metres. A person of the rest pose faces X.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Which way axes point, told by what is ahead, left and up of somebody who faces the room's X.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axes {
    /// X forward, Y left, Z up: as everywhere in Posefuse. Right-handed.
    #[default]
    Room,
    /// Z forward, X left, Y up: BVH, glTF, FBX, OpenGL, TouchDesigner. Right-handed.
    YUp,
    /// X forward, Y up, Z right: OpenSim. Right-handed.
    #[serde(rename = "opensim")]
    OpenSim,
    /// -Y forward, X left, Z up: a figure as Blender's front view shows it. Right-handed.
    Blender,
    /// Z forward, X right, Y up: Unity, VMC. Left-handed.
    Unity,
    /// X forward, Y right, Z up: Unreal. Left-handed.
    Unreal,
}

impl Axes {
    /// Every one of them.
    pub const ALL: &[Self] = &[
        Self::Room,
        Self::YUp,
        Self::OpenSim,
        Self::Blender,
        Self::Unity,
        Self::Unreal,
    ];

    /// Its name in settings, on command lines and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Room => "room",
            Self::YUp => "y-up",
            Self::OpenSim => "opensim",
            Self::Blender => "blender",
            Self::Unity => "unity",
            Self::Unreal => "unreal",
        }
    }

    /// Which way they point, in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Room => "X forward, Y left, Z up, right-handed",
            Self::YUp => "Z forward, X left, Y up, right-handed",
            Self::OpenSim => "X forward, Y up, Z right, right-handed",
            Self::Blender => "-Y forward, X left, Z up, right-handed",
            Self::Unity => "Z forward, X right, Y up, left-handed",
            Self::Unreal => "X forward, Y right, Z up, left-handed",
        }
    }

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
    pub fn rotation(self, room: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let axes = self.from_room();
        // What is mirrored turns the other way.
        let axis = axes * room.imag() * axes.determinant();
        UnitQuaternion::new_unchecked(Quaternion::from_parts(room.w, axis))
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Axes {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let mut all = Self::ALL.iter().copied();
        all.find(|axes| axes.name() == name).ok_or_else(|| {
            let known: Vec<&str> = Self::ALL.iter().map(|axes| axes.name()).collect();
            format!(
                "no axes are called `{name}`; there are {}",
                known.join(", ")
            )
        })
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
