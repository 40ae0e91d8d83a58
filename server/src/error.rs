//! Why a server does not start, or had to end.

use std::io;
use std::net::SocketAddr;

use posefuse_fusion::ConfigError;
use thiserror::Error;

/// Why a server does not start, or had to end.
#[derive(Debug, Error)]
pub enum ServerError {
    /// The configuration cannot be used.
    #[error("the configuration cannot be used: {0}")]
    Config(#[from] ConfigError),
    /// An address that other machines can reach, without leave.
    #[error(
        "`listen = \"{0}\"` is reachable from other machines, and traffic is not encrypted yet: \
         listen on 127.0.0.1, or set `allow_remote = true` if you trust everybody on that network"
    )]
    NotLoopback(SocketAddr),
    /// Somebody else has the port.
    #[error(
        "port {port} is in use (address {0}): stop the program that has it, most likely another `posefuse server`, \
         or choose another with `listen = \"{ip}:{next}\"`",
        port = _0.port(), ip = _0.ip(), next = next_port(_0)
    )]
    PortInUse(SocketAddr),
    /// Listening failed for another reason.
    #[error("cannot listen on {address}: {source}; choose an address of this machine for `listen`")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's reason.
        source: io::Error,
    },
    /// Takes or the calibration cannot be kept.
    #[error(transparent)]
    Folder(posefuse_session::TakeError),
    /// A thread could not be started.
    #[error("cannot start the thread `{name}`: {source}")]
    Thread {
        /// Its name.
        name: &'static str,
        /// The system's reason.
        source: io::Error,
    },
    /// A thread ended that must not.
    #[error(
        "the thread `{0}` ended unexpectedly: this is a fault of the program, its log says more"
    )]
    Stopped(&'static str),
}

fn next_port(address: &SocketAddr) -> u16 {
    address.port().checked_add(1).unwrap_or(7400)
}
