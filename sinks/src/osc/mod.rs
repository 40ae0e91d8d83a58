//! Positions of joints as floats over OSC, UDP: for TouchDesigner, Max, Pure Data, Processing.
//!
//! `/skel/<person>/<joint>/pos` with three floats, metres; what else is said is in `docs/STREAMING.md`. Floats only, because
//! TouchDesigner's channels are nothing else.

mod speech;

use std::net::SocketAddr;
use std::sync::Arc;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use serde::{Deserialize, Serialize};

use self::speech::Speech;
use crate::meter::Meter;
use crate::remote::refused;
use crate::sink::Sink;
use crate::udp::{Datagrams, Next, next};
use crate::{Axes, Frames, Joints, Kind, SettingsError};

/// Most people that can have fixed numbers.
const MOST_PEOPLE: usize = 64;
/// Most targets: each costs a packet.
const MOST_TARGETS: usize = 16;

/// Section `[sinks.osc]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// On from the start.
    pub enabled: bool,
    /// Where packets go: each gets everything.
    #[serde(deserialize_with = "crate::address::several")]
    pub targets: Vec<SocketAddr>,
    /// Most frames a second; 0: every one.
    pub rate_hz: f64,
    /// Which way the axes point.
    pub axes: Axes,
    /// What `<person>` is.
    pub person: Person,
    /// How many people have numbers if those are slots, 1 to 64.
    pub slots: usize,
    /// Which positions.
    pub joints: Joints,
    /// Whether each joint's confidence is told, too.
    pub confidence: bool,
    /// Whether it is told where each joint comes from.
    pub provenance: bool,
    /// Whether bundles carry the capture time as their time tag, else "immediately".
    pub time_tags: bool,
}

/// What `<person>` in addresses is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Person {
    /// The person's id, which no one else ever gets.
    #[default]
    Id,
    /// A number from 1 that is theirs while they are there, and somebody else's after.
    Slot,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            enabled: false,
            targets: vec![SocketAddr::from(([127, 0, 0, 1], 9000))],
            rate_hz: 60.0,
            axes: Axes::Room,
            person: Person::Id,
            slots: 8,
            joints: Joints::Fused,
            confidence: false,
            provenance: false,
            time_tags: false,
        }
    }
}

impl Sink for Settings {
    fn kind(&self) -> Kind {
        Kind::Osc
    }

    fn place(&self) -> String {
        let targets: Vec<String> = self.targets.iter().map(SocketAddr::to_string).collect();
        format!("udp {}", targets.join(", "))
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn check(&self, allow_remote: bool) -> Result<(), SettingsError> {
        let wrong = |key, expected| Err(SettingsError::of(Kind::Osc, key, expected));
        if !(1..=MOST_TARGETS).contains(&self.targets.len()) {
            let found = self.targets.len();
            return wrong(
                "targets",
                format!("1 to {MOST_TARGETS} addresses, found {found}"),
            );
        }
        if self.targets.iter().any(|target| target.port() == 0) {
            return wrong("targets", "ports of 1 and more, found 0".to_owned());
        }
        if !(1..=MOST_PEOPLE).contains(&self.slots) {
            let found = self.slots;
            return wrong("slots", format!("1 to {MOST_PEOPLE}, found {found}"));
        }
        let mut targets = self.targets.iter();
        match targets.find_map(|target| refused(*target, allow_remote)) {
            Some(why) => wrong("targets", why),
            None => Ok(()),
        }
    }

    fn run(&self, frames: Frames, meter: Arc<Meter>) -> BoxFuture<'static, Result<(), String>> {
        send(self.clone(), frames, meter).boxed()
    }
}

async fn send(settings: Settings, frames: Frames, meter: Arc<Meter>) -> Result<(), String> {
    let mut datagrams = Datagrams::open(&settings.targets, meter).await?;
    let (targets, rate_hz) = (settings.targets.clone(), settings.rate_hz);
    let mut speech = Speech::new(settings);
    loop {
        let (packets, frame) = match next(&frames, rate_hz).await {
            Next::Frame(frame) => (speech.frame(&frame), Some(frame)),
            Next::Quiet => (speech.quiet(), None),
        };
        for packet in &packets {
            for target in &targets {
                datagrams.send(packet, *target).await;
            }
        }
        datagrams.done(frame.as_deref());
    }
}
