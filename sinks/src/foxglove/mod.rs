//! The room live in Foxglove (and whatever else speaks its WebSocket protocol): people as a scene, bones as transforms, frames
//! as they are. The sub-protocol is `foxglove.websocket.v1` or the SDK's `foxglove.sdk.v1`: what we say is the same in both.
//!
//! The protocol: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>.

mod channel;
mod protocol;
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

/// Section `[sinks.foxglove]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// On from the start.
    pub enabled: bool,
    /// Where clients come to.
    #[serde(deserialize_with = "crate::address::one")]
    pub listen: SocketAddr,
    /// Most frames a second; 0: every one.
    pub rate_hz: f64,
    /// Most clients at once; further ones are refused.
    pub max_clients: usize,
    /// Web sites whose pages may come, beside those that this machine serves itself. Programs may always.
    pub allowed_origins: Vec<String>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            enabled: false,
            listen: SocketAddr::from(([127, 0, 0, 1], 8765)),
            rate_hz: 60.0,
            max_clients: 16,
            allowed_origins: vec!["https://app.foxglove.dev".to_owned()],
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
        Kind::Foxglove
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
        self.door().check(Kind::Foxglove, allow_remote)
    }

    fn run(&self, frames: Frames, meter: Arc<Meter>) -> BoxFuture<'static, Result<(), String>> {
        let door = self.door();
        async move {
            let listener = bind(door.address)?;
            let talk = talk::Foxglove::new();
            serve(listener, door, talk, frames, meter).await;
            Ok(())
        }
        .boxed()
    }
}
