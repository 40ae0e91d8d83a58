//! Leave to reach other machines.

use std::net::SocketAddr;

/// Why an address may not be used, if so: what leaves this machine is not encrypted, so it must be allowed.
pub(crate) fn refused(address: SocketAddr, allow_remote: bool) -> Option<String> {
    (!allow_remote && !address.ip().to_canonical().is_loopback()).then(|| {
        format!("an address of this machine, found {address}: set `allow_remote = true` under `[sinks]` to send people's movements there")
    })
}
