//! `posefuse agent nite`: a sensor tracked by NiTE 2.2, where the user has it.

use std::path::PathBuf;

use clap::Args;
use posefuse_agent::source::NiteConfig;

/// Which sensor, and how NiTE sees it.
#[derive(Debug, Args)]
pub(super) struct NiteArgs {
    /// The sensor: its URI or serial number, as `posefuse devices` lists them [default: the first]
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,
    /// NiTE's library or its folder [default: NITE2_REDIST64, then the system's]
    #[arg(long, value_name = "PATH")]
    library: Option<PathBuf>,
    /// NiTE's image is not mirrored. PrimeSense's driver mirrors it unless told otherwise; if a calibration finds left and
    /// right exchanged, it is the other way
    #[arg(long)]
    not_mirrored: bool,
}

impl NiteArgs {
    pub(super) fn config(&self) -> NiteConfig {
        NiteConfig {
            device: self.device.clone(),
            library: self.library.clone(),
            mirrored: !self.not_mirrored,
        }
    }
}
