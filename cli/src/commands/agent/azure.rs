//! `posefuse agent azure`: an Azure Kinect or Femto tracked by Microsoft's Body Tracking SDK, where the user has it.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use posefuse_agent::source::AzureConfig;
use posefuse_agent::source::azure::{DepthMode, Processing};

/// Which device, and how people are tracked.
#[derive(Debug, Args)]
pub(super) struct AzureArgs {
    /// The device: its serial number, or its number from 0 [default: the first]
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,
    /// The folder of both libraries [default: K4A_LIBRARY_PATH and K4ABT_LIBRARY_PATH, then the system's]
    #[arg(long, value_name = "FOLDER")]
    library: Option<PathBuf>,
    /// The depth camera's mode
    #[arg(long, value_enum, default_value_t)]
    depth: DepthArg,
    /// What the tracker's network runs on
    #[arg(long, value_enum, default_value_t)]
    processing: ProcessingArg,
}

/// The depth camera's mode.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum DepthArg {
    /// 640 x 576, 75 x 65 degrees, up to 3.9 m.
    #[default]
    Narrow,
    /// 320 x 288, 75 x 65 degrees, up to 5.5 m.
    NarrowBinned,
    /// 512 x 512, 120 degrees, up to 2.9 m.
    WideBinned,
}

/// What the network runs on.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum ProcessingArg {
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

impl AzureArgs {
    pub(super) fn config(&self) -> AzureConfig {
        AzureConfig {
            device: self.device.clone(),
            library: self.library.clone(),
            depth: match self.depth {
                DepthArg::Narrow => DepthMode::Narrow,
                DepthArg::NarrowBinned => DepthMode::NarrowBinned,
                DepthArg::WideBinned => DepthMode::WideBinned,
            },
            processing: match self.processing {
                ProcessingArg::Gpu => Processing::Gpu,
                ProcessingArg::Cpu => Processing::Cpu,
                ProcessingArg::Cuda => Processing::Cuda,
                ProcessingArg::TensorRt => Processing::TensorRt,
                ProcessingArg::DirectMl => Processing::DirectMl,
            },
        }
    }
}
