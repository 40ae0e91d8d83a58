//! Starting and stopping takes from other programs: HTTP, OSC, and the capture packets of other motion-capture systems.
//!
//! HTTP comes by the server's own port (`net::api`). OSC and capture packets come over UDP, each on a port of its own, and
//! only where the configuration names one: anybody who reaches such a port may record.

mod capture;
mod listen;
mod osc;

use std::fmt;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};

use posefuse_fusion::ConfigError;
use posefuse_proto::v1;
use posefuse_session::Event;
use serde::{Deserialize, Serialize};
use tonic::Status;

use super::Room;

/// Longest name of a take that is made of what another program calls it.
const MAX_NAME: usize = 80;

/// Where other programs start and stop takes, beside HTTP. Section `[trigger]`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Leave to listen where other machines can reach it.
    pub allow_remote: bool,
    /// Address and port for OSC over UDP; empty: none.
    pub osc: String,
    /// Address and port for `CaptureStart` and `CaptureStop`; empty: none.
    pub capture: String,
}

impl Config {
    /// What is listened to, and where.
    ///
    /// # Errors
    /// No address and port, or one that other machines reach, without leave.
    fn places(&self) -> Result<Vec<(Way, SocketAddr)>, ConfigError> {
        let mut places = Vec::new();
        for (way, text) in [(Way::Osc, &self.osc), (Way::Capture, &self.capture)] {
            if text.is_empty() {
                continue;
            }
            let wrong = |expected: String| ConfigError::Value {
                key: format!("trigger.{way}"),
                expected,
            };
            let address: SocketAddr = text.parse().map_err(|_| {
                wrong(format!(
                    "an address and port such as \"127.0.0.1:7402\", or \"\" for none, found \"{text}\""
                ))
            })?;
            if !address.ip().to_canonical().is_loopback() && !self.allow_remote {
                return Err(wrong(format!(
                    "an address of this machine alone, found {address}: listen on 127.0.0.1, or set `allow_remote = true` \
                     under `[trigger]` to let everybody on that network start and stop takes"
                )));
            }
            places.push((way, address));
        }
        Ok(places)
    }

    /// Checks every setting.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.places().map(drop)
    }
}

/// By which way an order came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Http,
    Osc,
    Capture,
}

impl Way {
    fn name(self) -> &'static str {
        match self {
            Self::Http => "http",
            Self::Osc => "osc",
            Self::Capture => "capture",
        }
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What another program wants.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Order {
    /// A take from now on.
    Start(v1::StartTakeRequest),
    /// The end of the running take.
    Stop,
}

/// What came of orders, by way.
#[derive(Debug, Default)]
pub(crate) struct Triggers(Mutex<Vec<(Way, v1::TriggerStatus)>>);

impl Triggers {
    /// With HTTP, which is always there, and what `config` names.
    pub(crate) fn new(config: &Config) -> Self {
        let status = |way: Way, place: String| {
            let status = v1::TriggerStatus {
                name: way.name().to_owned(),
                place,
                ..Default::default()
            };
            (way, status)
        };
        let http = status(
            Way::Http,
            "POST /api/takes/start and /api/takes/stop".into(),
        );
        let places = config.places().unwrap_or_default();
        let udp = places
            .into_iter()
            .map(|(way, address)| status(way, format!("udp {address}")));
        Self(Mutex::new(std::iter::once(http).chain(udp).collect()))
    }

    /// How each way is.
    pub(super) fn statuses(&self) -> Vec<v1::TriggerStatus> {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.iter().map(|(_, status)| status.clone()).collect()
    }

    fn change(&self, way: Way, change: impl FnOnce(&mut v1::TriggerStatus)) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, status)) = all.iter_mut().find(|(known, _)| *known == way) {
            change(status);
        }
    }

    fn set_trouble(&self, way: Way, trouble: String) {
        self.change(way, |status| status.trouble = trouble);
    }

    /// Notes what came of an order.
    fn note(&self, way: Way, unix_ns: i64, outcome: &Result<String, String>) {
        match outcome {
            Ok(words) => tracing::info!(%way, "{words}"),
            Err(words) => tracing::warn!(%way, "{words}"),
        }
        self.change(way, |status| {
            match outcome {
                Ok(_) => status.done += 1,
                Err(_) => status.refused += 1,
            }
            status.latest_refused = outcome.is_err();
            status.latest = match outcome {
                Ok(words) | Err(words) => words.clone(),
            };
            status.latest_unix_ns = unix_ns;
        });
    }
}

impl Room {
    /// Carries out an order of another program, and notes it: in the log, in the room's state and in the take.
    pub(crate) async fn order(
        self: &Arc<Self>,
        way: Way,
        from: Option<SocketAddr>,
        order: Order,
    ) -> Result<v1::Take, Status> {
        let by = from.map_or_else(|| way.to_string(), |peer| format!("{way} by {peer}"));
        let done = match order {
            Order::Start(request) => {
                let done = self.start_take(request).await;
                if done.is_ok() {
                    self.note_order("started", &by);
                }
                done.map(|take| ("started", take))
            }
            Order::Stop => {
                self.note_order("stopped", &by);
                self.stop_take().await.map(|take| ("stopped", take))
            }
        };
        let words = match &done {
            Ok((what, take)) => Ok(format!("{what} take `{}`", take.name)),
            Err(status) => Err(format!("refused: {}", status.message())),
        };
        self.triggers.note(way, self.clock.unix_ns(), &words);
        done.map(|(_, take)| take)
    }

    /// Notes in the log and in the room's state what was no order.
    pub(crate) fn not_an_order(&self, way: Way, words: String) {
        self.triggers.note(way, self.clock.unix_ns(), &Err(words));
    }

    fn note_order(&self, what: &str, by: &str) {
        self.takes.event(Event {
            time_ns: self.clock.now().ns(),
            kind: format!("take-{what}"),
            text: format!("{what} over {by}"),
            ..Event::default()
        });
    }

    /// Listens where the configuration says, until the server stops.
    pub(crate) fn listen_for_triggers(self: &Arc<Self>) {
        for (way, address) in self.config.trigger.places().unwrap_or_default() {
            self.tasks.spawn(listen::listen(self.clone(), way, address));
        }
    }
}

/// A start under the name that another program gives. Names of takes are file names, those of other programs are not: what
/// does not fit becomes `_`, so that no take is lost over a space, and the slate says what it was.
fn start(given: &str, slate: &str, notes: String) -> Order {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    let given = given.trim();
    let name: String = given
        .trim_start_matches('.')
        .chars()
        .map(|c| if fits(c) { c } else { '_' })
        .take(MAX_NAME)
        .collect();
    let slate = match slate {
        "" if name != given => given,
        slate => slate,
    };
    Order::Start(v1::StartTakeRequest {
        slate: slate.to_owned(),
        notes,
        name,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_programs_names_become_names_of_takes() {
        for (given, name, slate) in [
            ("walk_01", "walk_01", ""),
            ("Trial 1", "Trial_1", "Trial 1"),
            (" ../etc ", "_etc", "../etc"),
            ("", "", ""),
        ] {
            let Order::Start(request) = start(given, "", String::new()) else {
                panic!("no start");
            };
            assert_eq!(
                (request.name.as_str(), request.slate.as_str()),
                (name, slate)
            );
        }
        let Order::Start(request) = start("a b", "12A", String::new()) else {
            panic!("no start");
        };
        assert_eq!(request.slate, "12A");
    }

    #[test]
    fn places_need_an_address_and_leave_to_be_reached() {
        let config = |osc: &str, allow_remote| Config {
            osc: osc.to_owned(),
            allow_remote,
            ..Config::default()
        };
        assert!(config("", false).check().is_ok());
        assert!(config("127.0.0.1:7402", false).check().is_ok());
        assert!(config("0.0.0.0:7402", true).check().is_ok());
        for (osc, word) in [
            ("0.0.0.0:7402", "allow_remote"),
            ("7402", "address and port"),
        ] {
            let error = config(osc, false).check().unwrap_err().to_string();
            assert!(
                error.contains("trigger.osc") && error.contains(word),
                "{error}"
            );
        }
    }
}
