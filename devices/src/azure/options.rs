//! What can be chosen of an Azure Kinect.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// The depth camera's mode: field of view and reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthMode {
    /// 320 x 288, 75 x 65 degrees, 0.5 to 5.5 m.
    NarrowBinned,
    /// 640 x 576, 75 x 65 degrees, 0.5 to 3.9 m.
    #[default]
    Narrow,
    /// 512 x 512, 120 degrees, 0.25 to 2.9 m.
    WideBinned,
}

impl DepthMode {
    pub(super) fn number(self) -> i32 {
        match self {
            Self::NarrowBinned => 1,
            Self::Narrow => 2,
            Self::WideBinned => 3,
        }
    }

    /// Horizontal and vertical field of view, degrees, and from where to where it measures, metres, by the data sheet.
    pub fn view(self) -> ([f64; 2], [f64; 2]) {
        match self {
            Self::NarrowBinned => ([75.0, 65.0], [0.5, 5.46]),
            Self::Narrow => ([75.0, 65.0], [0.5, 3.86]),
            Self::WideBinned => ([120.0, 120.0], [0.25, 2.88]),
        }
    }
}

/// What the tracker's network runs on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Processing {
    /// What the library thinks best.
    #[default]
    Gpu,
    /// No graphics card, some frames a second.
    Cpu,
    /// NVIDIA, by CUDA.
    Cuda,
    /// NVIDIA, by TensorRT.
    TensorRt,
    /// Windows, any graphics card.
    DirectMl,
}

impl Processing {
    pub(super) fn number(self) -> i32 {
        match self {
            Self::Gpu => 0,
            Self::Cpu => 1,
            Self::Cuda => 2,
            Self::TensorRt => 3,
            Self::DirectMl => 4,
        }
    }
}

/// Which device, and how people are tracked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The folder of both libraries; absent: K4A_LIBRARY_PATH and K4ABT_LIBRARY_PATH, then where the system keeps them.
    pub folder: Option<PathBuf>,
    /// A device's serial number, or its number from 0; absent: the first.
    pub device: Option<String>,
    /// The depth camera's mode.
    pub depth_mode: DepthMode,
    /// What the network runs on.
    pub processing: Processing,
}
