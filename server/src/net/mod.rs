//! The one port: gRPC, gRPC-Web, the dashboard's files, `/api` and `/metrics`, over HTTP/1.1 and HTTP/2.

mod accept;
mod api;
mod first_bytes;
mod guard;
mod metrics;
mod pages;
mod shared_bytes;

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::routing::get;
use posefuse_proto::v1;
use serde::{Deserialize, Serialize};
use tonic_web::GrpcWebLayer;
use tower::Layer;

pub(crate) use accept::{Connections, serve};
pub(crate) use shared_bytes::{EncodedStream, decoded};

use crate::ServerError;
use crate::ingest::IngestService;
use crate::room::RoomService;

/// Connections that may wait to be accepted.
const BACKLOG: u32 = 1024;

/// Limits of connections. Section `[net]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Names, beside those of this machine's loopback and the listen address, by which a browser may call this server.
    pub allowed_hosts: Vec<String>,
    /// Most connections at once; further ones are closed at once.
    pub max_connections: usize,
    /// Largest message a client may send, KiB.
    pub max_message_kib: usize,
    /// A connection that has not sent a request's head by then is closed, milliseconds.
    pub head_timeout_ms: u64,
    /// An HTTP/2 peer that has been silent for so long is asked whether it still lives, milliseconds ...
    pub keepalive_interval_ms: u64,
    /// ... and taken for gone when it has not answered after so long, milliseconds.
    pub keepalive_timeout_ms: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            allowed_hosts: Vec::new(),
            max_connections: 512,
            max_message_kib: 256,
            head_timeout_ms: 4000,
            keepalive_interval_ms: 800,
            keepalive_timeout_ms: 1000,
        }
    }
}

/// What a request knows of its connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer(pub(crate) SocketAddr);

/// Refuses an address that other machines can reach unless `allow_remote`.
pub(crate) fn check_address(listen: SocketAddr, allow_remote: bool) -> Result<(), ServerError> {
    if listen.ip().to_canonical().is_loopback() || allow_remote {
        Ok(())
    } else {
        Err(ServerError::NotLoopback(listen))
    }
}

/// Listens where `config` says, on the system's TCP.
///
/// Errors name the address and the remedy: an address that others can reach without leave, a port in use.
pub async fn bind(config: &crate::Config) -> Result<tokio::net::TcpListener, ServerError> {
    let address = config.listen;
    check_address(address, config.allow_remote)?;
    listen(address).map_err(|source| match source.kind() {
        std::io::ErrorKind::AddrInUse => ServerError::PortInUse(address),
        _ => ServerError::Listen { address, source },
    })
}

/// Like `TcpListener::bind`, with room for a storm of connections: where the usual 128 wait, a further one is only
/// tried again by its system a second later.
fn listen(address: SocketAddr) -> std::io::Result<tokio::net::TcpListener> {
    let socket = match address {
        SocketAddr::V4(_) => tokio::net::TcpSocket::new_v4()?,
        SocketAddr::V6(_) => tokio::net::TcpSocket::new_v6()?,
    };
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// Everything that answers requests.
pub(crate) fn router(
    config: &crate::Config,
    listen: SocketAddr,
    ingest: IngestService,
    room: RoomService,
) -> Router {
    let limit = config.net.max_message_kib.saturating_mul(1024);
    let hosts = guard::Hosts::new(listen.ip(), &config.net.allowed_hosts);
    let room_server =
        v1::room_server::RoomServer::new(room.clone()).max_decoding_message_size(limit);
    let ingest_server =
        v1::ingest_server::IngestServer::new(ingest).max_decoding_message_size(limit);
    let web = GrpcWebLayer::new();
    Router::new()
        .route_service(
            "/posefuse.v1.Room/Watch",
            web.layer(shared_bytes::watch(room.clone())),
        )
        .route_service(
            "/posefuse.v1.Room/WatchSensors",
            web.layer(shared_bytes::watch_sensors(room.clone())),
        )
        .route_service(
            "/posefuse.v1.Room/WatchDepth",
            web.layer(shared_bytes::watch_depth(room.clone())),
        )
        .route_service("/posefuse.v1.Room/{*method}", web.layer(room_server))
        .route_service("/posefuse.v1.Ingest/{*method}", ingest_server)
        .route("/metrics", get(metrics_page))
        .merge(api::routes())
        .fallback(pages::page)
        .layer(axum::middleware::from_fn_with_state(
            Arc::new(hosts),
            guard::guard,
        ))
        .with_state(room)
}

async fn metrics_page(
    State(room): State<RoomService>,
) -> ([(http::HeaderName, &'static str); 1], String) {
    let text = metrics::text(&room.status(), &room.snapshot(), room.connections());
    let kind = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    ([(http::header::CONTENT_TYPE, kind)], text)
}

/// Whether `ip` is every address of the machine.
fn is_any(ip: IpAddr) -> bool {
    ip.to_canonical().is_unspecified()
}
