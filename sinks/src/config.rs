//! The settings: plain data read from TOML. Each kind owns its own section.

use serde::{Deserialize, Serialize};

use crate::{Kind, foxglove, lsl, osc, vmc, websocket, zenoh};

/// Every sink, on or off. Section `[sinks]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Leave to send to other machines, and to let other machines in. Traffic is not encrypted.
    pub allow_remote: bool,
    /// Positions over OSC.
    pub osc: osc::Settings,
    /// Bodies by VMC.
    pub vmc: vmc::Settings,
    /// Samples for labs.
    pub lsl: lsl::Settings,
    /// Frames as JSON.
    pub websocket: websocket::Settings,
    /// Scenes for Foxglove.
    pub foxglove: foxglove::Settings,
    /// Frames for Zenoh, and transforms for ROS 2.
    pub zenoh: zenoh::Settings,
    /// The bodies that tools with rigs get.
    pub bodies: posefuse_kinematics::Config,
}

/// A setting that cannot work.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`sinks.{key}`: expected {expected}")]
pub struct SettingsError {
    /// The key below `sinks`.
    pub key: String,
    /// What was expected, what was found, what to do.
    pub expected: String,
}

impl SettingsError {
    /// Of a key of one kind.
    pub(crate) fn of(kind: Kind, key: &str, expected: impl Into<String>) -> Self {
        Self {
            key: format!("{kind}.{key}"),
            expected: expected.into(),
        }
    }
}

impl Config {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first that cannot work.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.bodies.validate().map_err(|error| SettingsError {
            key: "bodies".to_owned(),
            expected: error.to_string(),
        })?;
        for (_, sink) in self.sinks() {
            let rate_hz = sink.rate_hz();
            if !(0.0..=1000.0).contains(&rate_hz) {
                let expected = format!("frames a second, 0 (every one) to 1000, found {rate_hz}");
                return Err(SettingsError::of(sink.kind(), "rate_hz", expected));
            }
            sink.check(self.allow_remote)?;
        }
        Ok(())
    }

    /// Each kind's sink, and whether it is on from the start.
    pub(crate) fn sinks(&self) -> Vec<(bool, Box<dyn crate::sink::Sink>)> {
        vec![
            (self.osc.enabled, Box::new(self.osc.clone())),
            (self.vmc.enabled, Box::new(self.vmc.clone())),
            (self.lsl.enabled, Box::new(self.lsl.sink(self.allow_remote))),
            (self.websocket.enabled, Box::new(self.websocket.clone())),
            (self.foxglove.enabled, Box::new(self.foxglove.clone())),
            (self.zenoh.enabled, Box::new(self.zenoh.clone())),
        ]
    }
}
