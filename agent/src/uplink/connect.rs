//! One HTTP/2 connection to the server, over whatever network was handed in.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tonic::transport::{Channel, Endpoint, Uri};

/// How long a connection may take to be made.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(1);
/// A silent connection is probed after this, and given up [`PROBE_TIMEOUT`] later: together well under 2 s.
const PROBE_INTERVAL: Duration = Duration::from_millis(500);
/// See [`PROBE_INTERVAL`].
const PROBE_TIMEOUT: Duration = Duration::from_secs(1);

/// A byte stream in both directions.
pub trait Io: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Io for T {}

/// A future that is being connected.
pub type Connecting = Pin<Box<dyn Future<Output = io::Result<Box<dyn Io>>> + Send>>;

/// Makes connections: TCP, or a simulated network's idea of it.
pub type Connector = Arc<dyn Fn(Uri) -> Connecting + Send + Sync>;

/// Connects over TCP, without delaying small packets.
pub fn tcp_connector() -> Connector {
    Arc::new(|uri| Box::pin(connect_tcp(uri)))
}

async fn connect_tcp(uri: Uri) -> io::Result<Box<dyn Io>> {
    let host = uri.host().unwrap_or_default().trim_matches(['[', ']']);
    let stream = TcpStream::connect((host, uri.port_u16().unwrap_or(80))).await?;
    stream.set_nodelay(true)?;
    Ok(Box::new(stream))
}

/// A channel to `server` that notices within 2 s when the other end has gone silent.
pub(crate) async fn open(
    server: &Uri,
    connector: &Connector,
) -> Result<Channel, tonic::transport::Error> {
    let connector = connector.clone();
    let service = tower::service_fn(move |uri| {
        let connecting = connector(uri);
        async move { connecting.await.map(TokioIo::new) }
    });
    Endpoint::from(server.clone())
        .connect_timeout(CONNECT_TIMEOUT)
        .http2_keep_alive_interval(PROBE_INTERVAL)
        .keep_alive_timeout(PROBE_TIMEOUT)
        .keep_alive_while_idle(true)
        .connect_with_connector(service)
        .await
}
