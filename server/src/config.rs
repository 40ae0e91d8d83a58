//! The server's settings: plain data read from TOML; each part of the server owns its own section.

use std::net::{Ipv4Addr, SocketAddr};

use posefuse_fusion::{ConfigError, parse_toml};
use serde::{Deserialize, Serialize};

use crate::commented::commented;

/// Everything a server can be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Address and port of everything: agents, tools, dashboard, metrics. Port 0 takes any that is free.
    pub listen: SocketAddr,
    /// Leave to listen where other machines can reach it. Traffic is not encrypted.
    pub allow_remote: bool,
    /// Limits of connections.
    pub net: crate::net::Config,
    /// Limits of agents.
    pub ingest: crate::ingest::Config,
    /// What subscribers get.
    pub watch: crate::sinks::Config,
    /// Live streams to other programs.
    pub sinks: posefuse_sinks::Config,
    /// How the time of day is counted.
    pub timecode: crate::room::TimecodeConfig,
    /// Where other programs start and stop takes, beside HTTP.
    pub trigger: crate::room::TriggerConfig,
    /// Where takes go.
    pub takes: crate::record::Config,
    /// Where the calibration is kept.
    pub calibration: crate::room::CalibrationConfig,
    /// When a sensor counts as moved.
    pub drift: crate::drift::Config,
    /// Where models come from that fill in what no sensor sees, and what runs them.
    pub models: posefuse_models::Config,
    /// The fusion engine.
    pub fusion: posefuse_fusion::Config,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 7400)),
            allow_remote: false,
            net: Default::default(),
            ingest: Default::default(),
            watch: Default::default(),
            sinks: Default::default(),
            timecode: Default::default(),
            trigger: Default::default(),
            takes: Default::default(),
            calibration: Default::default(),
            drift: Default::default(),
            models: Default::default(),
            fusion: Default::default(),
        }
    }
}

impl Config {
    /// Reads a configuration and checks its values.
    ///
    /// # Errors
    /// An unknown key or choice (with the nearest known one), a wrong type, a value that cannot work.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        let config: Self = parse_toml(text)?;
        config.validate()?;
        Ok(config)
    }

    /// The configuration as TOML, each key with a comment; [`Config::from_toml`] gives it back.
    pub fn to_toml(&self) -> String {
        // Plain data with string keys always has a TOML form.
        commented(&toml::to_string(self).unwrap_or_default())
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first key whose value cannot work, with what was expected.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let counts = [
            ("net.max_connections", self.net.max_connections, 1, 100_000),
            ("net.max_message_kib", self.net.max_message_kib, 16, 65_536),
            ("ingest.queue", self.ingest.queue, 16, 1 << 20),
            (
                "watch.max_subscribers",
                self.watch.max_subscribers,
                1,
                1 << 16,
            ),
            ("watch.queue", self.watch.queue, 1, 1 << 16),
            ("takes.queue", self.takes.queue, 64, 1 << 20),
        ];
        for (key, found, low, high) in counts {
            within(key, found as u64, low as u64, high as u64)?;
        }
        within("net.head_timeout_ms", self.net.head_timeout_ms, 10, 60_000)?;
        within(
            "net.keepalive_interval_ms",
            self.net.keepalive_interval_ms,
            50,
            3_600_000,
        )?;
        within(
            "net.keepalive_timeout_ms",
            self.net.keepalive_timeout_ms,
            50,
            3_600_000,
        )?;
        within("ingest.max_wait_ms", self.ingest.max_wait_ms, 0, 60_000)?;
        within("watch.cut_after_ms", self.watch.cut_after_ms, 10, 3_600_000)?;
        within("takes.flush_ms", self.takes.flush_ms, 20, 250)?;
        self.calibration.check()?;
        self.drift.check()?;
        self.trigger.check()?;
        self.sinks.check().map_err(|error| ConfigError::Value {
            key: format!("sinks.{}", error.key),
            expected: error.expected,
        })?;
        self.fusion.validate()
    }
}

fn within(key: &str, found: u64, low: u64, high: u64) -> Result<(), ConfigError> {
    if (low..=high).contains(&found) {
        return Ok(());
    }
    Err(ConfigError::Value {
        key: key.to_owned(),
        expected: format!("a number from {low} to {high}, found {found}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survives_toml_and_an_empty_file_means_the_defaults() {
        let config = Config::default();
        assert_eq!(Config::from_toml(&config.to_toml()).unwrap(), config);
        assert_eq!(Config::from_toml("").unwrap(), config);
    }

    #[test]
    fn a_typing_error_is_answered_with_what_was_meant() {
        for (text, meant) in [
            ("lisen = \"127.0.0.1:1\"", "listen"),
            ("[takes]\nfoldr = \"x\"", "folder"),
            ("[fusion.intake]\nrate_hx = 30.0", "rate_hz"),
        ] {
            let error = Config::from_toml(text).unwrap_err().to_string();
            assert!(
                error.contains(&format!("did you mean `{meant}`?")),
                "{error}"
            );
        }
        let error = Config::from_toml("[calibration]\nfile = \"my room/..\"")
            .unwrap_err()
            .to_string();
        assert!(error.contains("calibration.file"), "{error}");
        for (text, key, range) in [
            ("[ingest]\nqueue = 0", "ingest.queue", "from 16"),
            (
                "[takes]\nflush_ms = 251",
                "takes.flush_ms",
                "from 20 to 250",
            ),
            ("[takes]\nflush_ms = 19", "takes.flush_ms", "from 20 to 250"),
        ] {
            let error = Config::from_toml(text).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains(range), "{error}");
        }
    }

    #[test]
    fn rates_and_addresses_are_taken_as_people_write_them() {
        for (rate, name) in [("25", "25"), ("\"29.97df\"", "29.97df"), ("60.0", "60")] {
            let config = Config::from_toml(&format!("[timecode]\nrate = {rate}")).unwrap();
            assert_eq!(config.timecode.rate.name(), name);
        }
        let error = Config::from_toml("[timecode]\nrate = 23.976").unwrap_err();
        assert!(error.to_string().contains("29.97df"), "{error}");

        let config = Config::from_toml("[sinks.vmc]\ntarget = \"localhost:39540\"").unwrap();
        assert_eq!(config.sinks.vmc.target.to_string(), "127.0.0.1:39540");
        for (target, wanted) in [
            ("studio:39540", "an address and a port"),
            (
                "192.168.1.20:39539",
                "expected an address of this machine, found 192",
            ),
        ] {
            let text = format!("[sinks.vmc]\ntarget = \"{target}\"");
            let error = Config::from_toml(&text).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
        }
    }
}
