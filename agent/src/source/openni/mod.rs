//! Depth through OpenNI2: a sensor on this computer, or a recording (`.oni`).

mod device;
mod file;

use std::path::PathBuf;
use std::sync::Arc;

use posefuse_bodytrack::TrackerConfig;
use posefuse_devices::openni::{OpenNi, WantedMode, is_recording};
use serde::{Deserialize, Serialize};

use super::{DepthSource, SourceError};
use crate::Clock;

/// Which sensor or recording, and how it is read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OpenNiConfig {
    /// A URI, a serial number, or a recording's file; absent: the first sensor that can be opened.
    pub device: Option<String>,
    /// The depth mode, `320x240@30` or `320x240`; absent: the one nearest to that. Recordings have one only.
    pub mode: Option<String>,
    /// Read a recording as fast as it is tracked, every frame of it, instead of in its own time.
    pub fast: bool,
    /// OpenNI2's library or the folder that it lies in; absent: OPENNI2_REDIST, then the system's.
    pub library: Option<PathBuf>,
    /// How people are found in its images.
    pub tracker: TrackerConfig,
}

/// Opens its depth, without the tracker. A sensor that is not there is waited for.
///
/// # Errors
/// OpenNI2 is not installed, the recording cannot be read, or the mode is none of the sensor's.
pub fn open(
    config: &OpenNiConfig,
    clock: &Arc<dyn Clock>,
) -> Result<Box<dyn DepthSource>, SourceError> {
    let mode = config
        .mode
        .as_deref()
        .map(str::parse::<WantedMode>)
        .transpose();
    let mode = mode.map_err(|why| SourceError::Final(format!("openni source: {why}")))?;
    let fatal =
        |error: posefuse_devices::openni::OpenNiError| SourceError::Final(error.to_string());
    let recording = config.device.as_deref().filter(|name| is_recording(name));
    if let Some(file) = recording {
        // OpenNI2 says no more of a missing file than that it failed.
        std::fs::File::open(file).map_err(|error| {
            SourceError::Final(format!("the recording `{file}` cannot be read: {error}"))
        })?;
    }
    let openni = OpenNi::load(config.library.as_deref()).map_err(fatal)?;
    Ok(match recording {
        Some(file) => Box::new(
            file::FileSource::open(&openni, file, config.fast, clock.clone()).map_err(fatal)?,
        ),
        None => Box::new(device::DeviceSource::new(
            openni,
            config.device.clone(),
            mode,
            clock.clone(),
        )?),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SystemClock;

    #[test]
    fn without_the_library_the_agent_says_what_to_install() {
        let nowhere = tempfile::tempdir().unwrap();
        let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
        let failed = |config: OpenNiConfig| match open(&config, &clock) {
            Err(SourceError::Final(why)) => why,
            other => panic!("{:?}", other.err()),
        };
        let library = Some(nowhere.path().to_owned());
        let why = failed(OpenNiConfig {
            library: library.clone(),
            ..OpenNiConfig::default()
        });
        assert!(why.contains("apt install libopenni2-0"), "{why}");
        let device = Some("nothing.oni".to_owned());
        let why = failed(OpenNiConfig {
            library: library.clone(),
            device,
            ..OpenNiConfig::default()
        });
        assert!(why.contains("nothing.oni"), "{why}");
        let mode = Some("large".to_owned());
        let why = failed(OpenNiConfig {
            library,
            mode,
            ..OpenNiConfig::default()
        });
        assert!(why.contains("320x240@30"), "{why}");
    }
}
