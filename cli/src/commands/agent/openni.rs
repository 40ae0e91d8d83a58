//! The agent of a depth sensor that OpenNI2 reads, or of a recording of one.

use std::path::PathBuf;

use clap::Args;
use posefuse_agent::source::OpenNiConfig;
use posefuse_devices::openni::WantedMode;

/// Which sensor or recording, and how it is read.
#[derive(Debug, Args)]
pub(super) struct OpenNiArgs {
    /// The sensor: its URI or serial number as `posefuse devices` lists them, or a recording (FILE.oni) [default: the
    /// first sensor that can be opened]
    #[arg(long, value_name = "URI|SERIAL|FILE")]
    device: Option<String>,
    /// The depth mode, as `posefuse devices` lists them [default: that nearest to 320x240 at 30 fps]
    #[arg(long, value_name = "WxH@FPS")]
    mode: Option<WantedMode>,
    /// Read a recording as fast as people are found in it, every frame, instead of in its own time
    #[arg(long)]
    fast: bool,
    /// OpenNI2's library or the folder that it lies in [default: OPENNI2_REDIST, then the system's]
    #[arg(long, value_name = "PATH")]
    library: Option<PathBuf>,
}

impl OpenNiArgs {
    pub(super) fn config(&self) -> OpenNiConfig {
        OpenNiConfig {
            device: self.device.clone(),
            mode: self.mode.map(|mode| mode.to_string()),
            fast: self.fast,
            library: self.library.clone(),
            ..OpenNiConfig::default()
        }
    }
}
