//! What each client is told, by what it asked for and what it knows.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

use posefuse_kinematics::Figure;
use posefuse_skeleton::TrackId;
use serde::Serialize;
use tokio_tungstenite::tungstenite::Message;

use super::message::{Head, Hello, Person, RigMessage};
use crate::listen::{Asked, Talk, Welcome};
use crate::{FramePace, LiveFrame};

/// Frames as JSON.
pub(super) struct Json {
    /// Most frames a second; 0: every one.
    pub(super) rate_hz: f64,
}

/// One client.
pub(super) struct Client {
    bodies: bool,
    pace: FramePace,
    /// Whom it was told of last.
    people: BTreeSet<TrackId>,
    /// The rigs it was told of.
    rigs: BTreeMap<TrackId, u32>,
}

/// A frame, and its people as JSON, without and with bodies.
pub(super) struct Prepared {
    live: Arc<LiveFrame>,
    plain: OnceLock<String>,
    with_bodies: OnceLock<String>,
}

impl Prepared {
    fn people(&self, bodies: bool) -> &str {
        let place = if bodies {
            &self.with_bodies
        } else {
            &self.plain
        };
        place.get_or_init(|| {
            let tracks = self.live.frame.tracks.iter();
            let people: Vec<Person<'_>> = tracks
                .map(|track| Person::new(track, self.figure(track.id), bodies))
                .collect();
            json(&people)
        })
    }

    fn figure(&self, id: TrackId) -> Option<&Figure> {
        self.live.figures.iter().find(|figure| figure.id == id)
    }
}

/// Numbers, text and maps of them: nothing in our messages can fail to be written.
fn json(message: &impl Serialize) -> String {
    serde_json::to_string(message).unwrap_or_default()
}

impl Talk for Json {
    type Client = Client;
    type Frame = Prepared;

    fn welcome(&self, asked: &Asked<'_>) -> Result<Welcome<Client>, String> {
        let wishes = Wishes::read(asked.query)?;
        // The sink is thinned out already: a client can only ask for fewer.
        let rate_hz = match wishes.rate_hz {
            Some(rate_hz) if self.rate_hz == 0.0 || rate_hz < self.rate_hz => rate_hz,
            _ => self.rate_hz,
        };
        let hello = json(&Hello::new(wishes.bodies, rate_hz));
        Ok(Welcome {
            client: Client {
                bodies: wishes.bodies,
                pace: FramePace::new(rate_hz),
                people: BTreeSet::new(),
                rigs: BTreeMap::new(),
            },
            protocol: None,
            greeting: vec![Message::text(hello)],
        })
    }

    fn prepare(&self, live: Arc<LiveFrame>) -> Prepared {
        Prepared {
            live,
            plain: OnceLock::new(),
            with_bodies: OnceLock::new(),
        }
    }

    fn live<'a>(&self, frame: &'a Prepared) -> &'a LiveFrame {
        &frame.live
    }

    fn tell(&self, client: &mut Client, frame: &Prepared) -> Vec<Message> {
        let live = &frame.live;
        if !client.pace.is_due(&live.frame) {
            return Vec::new();
        }
        let mut messages = Vec::with_capacity(1);
        if client.bodies {
            messages.extend(client.new_rigs(live));
        }
        let now: BTreeSet<TrackId> = live.frame.tracks.iter().map(|track| track.id).collect();
        let ids = |ids: Vec<&TrackId>| ids.iter().map(|id| id.0).collect();
        let head = Head {
            r#type: "frame",
            number: live.frame.number,
            time_s: live.frame.time.seconds(),
            unix_ns: live.unix_ns.to_string(),
            joined: ids(now.difference(&client.people).collect()),
            left: ids(client.people.difference(&now).collect()),
        };
        client.people = now;
        let text = head.with_people(frame.people(client.bodies));
        messages.push(Message::text(text));
        messages
    }

    fn hear(&self, _client: &mut Client, _text: &str) -> Vec<Message> {
        Vec::new()
    }
}

impl Client {
    /// The rigs in this frame that it does not know.
    fn new_rigs(&mut self, live: &LiveFrame) -> Vec<Message> {
        let present = |id: &TrackId| live.frame.tracks.iter().any(|track| track.id == *id);
        self.rigs.retain(|id, _| present(id));
        let mut messages = Vec::new();
        for figure in &live.figures {
            if self.rigs.insert(figure.id, figure.revision) != Some(figure.revision) {
                let rig = RigMessage::new(figure.id, figure.revision, &figure.rig);
                messages.push(Message::text(json(&rig)));
            }
        }
        messages
    }
}

/// What a client says in the address.
#[derive(Debug, Default, PartialEq)]
struct Wishes {
    bodies: bool,
    rate_hz: Option<f64>,
}

impl Wishes {
    fn read(query: &str) -> Result<Self, String> {
        let mut wishes = Self::default();
        for part in query.split('&').filter(|part| !part.is_empty()) {
            match part.split_once('=').unwrap_or((part, "")) {
                ("bodies", "1" | "true" | "") => wishes.bodies = true,
                ("bodies", "0" | "false") => wishes.bodies = false,
                ("rate", rate) => {
                    let rate_hz = rate.parse().ok();
                    let rate_hz = rate_hz.filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
                    wishes.rate_hz = Some(rate_hz.ok_or_else(|| {
                        format!("expected frames a second above 0 after `rate=`, found `{rate}`")
                    })?);
                }
                _ => {
                    return Err(format!(
                        "expected `bodies=1` or `rate=10` after `?`, found `{part}`"
                    ));
                }
            }
        }
        Ok(wishes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_are_read_or_refused_with_what_was_expected() {
        let both = Wishes {
            bodies: true,
            rate_hz: Some(10.0),
        };
        assert_eq!(Wishes::read("bodies=1&rate=10"), Ok(both));
        assert_eq!(Wishes::read(""), Ok(Wishes::default()));
        for bad in ["rate=0", "rate=nan", "rate", "bodies=2", "body=1"] {
            assert!(Wishes::read(bad).is_err(), "{bad}");
        }
    }
}
