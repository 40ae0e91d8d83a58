//! Live streams of the fused people to the tools that people use.
//!
//! A frame's way: [`Tap::offer`] on the fusion thread, a bounded queue, [`Hub::run`] (bodies are solved there, once for all),
//! then for each [sink](Kind) that is on a bounded queue of its own and a task of its own. A slow sink loses its own oldest
//! frames, counted, and delays nobody. A sink that fails says why and is tried again.
//!
//! Each kind has a file or folder with its settings, its wire format and its task; `sink.rs` is what it must do.

mod address;
mod bone_frames;
mod config;
mod foxglove;
mod frame;
mod hub;
mod joints;
mod kind;
mod listen;
mod lsl;
mod meter;
mod osc;
mod pace;
mod packets;
mod queue;
mod remote;
mod sink;
mod slots;
mod switch;
mod udp;
mod vmc;
mod websocket;
mod zenoh;

pub use crate::zenoh::{Mode as ZenohMode, Settings as ZenohSettings};
pub use config::{Config, SettingsError};
pub use foxglove::Settings as FoxgloveSettings;
pub use frame::LiveFrame;
pub use hub::{Civil, Hub, Tap};
pub use joints::Joints;
pub use kind::Kind;
pub use lsl::Settings as LslSettings;
pub use meter::{SinkState, SinkStatus};
pub use osc::{Person as OscPerson, Settings as OscSettings};
pub use pace::{FramePace, Pace};
pub use posefuse_skeleton::Axes;
pub use queue::Frames;
pub use switch::{Sinks, SwitchError};
pub use vmc::{Settings as VmcSettings, Travel as VmcTravel};
pub use websocket::Settings as WebsocketSettings;

/// The three ends of the sinks: the switchboard, what the fusion thread offers frames to, and the loop between them.
///
/// # Errors
/// Settings that cannot work, by key.
pub fn open(config: &Config) -> Result<(Sinks, Tap, Hub), SettingsError> {
    config.check()?;
    let outlets = hub::Outlets::default();
    let (tap, hub) = hub::hub(config, outlets.clone());
    Ok((Sinks::new(config, outlets), tap, hub))
}
