//! Programs that come to us over WebSocket, and get frames as they are made.
//!
//! One task hands frames to the clients' queues and lets clients in; each client has a task of its own, so whoever is slow loses
//! only their own frames. What a client holds of our memory is bounded: [`WAITING`] frames that it shares with the others, one
//! message that is being written, and [`SOCKET_BYTES`] in the operating system.

mod client;
mod door;
mod house;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::task::JoinSet;
use tokio_tungstenite::tungstenite::Message;

use crate::meter::Meter;
use crate::remote::refused;
use crate::{Frames, Kind, LiveFrame, SettingsError};

use house::House;

/// Frames that may wait for one client; beyond, it loses its oldest.
const WAITING: usize = 4;
/// Bytes that the operating system holds for one client: some frames of a full room, so that a client that stands still is
/// noticed soon.
const SOCKET_BYTES: u32 = 128 << 10;
/// Connections that are not clients yet.
const HANDSHAKES: usize = 16;
/// After a connection could not be taken (no more files, say), the next is tried after this.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Where to listen, and for whom.
#[derive(Clone, Debug)]
pub(crate) struct Door {
    pub(crate) address: SocketAddr,
    pub(crate) max_clients: usize,
    /// Web sites whose pages may come, beside those that this machine serves itself.
    pub(crate) allowed_origins: Vec<String>,
}

impl Door {
    /// Whether it can be opened.
    pub(crate) fn check(&self, kind: Kind, allow_remote: bool) -> Result<(), SettingsError> {
        if let Some(why) = refused(self.address, allow_remote) {
            return Err(SettingsError::of(kind, "listen", why));
        }
        if self.max_clients == 0 {
            let expected = "at least 1, found 0; to have no clients set `enabled = false`";
            return Err(SettingsError::of(kind, "max_clients", expected));
        }
        let mut origins = self.allowed_origins.iter();
        match origins.find_map(|origin| door::not_an_origin(origin)) {
            Some(why) => Err(SettingsError::of(kind, "allowed_origins", why)),
            None => Ok(()),
        }
    }

    /// In words.
    pub(crate) fn place(&self) -> String {
        format!("ws://{}", self.address)
    }
}

/// What a client asks for as it comes.
pub(crate) struct Asked<'a> {
    /// What follows `?` in the address; empty: nothing.
    pub(crate) query: &'a str,
    /// The sub-protocols it knows.
    pub(crate) protocols: Vec<&'a str>,
}

/// How a client is let in.
pub(crate) struct Welcome<C> {
    pub(crate) client: C,
    /// The sub-protocol that is spoken, one of those asked for; `None`: none was asked for, or none is known.
    pub(crate) protocol: Option<&'static str>,
    pub(crate) greeting: Vec<Message>,
}

/// What is said to clients, and what is made of what they say.
pub(crate) trait Talk: Send + Sync + 'static {
    /// What is remembered of one client.
    type Client: Send + 'static;
    /// A frame, with what clients share of its encodings.
    type Frame: Send + Sync + 'static;

    /// Answers a client that comes.
    ///
    /// # Errors
    /// What it asks for cannot be had: what was expected.
    fn welcome(&self, asked: &Asked<'_>) -> Result<Welcome<Self::Client>, String>;

    /// Makes a frame ready; encodes nothing before somebody wants it.
    fn prepare(&self, frame: Arc<LiveFrame>) -> Self::Frame;

    /// The frame as it was offered.
    fn live<'a>(&self, frame: &'a Self::Frame) -> &'a LiveFrame;

    /// What this client is told of a frame.
    fn tell(&self, client: &mut Self::Client, frame: &Self::Frame) -> Vec<Message>;

    /// What this client is answered.
    fn hear(&self, client: &mut Self::Client, text: &str) -> Vec<Message>;
}

/// Opens the door.
///
/// # Errors
/// The address cannot be had; in words.
pub(crate) fn bind(address: SocketAddr) -> Result<TcpListener, String> {
    let open = || {
        let socket = match address {
            SocketAddr::V4(_) => TcpSocket::new_v4(),
            SocketAddr::V6(_) => TcpSocket::new_v6(),
        }?;
        socket.set_reuseaddr(true)?;
        // Inherited by every connection.
        socket.set_send_buffer_size(SOCKET_BYTES)?;
        socket.bind(address)?;
        socket.listen(HANDSHAKES as u32)
    };
    open().map_err(|error| {
        format!("cannot listen on {address}: {error}; end the program that uses the port, or set another `listen`")
    })
}

/// Lets clients in and hands them frames until this future is dropped, which closes all connections.
pub(crate) async fn serve<T: Talk>(
    listener: TcpListener,
    door: Door,
    talk: T,
    frames: Frames,
    meter: Arc<Meter>,
) {
    // It may have failed before.
    meter.set_trouble(String::new());
    let most = door.max_clients.saturating_add(HANDSHAKES);
    let house = Arc::new(House::new(door, talk, meter));
    let mut tasks = JoinSet::new();
    loop {
        tokio::select! {
            frame = frames.next() => house.hand_out(frame),
            (stream, peer) = accept(&listener) => {
                // Beyond, a connection is closed at once: what has not even asked yet costs a task each.
                if tasks.len() < most {
                    tasks.spawn(client::attend(house.clone(), stream, peer));
                }
            }
            Some(_) = tasks.join_next() => {}
        }
    }
}

async fn accept(listener: &TcpListener) -> (TcpStream, SocketAddr) {
    loop {
        match listener.accept().await {
            Ok(accepted) => return accepted,
            Err(error) => tracing::warn!(%error, "a connection could not be taken"),
        }
        tokio::time::sleep(ACCEPT_PAUSE).await;
    }
}
