//! What each tool wants to be given.

use serde::{Deserialize, Serialize};

use crate::Axes;
use crate::Names;
use crate::choice::choices;
use crate::format::Format;
use crate::space::{Space, Unit};

choices! {
    /// A tool, and with it format, axes, unit, bone names and rate.
    Preset, "preset" {
        /// GLB, read by Blender without any setting.
        Blender = "blender",
        /// FBX with the bone names that Unity's humanoid avatar finds by itself.
        Unity = "unity",
        /// FBX with the bone names of Unreal's mannequin, 30 frames per second.
        Unreal = "unreal",
        /// FBX with the bone names that MotionBuilder characterises by itself.
        MotionBuilder = "motionbuilder",
        /// TRC for scaling and inverse kinematics.
        OpenSim = "opensim",
        /// FBX with Mixamo's bone names, 30 frames per second.
        Mixamo = "mixamo",
        /// CSV with the joints of Kinect v2, Y up, 30 frames per second.
        Kinect = "kinect",
    }
}

impl Preset {
    /// The format, unless another one is asked for.
    pub fn format(self) -> Format {
        match self {
            Self::Blender => Format::Glb,
            Self::Unity | Self::Unreal | Self::MotionBuilder | Self::Mixamo => Format::Fbx,
            Self::OpenSim => Format::Trc,
            Self::Kinect => Format::Csv,
        }
    }

    /// The tool's own axes and unit for joints, or what it takes a rig of this format to be in.
    pub fn space(self, format: Format) -> Space {
        if format.is_rig() {
            let mut usual = format.usual_space();
            if self == Self::Blender && format == Format::Bvh {
                // Its importer's scale is 1 unless somebody sets it.
                usual.unit = Unit::Metre;
            }
            return usual;
        }
        let (axes, unit) = match self {
            Self::Blender => (Axes::Blender, Unit::Metre),
            Self::Unity => (Axes::Unity, Unit::Metre),
            Self::Unreal => (Axes::Unreal, Unit::Centimetre),
            Self::MotionBuilder | Self::Mixamo => (Axes::YUp, Unit::Centimetre),
            Self::OpenSim => (Axes::OpenSim, Unit::Millimetre),
            Self::Kinect => (Axes::YUp, Unit::Metre),
        };
        let wanted = Space { axes, unit };
        match format.objection(wanted) {
            Some(_) => format.usual_space(),
            None => wanted,
        }
    }

    /// The names of bones.
    pub fn names(self) -> Names {
        match self {
            Self::Blender | Self::Unity => Names::Humanoid,
            Self::Unreal => Names::Unreal,
            Self::MotionBuilder | Self::OpenSim => Names::MotionBuilder,
            Self::Mixamo => Names::Mixamo,
            Self::Kinect => Names::Kinect,
        }
    }

    /// Frames per second; `None`: as the take has them.
    pub fn rate_hz(self) -> Option<f64> {
        match self {
            Self::Unreal | Self::Mixamo | Self::Kinect => Some(30.0),
            Self::Blender | Self::Unity | Self::MotionBuilder | Self::OpenSim => None,
        }
    }
}
