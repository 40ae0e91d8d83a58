//! Frames over Zenoh, and through it the bones of bodies as `/tf` for ROS 2 with rmw_zenoh.
//!
//! `KEY/frames` carries `posefuse.v1.RoomFrame` (protobuf) with a sequence number as attachment: 8 bytes, little-endian, counted
//! up by one, so that a subscriber sees what it lost. Everything is sent in drop mode, so a subscriber that stands still delays
//! nobody. Zenoh is some 200 crates, so only builds with the feature `zenoh` have it; settings are the same in all.

#[cfg(feature = "zenoh")]
mod publish;
#[cfg(feature = "zenoh")]
mod ros;

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use serde::{Deserialize, Serialize};

use crate::meter::Meter;
use crate::remote::refused;
use crate::sink::Sink;
use crate::{Frames, Kind, SettingsError};

/// Section `[sinks.zenoh]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// On from the start.
    pub enabled: bool,
    /// Whether there is a router.
    pub mode: Mode,
    /// Routers or peers to connect to, e.g. `tcp/127.0.0.1:7447`.
    pub connect: Vec<String>,
    /// Where a peer listens, likewise.
    pub listen: Vec<String>,
    /// What key expressions begin with.
    pub key: String,
    /// Whether bones also go to ROS 2.
    pub ros: bool,
    /// The ROS 2 domain, 0 to 232.
    pub ros_domain: u32,
    /// Most frames a second; 0: every one.
    pub rate_hz: f64,
}

/// What we are in the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Others connect to us, or we to them.
    Peer,
    /// A router hands on what we say: Zenoh's `zenohd` or ROS 2's `rmw_zenohd`.
    #[default]
    Client,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            enabled: false,
            mode: Mode::default(),
            connect: vec!["tcp/127.0.0.1:7447".to_owned()],
            listen: Vec::new(),
            key: "posefuse".to_owned(),
            ros: true,
            ros_domain: 0,
            rate_hz: 60.0,
        }
    }
}

impl Sink for Settings {
    fn kind(&self) -> Kind {
        Kind::Zenoh
    }

    fn place(&self) -> String {
        let places: Vec<&str> = self
            .connect
            .iter()
            .chain(&self.listen)
            .map(String::as_str)
            .collect();
        format!("{}/frames at {}", self.key, places.join(", "))
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn check(&self, allow_remote: bool) -> Result<(), SettingsError> {
        let wrong = |key, expected: String| Err(SettingsError::of(Kind::Zenoh, key, expected));
        for (key, endpoints) in [("connect", &self.connect), ("listen", &self.listen)] {
            for endpoint in endpoints {
                if let Some(why) = not_allowed(endpoint, allow_remote) {
                    return wrong(key, why);
                }
            }
        }
        if self.connect.is_empty() && (self.mode == Mode::Client || self.listen.is_empty()) {
            return wrong("connect", "a router such as \"tcp/127.0.0.1:7447\", or `mode = \"peer\"` with a `listen`; found neither".to_owned());
        }
        let is_part = |part: &str| {
            !part.is_empty()
                && part
                    .chars()
                    .all(|c| c.is_alphanumeric() || "_-.".contains(c))
        };
        if !self.key.split('/').all(is_part) {
            return wrong(
                "key",
                format!(
                    "names divided by `/`, such as `studio/posefuse`, found `{}`",
                    self.key
                ),
            );
        }
        if self.ros_domain > 232 {
            return wrong("ros_domain", format!("0 to 232, found {}", self.ros_domain));
        }
        Ok(())
    }

    #[cfg(feature = "zenoh")]
    fn run(&self, frames: Frames, meter: Arc<Meter>) -> BoxFuture<'static, Result<(), String>> {
        publish::run(self.clone(), frames, meter).boxed()
    }

    #[cfg(not(feature = "zenoh"))]
    fn run(&self, _: Frames, _: Arc<Meter>) -> BoxFuture<'static, Result<(), String>> {
        let why = "this build of Posefuse is without Zenoh: use one made with `cargo build --release --features zenoh`, or switch this sink off";
        std::future::ready(Err(why.to_owned())).boxed()
    }
}

/// Why an endpoint may not be used, if so.
fn not_allowed(endpoint: &str, allow_remote: bool) -> Option<String> {
    let place = endpoint
        .strip_prefix("tcp/")
        .and_then(|place| place.rsplit_once(':'));
    let Some((host, port)) = place.and_then(|(host, port)| Some((host, port.parse::<u16>().ok()?)))
    else {
        return Some(format!(
            "an endpoint such as `tcp/127.0.0.1:7447`, found `{endpoint}`"
        ));
    };
    let host = host.trim_start_matches('[').trim_end_matches(']');
    match (host, host.parse::<IpAddr>()) {
        ("localhost", _) => None,
        (_, Ok(ip)) => refused(SocketAddr::new(ip, port), allow_remote),
        // A name may lead anywhere.
        _ => refused(SocketAddr::from(([0, 0, 0, 0], port)), allow_remote),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trouble(change: impl FnOnce(&mut Settings), allow_remote: bool) -> Option<String> {
        let mut settings = Settings::default();
        change(&mut settings);
        settings
            .check(allow_remote)
            .err()
            .map(|error| error.to_string())
    }

    #[test]
    fn settings_stay_on_this_machine_unless_allowed() {
        assert_eq!(trouble(|_| {}, false), None);
        for (endpoint, far) in [
            ("tcp/localhost:7447", false),
            ("tcp/[::1]:7447", false),
            ("tcp/192.168.1.4:7447", true),
            ("tcp/0.0.0.0:7447", true),
            ("tcp/router.local:7447", true),
        ] {
            let set = |settings: &mut Settings| settings.connect = vec![endpoint.to_owned()];
            assert_eq!(trouble(set, false).is_some(), far, "{endpoint}");
            assert_eq!(trouble(set, true), None, "{endpoint}");
        }
        for wrong in [
            "udp/127.0.0.1:7447",
            "127.0.0.1:7447",
            "tcp/127.0.0.1",
            "tcp/127.0.0.1:7447?rel=0",
        ] {
            let set = |settings: &mut Settings| settings.listen = vec![wrong.to_owned()];
            assert!(trouble(set, true).is_some(), "{wrong}");
        }
        assert!(trouble(|settings| settings.connect.clear(), true).is_some());
        assert!(trouble(|settings| settings.key = "all/**".to_owned(), true).is_some());
        assert!(trouble(|settings| settings.ros_domain = 233, true).is_some());
    }
}
