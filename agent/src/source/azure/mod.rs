//! An Azure Kinect or Femto tracked by Microsoft's Body Tracking SDK, where the user has it.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use posefuse_devices::azure::{AzureBody, AzureError, AzureTracker, Options};
pub use posefuse_devices::azure::{DepthMode, Processing};
use posefuse_skeleton::JointSet;
use serde::{Deserialize, Serialize};

use super::vendor::{Tracked, Vendor, VendorSource};
use super::{Camera, Description, SensorSource, SourceBody, SourceError};
use crate::Clock;

/// How long a frame is waited for at once.
const FRAME: Duration = Duration::from_millis(500);

/// Which device, and how people are tracked.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AzureConfig {
    /// A serial number, or a number from 0; absent: the first.
    pub device: Option<String>,
    /// The folder of both libraries; absent: K4A_LIBRARY_PATH and K4ABT_LIBRARY_PATH, then the system's.
    pub library: Option<PathBuf>,
    /// The depth camera's mode.
    pub depth: DepthMode,
    /// What the network runs on.
    pub processing: Processing,
}

/// Opens it. A sensor that is not there is waited for.
///
/// # Errors
/// The libraries are not installed.
pub fn open(
    config: &AzureConfig,
    clock: &Arc<dyn Clock>,
) -> Result<Box<dyn SensorSource>, SourceError> {
    Ok(Box::new(VendorSource::new(Azure(config.clone()), clock)?))
}

struct Azure(AzureConfig);

impl Vendor for Azure {
    type Tracker = AzureTracker;

    fn description(&self) -> Description {
        let (view_deg, range_m) = self.0.depth.view();
        Description {
            model: "Azure Kinect Body Tracking".into(),
            joint_set: JointSet::AzureKinect,
            camera: Some(Camera {
                view_deg,
                range_m,
                preview: false,
            }),
        }
    }

    fn open(&self) -> Result<AzureTracker, SourceError> {
        let options = Options {
            folder: self.0.library.clone(),
            device: self.0.device.clone(),
            depth_mode: self.0.depth,
            processing: self.0.processing,
        };
        let tracker = AzureTracker::open(&options).map_err(|error| match error {
            AzureError::Missing { .. } | AzureError::NotIt { .. } => {
                SourceError::Final(error.to_string())
            }
            AzureError::NoDevice { .. } | AzureError::Call { .. } => {
                SourceError::Trouble(error.to_string())
            }
        })?;
        tracing::info!(serial = tracker.serial(), "the Azure Kinect tracks people");
        Ok(tracker)
    }

    fn read(&self, tracker: &mut AzureTracker) -> Result<Option<Tracked>, String> {
        let frame = tracker.read(FRAME).map_err(|error| error.to_string())?;
        Ok(frame.map(|frame| {
            let device_ns = i64::try_from(frame.timestamp_us)
                .unwrap_or(0)
                .saturating_mul(1000);
            (device_ns, frame.bodies.iter().map(body).collect())
        }))
    }
}

fn body(body: &AzureBody) -> SourceBody {
    SourceBody {
        tracking_id: body.id,
        joints: body.joints.to_vec(),
        orientations: body.orientations.to_vec(),
        hands_closed: [None; 2],
    }
}
