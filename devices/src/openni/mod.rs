//! OpenNI2: depth cameras (Kinect v1, Xtion, Astra, whatever has a driver for it) and `.oni` recordings.
//!
//! The library is loaded when it is asked for ([`OpenNi::load`]) and may be missing. Positions and images are as
//! everywhere: optical axes, millimetres along the optical axis, not mirrored. Times are the device's own,
//! microseconds.
//!
//! ```no_run
//! # use std::time::Duration;
//! # fn main() -> Result<(), posefuse_devices::openni::OpenNiError> {
//! let openni = posefuse_devices::openni::OpenNi::load(None)?;
//! let stream = openni.open(None)?.depth(None)?;
//! stream.start()?;
//! while let Some(frame) = stream.next(Duration::from_secs(1))? {
//!     println!("{} us: {} mm", frame.timestamp_us, frame.image.millimetres[0]);
//! }
//! # Ok(())
//! # }
//! ```

mod api;
pub mod c;
mod device;
mod error;
mod events;
mod library;
mod mode;
mod pixels;
mod recorder;
mod stream;
pub mod usb;

pub use device::{Device, Playback, is_recording};
pub use error::{HOW_TO_INSTALL, OpenNiError};
pub use events::DeviceEvent;
pub use library::{DeviceInfo, OpenNi};
pub use mode::{Mode, WantedMode};
pub use recorder::Recorder;
pub use stream::{DepthStream, Frame};
