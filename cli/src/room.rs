//! The client side of the `Room` service, and errors of it in words.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use anyhow::{Context, anyhow};
use clap::Args;
use posefuse_proto::v1::{GetStatusRequest, RoomStatus, room_client::RoomClient};
use tonic::transport::{Channel, Endpoint, Uri};
use tonic::{Code, Status};

/// A connection to a room.
pub(crate) type Room = RoomClient<Channel>;

/// Where a server listens unless told otherwise.
pub(crate) const DEFAULT_URL: &str = "http://127.0.0.1:7400";

const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
const REPLY_TIMEOUT: Duration = Duration::from_secs(5);

/// Which server to talk to.
#[derive(Clone, Debug, Args)]
pub(crate) struct ServerOption {
    /// The server of the room
    #[arg(long, value_name = "URL", env = "POSEFUSE_SERVER", default_value = DEFAULT_URL)]
    pub(crate) server: ServerUrl,
}

/// The address of a server: `http://HOST:PORT`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ServerUrl(Uri);

impl ServerUrl {
    /// The address as a URI.
    pub(crate) fn uri(&self) -> &Uri {
        &self.0
    }

    /// The host's name or address and the port.
    pub(crate) fn host_and_port(&self) -> (String, u16) {
        let host = self
            .0
            .host()
            .unwrap_or("127.0.0.1")
            .trim_matches(['[', ']'])
            .to_owned();
        (host, self.0.port_u16().unwrap_or(80))
    }
}

impl fmt::Display for ServerUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.to_string().trim_end_matches('/'))
    }
}

impl FromStr for ServerUrl {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        posefuse_agent::parse_server(text)
            .map(Self)
            .map_err(|error| error.to_string())
    }
}

/// Connects, and makes sure that it is a room that answers.
pub(crate) async fn connect(url: &ServerUrl) -> anyhow::Result<Room> {
    Ok(connect_with_status(url).await?.0)
}

/// Connects, and gives the room's state too.
pub(crate) async fn connect_with_status(url: &ServerUrl) -> anyhow::Result<(Room, RoomStatus)> {
    let endpoint = Endpoint::from(url.0.clone())
        .connect_timeout(CONNECT_TIMEOUT)
        .http2_keep_alive_interval(Duration::from_secs(5))
        .keep_alive_timeout(Duration::from_secs(5));
    let channel = endpoint.connect().await.map_err(|error| {
        let reason = root_cause(&error);
        anyhow!(
            "no server answers at {url} ({reason}); start one with `posefuse server`, or name yours with --server URL"
        )
    })?;
    let mut room = Room::new(channel);
    let asked = tokio::time::timeout(REPLY_TIMEOUT, room.get_status(GetStatusRequest {})).await;
    let no_room = |why: &str| {
        anyhow!(
            "something answers at {url}, but not as a Posefuse server ({why}); check the port of --server URL"
        )
    };
    let status = match asked {
        Err(_) => return Err(no_room("no reply within 5 s")),
        Ok(Err(status)) if status.code() == Code::Unimplemented => {
            return Err(no_room("it does not know the Room service"));
        }
        Ok(Err(status)) if is_foreign(&status) => return Err(no_room(status.message())),
        Ok(reply) => reply
            .map_err(|status| refused(&status))
            .context("the server's state")?,
    };
    Ok((room, status.into_inner()))
}

/// What the server answered instead of a reply, in its own words, which name the remedy.
pub(crate) fn refused(status: &Status) -> anyhow::Error {
    if went_away(status) {
        return anyhow!(
            "the server went away; start it again with `posefuse server`, then repeat this"
        );
    }
    if status.message().is_empty() {
        return anyhow!("the server refused: {}", status.code().description());
    }
    anyhow!("{}", status.message().to_owned())
}

/// Why a stream broke: whether the server is gone, or answers and only this connection is lost.
pub(crate) async fn broken(url: &ServerUrl, status: &Status) -> anyhow::Error {
    if went_away(status) && connect_with_status(url).await.is_ok() {
        return anyhow!(
            "the connection was cut, but the server at {url} answers: this program was stopped for a while, this \
             computer slept, or the network was away; run it again"
        );
    }
    refused(status)
}

/// Whether the connection broke rather than that the server answered.
pub(crate) fn went_away(status: &Status) -> bool {
    use std::error::Error;
    matches!(
        status.code(),
        Code::Unavailable | Code::Unknown | Code::Cancelled
    ) && status.source().is_some()
}

/// Whether what came back was no gRPC at all.
fn is_foreign(status: &Status) -> bool {
    went_away(status) || matches!(status.code(), Code::Unknown | Code::Internal)
}

fn root_cause(error: &dyn std::error::Error) -> String {
    let mut cause = error;
    while let Some(deeper) = cause.source() {
        cause = deeper;
    }
    cause.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_taken_with_and_without_scheme() {
        let url: ServerUrl = "localhost:7400".parse().unwrap();
        assert_eq!(url.to_string(), "http://localhost:7400");
        assert_eq!(url.host_and_port(), ("localhost".to_owned(), 7400));
        let url: ServerUrl = "http://[::1]:1/".parse().unwrap();
        assert_eq!(url.host_and_port(), ("::1".to_owned(), 1));
    }
}
