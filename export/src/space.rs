//! The axes and the unit of a file.

use nalgebra::Vector3;
use posefuse_skeleton::Axes;
use serde::{Deserialize, Serialize};

use crate::choice::choices;

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
