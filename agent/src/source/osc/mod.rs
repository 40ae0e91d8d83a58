//! Skeletons that another program sends by OSC (Open Sound Control 1.0) over UDP.
//!
//! OSC says nothing about when the light was caught: a frame's time is the arrival of its first message. What cannot be
//! read is counted and told, and never ends anything.

mod gather;
mod layout;
mod packet;

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use posefuse_skeleton::JointSet;
use serde::{Deserialize, Serialize};

use self::gather::Gather;
use self::layout::Reader;
use super::{Description, SensorSource, SourceError, SourceFrame};
use crate::Clock;

pub use layout::{Axes, Layout, Unit};

/// How long a message is waited for at once.
const PATIENCE: Duration = Duration::from_millis(100);
/// Nothing for this long is trouble, nanoseconds.
const SILENT_NS: i64 = 3_000_000_000;
/// The largest packet that UDP carries.
const LARGEST: usize = 65_536;
/// Packets thrown away at once that came while nobody was listening.
const MOST_STALE: usize = 10_000;

/// Where messages come, and what they mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OscConfig {
    /// Where to listen. Whoever can reach this address can put people into the room.
    pub listen: SocketAddr,
    /// Whose messages they are.
    pub layout: Layout,
    /// The joints they have; absent: the layout's usual.
    pub joint_set: Option<JointSet>,
    /// What their numbers are worth; absent: the layout's usual.
    pub unit: Option<Unit>,
    /// Their axes as [`Axes`] writes them, e.g. `-x,-y,z`; absent: the layout's usual.
    pub axes: Option<String>,
    /// A pause this long ends a frame, milliseconds.
    pub gap_ms: f64,
}

impl Default for OscConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 9000)),
            layout: Layout::default(),
            joint_set: None,
            unit: None,
            axes: None,
            gap_ms: 8.0,
        }
    }
}

/// What came so far.
#[derive(Clone, Debug, Default)]
struct Counts {
    packets: u64,
    /// Packets that are no OSC.
    broken: u64,
    /// Messages that are none of the layout's.
    foreign: u64,
    /// The address and types of the latest of those.
    example: String,
    understood: u64,
}

/// A socket as a sensor.
pub struct OscSource {
    socket: UdpSocket,
    clock: Arc<dyn Clock>,
    layout: Layout,
    joint_set: JointSet,
    reader: Reader,
    gather: Gather,
    gap: Duration,
    counts: Counts,
    /// When something was last understood, or trouble told.
    heard_ns: i64,
    troubled: bool,
    buffer: Vec<u8>,
}

impl OscSource {
    /// Begins to listen.
    ///
    /// # Errors
    /// The address is taken or not this computer's, or the configuration cannot be meant.
    pub fn open(config: &OscConfig, clock: &Arc<dyn Clock>) -> Result<Self, SourceError> {
        let fatal = |why: String| SourceError::Final(format!("osc source: {why}"));
        if !(1.0..=1000.0).contains(&config.gap_ms) {
            let found = config.gap_ms;
            return Err(fatal(format!(
                "`gap_ms` must lie between 1 and 1000, found {found}"
            )));
        }
        let axes = config.axes.as_deref().map(str::parse::<Axes>).transpose();
        let axes = axes.map_err(fatal)?;
        let socket = UdpSocket::bind(config.listen).map_err(|error| {
            let advice = match error.kind() {
                ErrorKind::AddrInUse => {
                    "another program listens there: end it or choose another port"
                }
                ErrorKind::AddrNotAvailable => "this computer has no such address",
                _ => "choose another address or port",
            };
            fatal(format!(
                "cannot listen on {}: {error}; {advice}",
                config.listen
            ))
        })?;
        let joint_set = config.joint_set.unwrap_or(config.layout.usual_joint_set());
        let reader = Reader::new(config.layout, joint_set, config.unit, axes);
        let gap = Duration::from_secs_f64(config.gap_ms / 1000.0);
        Ok(Self {
            gather: Gather::new(reader.joint_count(), gap.as_nanos() as i64),
            socket,
            heard_ns: clock.monotonic_ns(),
            clock: clock.clone(),
            layout: config.layout,
            joint_set,
            reader,
            gap,
            counts: Counts::default(),
            troubled: false,
            buffer: vec![0; LARGEST],
        })
    }

    /// Where it listens.
    pub fn local_addr(&self) -> std::io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Receives one packet, or nothing for a moment.
    fn receive(&mut self) -> Result<(), SourceError> {
        let patience = if self.gather.is_open() {
            self.gap
        } else {
            PATIENCE
        };
        let received = self
            .socket
            .set_read_timeout(Some(patience))
            .and_then(|()| self.socket.recv(&mut self.buffer));
        let now_ns = self.clock.monotonic_ns();
        match received {
            Ok(length) => self.take_in(length, now_ns),
            // A port that is closed at the other end is none of our business.
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock
                        | ErrorKind::TimedOut
                        | ErrorKind::Interrupted
                        | ErrorKind::ConnectionReset
                ) => {}
            Err(error) => return Err(SourceError::Trouble(format!("the socket failed: {error}"))),
        }
        self.gather.idle(now_ns);
        Ok(())
    }

    fn take_in(&mut self, length: usize, now_ns: i64) {
        self.counts.packets += 1;
        let Some(messages) = packet::messages(&self.buffer[..length]) else {
            self.counts.broken += 1;
            return;
        };
        for (tag, message) in messages {
            match self.reader.read(&message) {
                Some(said) => {
                    self.counts.understood += 1;
                    self.heard_ns = now_ns;
                    self.gather.hear(said, tag, now_ns);
                }
                None => {
                    self.counts.foreign += 1;
                    self.counts.example = shown(&message);
                }
            }
        }
    }

    /// What is wrong, if nothing that can be used has come for a while.
    fn trouble(&mut self) -> Option<SourceError> {
        let now_ns = self.clock.monotonic_ns();
        if now_ns.saturating_sub(self.heard_ns) < SILENT_NS {
            return None;
        }
        self.heard_ns = now_ns;
        self.troubled = true;
        let (counts, layout) = (&self.counts, self.layout);
        let at = self
            .socket
            .local_addr()
            .map_or_else(|_| "its port".into(), |at| at.to_string());
        Some(SourceError::Trouble(
            if counts.foreign > 0 && counts.understood == 0 {
                format!(
                    "{} messages came to {at}, none that layout {layout} and joint set {} know, e.g. `{}`; see --layout and \
                 --joint-set",
                    counts.foreign,
                    self.joint_set.name(),
                    counts.example
                )
            } else if counts.broken > 0 && counts.understood == 0 {
                format!(
                    "{} packets came to {at}, and none of them is OSC",
                    counts.broken
                )
            } else {
                format!(
                    "no OSC message comes to {at}; does the sender run, and does it send to this address and port?"
                )
            },
        ))
    }

    /// Throws away what came while trouble was told: it is old.
    fn start_afresh(&mut self) {
        if std::mem::take(&mut self.troubled) && self.socket.set_nonblocking(true).is_ok() {
            let mut stale = 0;
            while stale < MOST_STALE && self.socket.recv(&mut self.buffer).is_ok() {
                stale += 1;
            }
            self.gather.clear();
            let _ = self.socket.set_nonblocking(false);
        }
    }
}

impl SensorSource for OscSource {
    fn description(&self) -> Description {
        Description {
            model: format!("OSC ({})", self.layout),
            joint_set: self.joint_set,
            camera: None,
        }
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        self.start_afresh();
        loop {
            if let Some(frame) = self.gather.next() {
                return Ok(Some(frame));
            }
            if let Some(trouble) = self.trouble() {
                return Err(trouble);
            }
            self.receive()?;
        }
    }
}

impl Drop for OscSource {
    fn drop(&mut self) {
        let counts = &self.counts;
        let (packets, broken, foreign) = (counts.packets, counts.broken, counts.foreign);
        let surplus = self.gather.surplus;
        tracing::info!(
            packets,
            broken,
            foreign,
            surplus,
            "no longer listening for OSC"
        );
    }
}

/// A message as a person reads it: address and types.
fn shown(message: &rosc::OscMessage) -> String {
    let types = message.args.iter().map(|arg| match arg {
        rosc::OscType::Int(_) => 'i',
        rosc::OscType::Float(_) => 'f',
        rosc::OscType::Double(_) => 'd',
        rosc::OscType::String(_) => 's',
        rosc::OscType::Long(_) => 'h',
        _ => '?',
    });
    let types: String = types.take(16).collect();
    let address: String = message.addr.chars().take(60).collect();
    format!("{} {types}", address.escape_debug())
}

#[cfg(test)]
mod tests;
