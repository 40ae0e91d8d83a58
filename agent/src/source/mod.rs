//! The seam for sensors, and the sources there are.
//!
//! A source gives joints in metres in the optical frame (x right, y down, z forward) and in the order of the joint set
//! that it names. Every source stamps frames with a clock of its own; the clock echoes of the uplink are answered by
//! the same clock ([`SensorSource::clock`]), so that the server can map one to the other.

pub mod azure;
pub mod csv;
mod depth;
mod device_clock;
mod drive;
pub mod nite;
pub mod openni;
pub mod osc;
mod pace;
mod preview;
mod replay;
mod sim;
mod sim_depth;
mod take;
mod tracked;
mod vendor;

use std::sync::Arc;

use posefuse_skeleton::{AgentTime, JointSet, RawJoint};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Clock;

pub use azure::AzureConfig;
pub use csv::CsvConfig;
pub use depth::{DepthFrame, DepthSource};
pub(crate) use drive::{SourceEvent, inline, inline_queue, on_thread};
pub use nite::NiteConfig;
pub use openni::OpenNiConfig;
pub use osc::OscConfig;
pub use preview::{DepthPreview, PreviewSlot};
pub use replay::{RecordedFrame, ReplayConfig};
pub use sim::{SimConfig, shared_epoch_unix_ns};
pub use sim_depth::{SimDepthConfig, SimOptics};
pub use take::TakeConfig;
pub use tracked::Tracked;

/// What a sensor is, for the greeting.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The device, e.g. "Kinect v2".
    pub model: String,
    /// Which joints its frames carry, and in which order.
    pub joint_set: JointSet,
    /// Its depth camera, where that is known.
    pub camera: Option<Camera>,
}

/// What a sensor's depth camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Whole horizontal and vertical field of view, degrees.
    pub view_deg: [f64; 2],
    /// From where to where it measures, metres.
    pub range_m: [f64; 2],
    /// Whether depth previews can be had.
    pub preview: bool,
}

/// One body as the sensor's tracker sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceBody {
    /// The tracker's own number for this person.
    pub tracking_id: u64,
    /// One entry per joint of the joint set; `None` is missing.
    pub joints: Vec<Option<RawJoint>>,
    /// Unit quaternions x y z w, one per joint of the joint set (zeros where unknown), or empty.
    pub orientations: Vec<[f32; 4]>,
    /// The probability that the left and the right hand is closed, where the tracker tells.
    pub hands_closed: [Option<f32>; 2],
}

/// One frame of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceFrame {
    /// When the light was caught, by the sensor's clock.
    pub captured: AgentTime,
    /// When the frame is to be handed on, by [`Clock::monotonic_ns`]; `None` is at once. Sources that replay or
    /// simulate compute ahead and say here when a real sensor would have delivered.
    pub due_ns: Option<i64>,
    /// Who is in view.
    pub bodies: Vec<SourceBody>,
}

/// From a reading of [`Clock::monotonic_ns`] to what the sensor's clock shows at that moment.
pub type SensorClock = Arc<dyn Fn(i64) -> AgentTime + Send + Sync>;

/// A sensor, or something that takes its place. It may block: it runs on a thread of its own.
pub trait SensorSource: Send {
    /// What this sensor is.
    fn description(&self) -> Description;

    /// The clock that stamps its frames. By default the agent's monotonic clock as it is.
    fn clock(&self) -> SensorClock {
        Arc::new(AgentTime::from_ns)
    }

    /// Where it leaves depth previews, if it has any. Asked for once, before the first frame.
    fn previews(&self) -> Option<PreviewSlot> {
        None
    }

    /// The next frame, or `None` when there will be no more. After [`SourceError::Trouble`] it is called again.
    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError>;
}

/// Why a source gives no frame.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SourceError {
    /// It may pass (unplugged, busy): shown as the sensor's trouble, and tried again.
    #[error("{0}")]
    Trouble(String),
    /// It will not pass (no such file, broken data): the agent ends with it.
    #[error("{0}")]
    Final(String),
}

/// Which source, and its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[allow(
    clippy::large_enum_variant,
    reason = "an agent has one, and hardly moves it"
)]
pub enum SourceConfig {
    /// One sensor of a simulated room.
    Sim(SimConfig),
    /// The depth images of one sensor of a simulated room, with a body tracker behind them.
    SimDepth(SimDepthConfig),
    /// One sensor of a recorded take.
    Take(TakeConfig),
    /// One Kinect of a recorded two-Kinect session.
    Csv(CsvConfig),
    /// A depth sensor or recording of OpenNI2's, with a body tracker behind it.
    #[serde(rename = "openni")]
    OpenNi(OpenNiConfig),
    /// Skeletons that another program sends by OSC.
    Osc(OscConfig),
    /// A sensor tracked by NiTE 2.2.
    Nite(NiteConfig),
    /// An Azure Kinect tracked by Microsoft's Body Tracking SDK.
    Azure(AzureConfig),
}

impl SourceConfig {
    /// Makes the source. Reads whole files, so it may take a second.
    pub fn open(&self, clock: &Arc<dyn Clock>) -> Result<Box<dyn SensorSource>, SourceError> {
        Ok(match self {
            Self::Sim(config) => Box::new(sim::SimSource::open(config, clock)?),
            Self::SimDepth(config) => {
                let depth = Box::new(sim_depth::SimDepth::open(config, clock)?);
                Box::new(Tracked::new(depth, config.tracker.clone())?)
            }
            Self::Csv(config) => Box::new(csv::open(config, clock.as_ref())?),
            Self::Take(config) => Box::new(take::open(config, clock.as_ref())?),
            Self::Nite(config) => nite::open(config, clock)?,
            Self::Azure(config) => azure::open(config, clock)?,
            Self::Osc(config) => Box::new(osc::OscSource::open(config, clock)?),
            Self::OpenNi(config) => {
                let depth = openni::open(config, clock)?;
                Box::new(Tracked::new(depth, config.tracker.clone())?)
            }
        })
    }
}
