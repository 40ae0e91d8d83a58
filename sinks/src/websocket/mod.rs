//! Frames as JSON over WebSocket: for pages (p5.js, three.js), TouchDesigner, Node-RED, Python.
//!
//! One text message a frame, in room axes (X forward, Y left, Z up) and metres; docs/STREAMING.md is the schema. What a client
//! wants it says in the address: `ws://127.0.0.1:7401/?bodies=1&rate=10`.

mod message;
mod talk;

use std::net::SocketAddr;
use std::sync::Arc;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use serde::{Deserialize, Serialize};

use crate::listen::{Door, bind, serve};
use crate::meter::Meter;
use crate::sink::Sink;
use crate::{Frames, Kind, SettingsError};

/// Section `[sinks.websocket]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// On from the start.
    pub enabled: bool,
    /// Where clients come to.
    #[serde(deserialize_with = "crate::address::one")]
    pub listen: SocketAddr,
    /// Most frames a second; 0: every one. A client may ask for fewer.
    pub rate_hz: f64,
    /// Most clients at once; further ones are refused.
    pub max_clients: usize,
    /// Web sites whose pages may come, e.g. `https://example.org`, beside those that this machine serves itself; `null` stands
    /// for pages from files, and lets every web site in. Programs may always.
    pub allowed_origins: Vec<String>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            enabled: false,
            listen: SocketAddr::from(([127, 0, 0, 1], 7401)),
            rate_hz: 60.0,
            max_clients: 32,
            allowed_origins: Vec::new(),
        }
    }
}

impl Settings {
    fn door(&self) -> Door {
        Door {
            address: self.listen,
            max_clients: self.max_clients,
            allowed_origins: self.allowed_origins.clone(),
        }
    }
}

impl Sink for Settings {
    fn kind(&self) -> Kind {
        Kind::Websocket
    }

    fn place(&self) -> String {
        self.door().place()
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn counts_clients(&self) -> bool {
        true
    }

    fn check(&self, allow_remote: bool) -> Result<(), SettingsError> {
        self.door().check(Kind::Websocket, allow_remote)
    }

    fn run(&self, frames: Frames, meter: Arc<Meter>) -> BoxFuture<'static, Result<(), String>> {
        let door = self.door();
        let talk = talk::Json {
            rate_hz: self.rate_hz,
        };
        async move {
            let listener = bind(door.address)?;
            serve(listener, door, talk, frames, meter).await;
            Ok(())
        }
        .boxed()
    }
}
