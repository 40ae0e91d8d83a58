//! The kinds of files, and what each can say.

use serde::{Deserialize, Serialize};

use crate::Axes;
use crate::choice::choices;
use crate::space::{Space, Unit};

choices! {
    /// A kind of file.
    Format, "format" {
        /// Joints as a table: a row for each person and frame.
        Csv = "csv",
        /// Joints as a table: a row for each joint of each person and frame.
        CsvTidy = "csv-tidy",
        /// The bones of a rig as a table, with their rotations: a row for each bone of each person and frame.
        CsvBones = "csv-bones",
        /// Joints as columns, rows as in `csv-tidy`: pandas, DuckDB, R.
        Parquet = "parquet",
        /// Joints as markers for OpenSim, one file a person.
        Trc = "trc",
        /// Joints as markers for gait labs.
        C3d = "c3d",
        /// A rig with rotations as text, one file a person: nearly every animation program.
        Bvh = "bvh",
        /// A rig with rotations and a plain figure to show it: Blender, web pages, viewers.
        Glb = "glb",
        /// A rig with rotations, one file a person: MotionBuilder, Maya, Unity, Unreal.
        Fbx = "fbx",
    }
}

impl Format {
    /// What its files end with.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Csv => ".csv",
            Self::CsvTidy => ".tidy.csv",
            Self::CsvBones => ".bones.csv",
            Self::Parquet => ".parquet",
            Self::Trc => ".trc",
            Self::C3d => ".c3d",
            Self::Bvh => ".bvh",
            Self::Glb => ".glb",
            Self::Fbx => ".fbx",
        }
    }

    /// Whether it holds joint rotations of a rig rather than the places of joints.
    pub fn is_rig(self) -> bool {
        matches!(self, Self::CsvBones | Self::Bvh | Self::Glb | Self::Fbx)
    }

    /// Whether each person has a file of their own.
    pub fn is_one_person(self) -> bool {
        matches!(self, Self::Trc | Self::Bvh | Self::Fbx)
    }

    /// What its readers expect unless they are told otherwise.
    pub fn usual_space(self) -> Space {
        let (axes, unit) = match self {
            Self::Csv | Self::CsvTidy | Self::CsvBones | Self::Parquet => (Axes::Room, Unit::Metre),
            Self::Trc => (Axes::OpenSim, Unit::Millimetre),
            Self::C3d => (Axes::Room, Unit::Millimetre),
            Self::Bvh | Self::Fbx => (Axes::YUp, Unit::Centimetre),
            Self::Glb => (Axes::YUp, Unit::Metre),
        };
        Space { axes, unit }
    }

    /// Why its readers would misunderstand files of this space; `None` where they do not.
    pub(crate) fn objection(self, space: Space) -> Option<String> {
        let Space { axes, unit } = space;
        match self {
            Self::Csv | Self::CsvTidy | Self::CsvBones | Self::Parquet => None,
            Self::Glb if axes != Axes::YUp || unit != Unit::Metre => Some(
                "a GLB is always `y-up` in `m`, by its standard; every reader converts by itself"
                    .to_owned(),
            ),
            Self::Fbx if axes != Axes::YUp => Some(
                "an FBX is written `y-up` and says so; every reader converts by itself".to_owned(),
            ),
            _ if !axes.is_right_handed() => Some(format!(
                "readers of {self} take axes to be right-handed, `{axes}` are left-handed and would show people mirrored; \
                 use `{}`",
                self.usual_space().axes
            )),
            _ => None,
        }
    }
}
