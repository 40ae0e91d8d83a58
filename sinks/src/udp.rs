//! Datagrams to wherever a sink's targets are. What the system refuses is told in words, and sending goes on.

use std::io::{Error, ErrorKind};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use tokio::net::UdpSocket;

use crate::meter::Meter;
use crate::{Frames, LiveFrame};

/// The largest payload that passes an Ethernet of 1500 bytes in one piece: less an IPv4 and a UDP header.
pub(crate) const MAX_PACKET: usize = 1472;
/// A room without a frame for so long is empty, or its sensors are gone; said again as often.
const QUIET: Duration = Duration::from_secs(1);

/// What is next on a stream.
pub(crate) enum Next {
    /// A frame.
    Frame(Arc<LiveFrame>),
    /// There was none for a second.
    Quiet,
}

/// The next frame of a stream that is thinned out to `rate_hz` (0: not), or that there is none for now.
pub(crate) async fn next(frames: &Frames, rate_hz: f64) -> Next {
    let slow = if rate_hz > 0.0 { 2.0 / rate_hz } else { 0.0 };
    let quiet = QUIET.max(Duration::from_secs_f64(slow));
    match tokio::time::timeout(quiet, frames.next()).await {
        Ok(frame) => Next::Frame(frame),
        Err(_) => Next::Quiet,
    }
}

/// Sockets for the targets of one sink.
pub(crate) struct Datagrams {
    v4: Option<UdpSocket>,
    v6: Option<UdpSocket>,
    meter: Arc<Meter>,
    /// Since the last frame: whether the system took a packet, and why it refused one.
    taken: bool,
    refused: Option<String>,
    in_trouble: bool,
}

impl Datagrams {
    /// Opens what `targets` need.
    ///
    /// # Errors
    /// In words, what the system refuses.
    pub(crate) async fn open(targets: &[SocketAddr], meter: Arc<Meter>) -> Result<Self, String> {
        meter.set_trouble(String::new());
        let v4 = targets.iter().find(|target| target.is_ipv4());
        let v6 = targets.iter().find(|target| target.is_ipv6());
        Ok(Self {
            v4: socket(v4, (Ipv4Addr::UNSPECIFIED, 0).into()).await?,
            v6: socket(v6, (Ipv6Addr::UNSPECIFIED, 0).into()).await?,
            meter,
            taken: false,
            refused: None,
            in_trouble: false,
        })
    }

    /// Sends a packet. Whether anybody gets it is not known, and no error.
    pub(crate) async fn send(&mut self, packet: &[u8], target: SocketAddr) {
        let Some(socket) = self.socket(target) else {
            return;
        };
        let sent = socket.send_to(packet, target).await;
        self.note(sent, target);
    }

    /// Sends a packet if that takes no waiting.
    pub(crate) fn try_send(&mut self, packet: &[u8], target: SocketAddr) {
        if let Some(socket) = self.socket(target) {
            let _ = socket.try_send_to(packet, target);
        }
    }

    /// All packets of a frame, or of none, were sent.
    pub(crate) fn done(&mut self, frame: Option<&LiveFrame>) {
        match self.refused.take() {
            Some(why) => {
                self.in_trouble = true;
                self.meter.set_trouble(why);
            }
            None if self.in_trouble && self.taken => {
                self.in_trouble = false;
                self.meter.set_trouble(String::new());
            }
            None => {}
        }
        if let (true, Some(frame)) = (self.taken, frame) {
            self.meter.sent(frame);
        }
        self.taken = false;
    }

    fn socket(&self, target: SocketAddr) -> Option<&UdpSocket> {
        match target {
            SocketAddr::V4(_) => self.v4.as_ref(),
            SocketAddr::V6(_) => self.v6.as_ref(),
        }
    }

    fn note(&mut self, sent: Result<usize, Error>, target: SocketAddr) {
        match sent {
            Ok(_) => self.taken = true,
            // Nobody listens, or not yet: UDP's sender need not care.
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::ConnectionRefused | ErrorKind::ConnectionReset
                ) =>
            {
                self.taken = true;
            }
            Err(error) => self.refused = Some(words(target, &error)),
        }
    }
}

fn words(target: SocketAddr, error: &Error) -> String {
    let remedy = match error.kind() {
        ErrorKind::NetworkUnreachable | ErrorKind::HostUnreachable | ErrorKind::NetworkDown => {
            "is this machine in that network?"
        }
        ErrorKind::PermissionDenied => "does a firewall forbid it?",
        _ => "look after the target's address and port",
    };
    format!("the system does not send to {target} ({error}): {remedy}")
}

async fn socket(target: Option<&SocketAddr>, any: SocketAddr) -> Result<Option<UdpSocket>, String> {
    let Some(target) = target else {
        return Ok(None);
    };
    let opened = UdpSocket::bind(any).await;
    // A target may be a whole network's broadcast address.
    let opened = opened.and_then(|socket| socket.set_broadcast(true).map(|()| socket));
    opened
        .map(Some)
        .map_err(|error| format!("no socket to send to {target} from ({error}): too many open?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_the_system_refuses_is_told_until_it_goes_again() {
        let receiver = UdpSocket::bind("127.0.0.1:0").await.unwrap();
        let good = receiver.local_addr().unwrap();
        let bad = SocketAddr::new(good.ip(), 0);
        let meter = Arc::new(Meter::default());
        let mut datagrams = Datagrams::open(&[good], meter.clone()).await.unwrap();
        datagrams.send(b"one", bad).await;
        datagrams.done(None);
        let trouble = meter.trouble();
        assert!(trouble.contains("127.0.0.1:0"), "{trouble}");
        datagrams.send(b"two", good).await;
        datagrams.done(None);
        assert_eq!(meter.trouble(), "");
        let mut buffer = [0; 16];
        let size = receiver.recv(&mut buffer).await.unwrap();
        assert_eq!(&buffer[..size], b"two");
    }
}
