//! What each kind must do.

use std::sync::Arc;

use futures_util::future::BoxFuture;

use crate::meter::Meter;
use crate::{Frames, Kind, SettingsError};

/// One kind's settings, and how it runs.
pub(crate) trait Sink: Send + Sync + 'static {
    /// Which it is.
    fn kind(&self) -> Kind;

    /// Where frames go, in words, e.g. `udp 127.0.0.1:39539`.
    fn place(&self) -> String;

    /// Most frames a second; 0: every one.
    fn rate_hz(&self) -> f64;

    /// Whether it can say how many programs are connected.
    fn counts_clients(&self) -> bool {
        false
    }

    /// Whether the settings can work; targets on other machines need leave (see [`remote`](crate::remote)).
    fn check(&self, allow_remote: bool) -> Result<(), SettingsError>;

    /// Opens what it needs and sends `frames` until this future is dropped, which must free everything. A frame that went
    /// out is told by [`Meter::sent`]. A target that is not there is no error; what can be mended by waiting (a port
    /// in use) or by the user is one, in words with a remedy: it is shown, and the sink runs again after a while.
    fn run(&self, frames: Frames, meter: Arc<Meter>) -> BoxFuture<'static, Result<(), String>>;
}
