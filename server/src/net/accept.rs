//! The accept loop: every connection on a task of its own, none of which can stop the loop.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use axum::Router;
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::ServiceExt;

use super::first_bytes::FirstBytes;
use super::{Config, Peer};
use crate::{Clock, Listener};

/// How long to wait after a failed accept (out of file descriptors, most likely).
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);
/// How long a connection may take to finish its answers when the server stops.
const DRAIN: Duration = Duration::from_millis(1500);

/// How many connections there are and were refused.
#[derive(Debug, Default)]
pub(crate) struct Connections {
    open: AtomicUsize,
    refused: AtomicU64,
}

impl Connections {
    /// Open now.
    pub(crate) fn open(&self) -> usize {
        self.open.load(Ordering::Relaxed)
    }

    /// Closed at once because there were too many.
    pub(crate) fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }
}

/// Counts one connection for as long as it lives.
struct Open(Arc<Connections>);

impl Drop for Open {
    fn drop(&mut self) {
        self.0.open.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Serves connections until `stop`, then lets them finish.
pub(crate) async fn serve<L: Listener>(
    mut listener: L,
    router: Router,
    config: Config,
    clock: Arc<dyn Clock>,
    connections: Arc<Connections>,
    stop: CancellationToken,
) {
    let tasks = TaskTracker::new();
    let builder = builder(&config);
    loop {
        let accepted = tokio::select! {
            () = stop.cancelled() => break,
            accepted = listener.accept() => accepted,
        };
        let (io, peer) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                tracing::warn!(%error, "a connection could not be accepted");
                clock.sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        if connections.open() >= config.max_connections {
            connections.refused.fetch_add(1, Ordering::Relaxed);
            tracing::warn!(%peer, limit = config.max_connections, "too many connections: closed; raise `max_connections` under `[net]`");
            continue;
        }
        connections.open.fetch_add(1, Ordering::Relaxed);
        let open = Open(connections.clone());
        let deadline = clock.sleep(Duration::from_millis(config.head_timeout_ms));
        let connection = connection(
            builder.clone(),
            FirstBytes::new(io, deadline),
            peer,
            router.clone(),
            clock.clone(),
            stop.clone(),
        );
        tasks.spawn(async move {
            connection.await;
            drop(open);
        });
    }
    drop(listener);
    tasks.close();
    tasks.wait().await;
}

fn builder(config: &Config) -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new());
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(Duration::from_millis(config.head_timeout_ms));
    builder
        .http2()
        .timer(TokioTimer::new())
        .keep_alive_interval(Duration::from_millis(config.keepalive_interval_ms))
        .keep_alive_timeout(Duration::from_millis(config.keepalive_timeout_ms))
        .max_concurrent_streams(128);
    builder
}

async fn connection<Io>(
    builder: Builder<TokioExecutor>,
    io: FirstBytes<Io>,
    peer: SocketAddr,
    router: Router,
    clock: Arc<dyn Clock>,
    stop: CancellationToken,
) where
    Io: tokio::io::AsyncRead + tokio::io::AsyncWrite + Send + Unpin + 'static,
{
    let service = service_fn(move |mut request: http::Request<Incoming>| {
        request.extensions_mut().insert(Peer(peer));
        let answer = router.clone().oneshot(request);
        async move { answer.await.map_err(|never: Infallible| match never {}) }
    });
    let connection = builder.serve_connection(TokioIo::new(io), service);
    let mut connection = std::pin::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = stop.cancelled() => {
            connection.as_mut().graceful_shutdown();
            tokio::select! {
                ended = connection => ended,
                () = clock.sleep(DRAIN) => Ok(()),
            }
        }
    };
    if let Err(error) = ended {
        tracing::debug!(%peer, %error, "a connection ended");
    }
}
