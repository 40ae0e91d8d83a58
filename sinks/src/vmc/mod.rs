//! The Virtual Motion Capture Protocol: bodies over OSC, UDP, for Unity (EVMC4U), Unreal (VRM4U), Blender (VMC4B) and
//! programs for avatars. <https://protocol.vmc.info>
//!
//! Unity's axes (X right, Y up, Z forward, left-handed), metres. One skeleton a port: the first person's is the target's, the
//! next ones' follow.

mod body;
mod stage;

use std::net::SocketAddr;
use std::sync::Arc;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use serde::{Deserialize, Serialize};

use self::stage::{Stage, absent};
use crate::meter::Meter;
use crate::remote::refused;
use crate::sink::Sink;
use crate::udp::{Datagrams, Next, next};
use crate::{Frames, Kind, SettingsError};

/// Most people: each has a port.
const MOST_PEOPLE: usize = 16;

/// Section `[sinks.vmc]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// On from the start.
    pub enabled: bool,
    /// Where the first person goes; the next ones go to the ports that follow.
    #[serde(deserialize_with = "crate::address::one")]
    pub target: SocketAddr,
    /// For how many people there are ports, 1 to 16. Who comes when all are taken waits for one.
    pub people: usize,
    /// Most frames a second; 0: every one.
    pub rate_hz: f64,
    /// What moves through the room.
    pub travel: Travel,
    /// Whether fingers are sent of hands that sensors see open or closed.
    pub fingers: bool,
}

/// What moves when somebody walks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Travel {
    /// The root, on the floor below the hips: also receivers that keep their avatar's own bone lengths move it.
    #[default]
    Root,
    /// The hips, and the root stays where the room's middle is: for receivers that know no root.
    Hips,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            enabled: false,
            target: SocketAddr::from(([127, 0, 0, 1], 39539)),
            people: 4,
            rate_hz: 60.0,
            travel: Travel::Root,
            fingers: false,
        }
    }
}

impl Settings {
    /// Where the person of a slot goes.
    fn address(&self, slot: usize) -> SocketAddr {
        let port = self.target.port().saturating_add(slot as u16);
        SocketAddr::new(self.target.ip(), port)
    }
}

impl Sink for Settings {
    fn kind(&self) -> Kind {
        Kind::Vmc
    }

    fn place(&self) -> String {
        let last = self.address(self.people.saturating_sub(1)).port();
        match self.people {
            1 => format!("udp {}", self.target),
            _ => format!("udp {}-{last}", self.target),
        }
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn check(&self, allow_remote: bool) -> Result<(), SettingsError> {
        let wrong = |key, expected| Err(SettingsError::of(Kind::Vmc, key, expected));
        if !(1..=MOST_PEOPLE).contains(&self.people) {
            let found = self.people;
            return wrong("people", format!("1 to {MOST_PEOPLE}, found {found}"));
        }
        let last = usize::from(self.target.port()) + self.people - 1;
        if self.target.port() == 0 || last > usize::from(u16::MAX) {
            let (port, people) = (self.target.port(), self.people);
            return wrong(
                "target",
                format!("a port that {people} ports begin at, found {port}"),
            );
        }
        match refused(self.target, allow_remote) {
            Some(why) => wrong("target", why),
            None => Ok(()),
        }
    }

    fn run(&self, frames: Frames, meter: Arc<Meter>) -> BoxFuture<'static, Result<(), String>> {
        send(self.clone(), frames, meter).boxed()
    }
}

async fn send(settings: Settings, frames: Frames, meter: Arc<Meter>) -> Result<(), String> {
    let mut show = Show {
        datagrams: Datagrams::open(&[settings.target], meter).await?,
        stage: Stage::new(&settings),
        settings,
    };
    loop {
        let (packets, frame) = match next(&frames, show.settings.rate_hz).await {
            Next::Frame(frame) => (show.stage.frame(&frame), Some(frame)),
            Next::Quiet => (show.stage.quiet(), None),
        };
        for (slot, packet) in &packets {
            let target = show.settings.address(*slot);
            show.datagrams.send(packet, target).await;
        }
        show.datagrams.done(frame.as_deref());
    }
}

/// A sink that is on. When it is switched off receivers are told that nobody is there any more.
struct Show {
    settings: Settings,
    datagrams: Datagrams,
    stage: Stage,
}

impl Drop for Show {
    fn drop(&mut self) {
        for slot in self.stage.used() {
            let target = self.settings.address(slot);
            for packet in absent(None) {
                self.datagrams.try_send(&packet, target);
            }
        }
    }
}
