//! The Lab Streaming Layer: joints as samples beside EEG, eye tracking and markers, all on one clock.
//!
//! One stream for each slot of a person, of as many channels whoever is there, so that recorders can start before anybody
//! comes. Samples are stamped with the time of capture. liblsl is loaded when the sink is switched on.

mod sample;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use posefuse_devices::lsl::{Lsl, LslError, Outlet};
use serde::{Deserialize, Serialize};

use self::sample::{Sampler, stream};
use crate::meter::Meter;
use crate::sink::Sink;
use crate::{Axes, Frames, Joints, Kind, LiveFrame, SettingsError};

/// Most people: each has a stream.
const MOST_PEOPLE: usize = 16;

/// Section `[sinks.lsl]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// On from the start.
    pub enabled: bool,
    /// What streams are called, with the number of the slot: `Posefuse 1`. Two servers in one network need two names.
    pub name: String,
    /// For how many people there are streams, 1 to 16.
    pub people: usize,
    /// Most samples a second; 0: every frame.
    pub rate_hz: f64,
    /// Which way the axes point.
    pub axes: Axes,
    /// Which positions.
    pub joints: Joints,
    /// liblsl or its folder; empty: PYLSL_LIB, then where the system keeps libraries.
    pub library: PathBuf,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            enabled: false,
            name: "Posefuse".to_owned(),
            people: 2,
            rate_hz: 0.0,
            axes: Axes::Room,
            joints: Joints::Fused,
            library: PathBuf::new(),
        }
    }
}

impl Settings {
    /// As a sink; liblsl listens on all interfaces, which is for all who are in the network.
    pub(crate) fn sink(&self, allow_remote: bool) -> LslSink {
        LslSink {
            settings: self.clone(),
            allow_remote,
        }
    }
}

/// The settings, and leave to be seen in the network.
pub(crate) struct LslSink {
    settings: Settings,
    allow_remote: bool,
}

impl Sink for LslSink {
    fn kind(&self) -> Kind {
        Kind::Lsl
    }

    fn place(&self) -> String {
        let Settings { name, people, .. } = &self.settings;
        match people {
            1 => format!("stream `{name} 1`"),
            _ => format!("streams `{name} 1` to `{name} {people}`"),
        }
    }

    fn rate_hz(&self) -> f64 {
        self.settings.rate_hz
    }

    fn check(&self, allow_remote: bool) -> Result<(), SettingsError> {
        let wrong = |key, expected| Err(SettingsError::of(Kind::Lsl, key, expected));
        let Settings { name, people, .. } = &self.settings;
        if !(1..=MOST_PEOPLE).contains(people) {
            return wrong("people", format!("1 to {MOST_PEOPLE}, found {people}"));
        }
        if name.trim().is_empty() || name.chars().any(char::is_control) {
            return wrong(
                "name",
                format!(
                    "a name of visible characters, found `{}`",
                    name.escape_debug()
                ),
            );
        }
        match self.settings.enabled && !allow_remote {
            true => wrong("enabled", format!("`false`, or leave: {REMOTE}")),
            false => Ok(()),
        }
    }

    fn run(&self, frames: Frames, meter: Arc<Meter>) -> BoxFuture<'static, Result<(), String>> {
        match self.allow_remote {
            true => send(self.settings.clone(), frames, meter).boxed(),
            false => std::future::ready(Err(REMOTE.to_owned())).boxed(),
        }
    }
}

const REMOTE: &str = "the Lab Streaming Layer listens where all machines of the network reach it; set `allow_remote = true` \
    under `[sinks]` to show people's movements there";

async fn send(settings: Settings, frames: Frames, meter: Arc<Meter>) -> Result<(), String> {
    let for_opening = settings.clone();
    let opening = tokio::task::spawn_blocking(move || Streams::open(&for_opening));
    let opened = opening.await.map_err(|error| error.to_string())?;
    let mut streams = opened.map_err(|error| error.to_string())?;
    meter.set_trouble(String::new());
    let mut sampler = Sampler::new(&settings);
    loop {
        let frame = frames.next().await;
        let pushed = streams.push(&frame, &sampler.samples(&frame));
        pushed.map_err(|error| error.to_string())?;
        meter.sent(&frame);
    }
}

/// The open streams. Closing them waits for liblsl's threads, which is no work for a task; the program's end waits for it.
struct Streams {
    library: Arc<Lsl>,
    outlets: Vec<Outlet>,
}

impl Streams {
    fn open(settings: &Settings) -> Result<Self, LslError> {
        let place = &settings.library;
        let library = Lsl::load((!place.as_os_str().is_empty()).then_some(place.as_path()))?;
        tracing::info!(version = library.version(), "liblsl");
        let slots = 0..settings.people;
        let outlets = slots.map(|slot| library.outlet(&stream(settings, slot)));
        Ok(Self {
            outlets: outlets.collect::<Result<_, _>>()?,
            library,
        })
    }

    fn push(&mut self, frame: &LiveFrame, samples: &[Vec<f32>]) -> Result<(), LslError> {
        let at_s = self.library.clock_s() - age_s(frame);
        for (outlet, sample) in self.outlets.iter_mut().zip(samples) {
            outlet.push(sample, at_s)?;
        }
        Ok(())
    }
}

impl Drop for Streams {
    fn drop(&mut self) {
        let outlets = std::mem::take(&mut self.outlets);
        if let Ok(runtime) = tokio::runtime::Handle::try_current() {
            runtime.spawn_blocking(move || drop(outlets));
        }
    }
}

/// How long ago a frame was captured, seconds, by civil time.
fn age_s(frame: &LiveFrame) -> f64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let now_ns = now.map_or(0, |now| now.as_nanos() as i64);
    now_ns.saturating_sub(frame.unix_ns) as f64 * 1e-9
}
