//! A sensor tracked by NiTE 2.2, where the user has it.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use posefuse_devices::nite::{NiteError, NiteTracker, NiteUser, Options};
use posefuse_skeleton::JointSet;
use serde::{Deserialize, Serialize};

use super::vendor::{Tracked, Vendor, VendorSource};
use super::{Description, SensorSource, SourceBody, SourceError};
use crate::Clock;

/// Which sensor, and how NiTE sees it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NiteConfig {
    /// A URI or a serial number by OpenNI2; absent: the first.
    pub device: Option<String>,
    /// NiTE's library or its folder; absent: NITE2_REDIST64, then the system's.
    pub library: Option<PathBuf>,
    /// Whether NiTE's image is mirrored, as PrimeSense's driver has it.
    pub mirrored: bool,
}

impl Default for NiteConfig {
    fn default() -> Self {
        Self {
            device: None,
            library: None,
            mirrored: true,
        }
    }
}

/// Opens it. A sensor that is not there is waited for.
///
/// # Errors
/// NiTE is not installed, or is not version 2.2.
pub fn open(
    config: &NiteConfig,
    clock: &Arc<dyn Clock>,
) -> Result<Box<dyn SensorSource>, SourceError> {
    Ok(Box::new(VendorSource::new(Nite(config.clone()), clock)?))
}

/// How long a frame is waited for before the agent looks whether it is to end.
const FRAME: Duration = Duration::from_millis(500);

struct Nite(NiteConfig);

impl Vendor for Nite {
    type Tracker = NiteTracker;

    fn description(&self) -> Description {
        Description {
            model: "NiTE 2.2".into(),
            joint_set: JointSet::Nite,
            camera: None,
        }
    }

    fn open(&self) -> Result<NiteTracker, SourceError> {
        let options = Options {
            library: self.0.library.clone(),
            device: self.0.device.clone(),
            mirrored: self.0.mirrored,
        };
        let tracker = NiteTracker::open(&options).map_err(|error| match error {
            NiteError::Missing { .. } | NiteError::NotNite { .. } => {
                SourceError::Final(error.to_string())
            }
            NiteError::Call { .. } | NiteError::Device(_) => {
                SourceError::Trouble(error.to_string())
            }
        })?;
        tracing::info!(version = tracker.version(), library = %tracker.library().display(), "NiTE tracks people");
        Ok(tracker)
    }

    fn read(&self, tracker: &mut NiteTracker) -> Result<Option<Tracked>, String> {
        let frame = tracker
            .read_within(FRAME)
            .map_err(|error| error.to_string())?;
        let Some(frame) = frame else { return Ok(None) };
        let device_ns = i64::try_from(frame.timestamp_us)
            .unwrap_or(0)
            .saturating_mul(1000);
        Ok(Some((device_ns, frame.users.iter().map(body).collect())))
    }
}

fn body(user: &NiteUser) -> SourceBody {
    SourceBody {
        tracking_id: user.id,
        joints: user.joints.to_vec(),
        orientations: Vec::new(),
        hands_closed: [None; 2],
    }
}
