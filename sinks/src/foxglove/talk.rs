//! What each client is told, by what it subscribed to.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use posefuse_proto::foxglove::deletions_of;
use posefuse_skeleton::TrackId;
use tokio_tungstenite::tungstenite::Message;

use super::channel::{Channel, Prepared};
use super::protocol::{
    Advertised, Heard, Level, PROTOCOLS, Said, Subscription, message_data, time,
};
use crate::LiveFrame;
use crate::listen::{Asked, Talk, Welcome};

/// Most subscriptions of one client.
const SUBSCRIPTIONS: usize = 32;

/// The protocol's server side.
pub(super) struct Foxglove {
    session_id: String,
    channels: [Advertised; 3],
}

/// One client.
#[derive(Default)]
pub(super) struct Client {
    subscriptions: BTreeMap<u32, Subscribed>,
}

struct Subscribed {
    channel: Channel,
    /// Whom this scene shows.
    shown: BTreeSet<TrackId>,
}

impl Foxglove {
    pub(super) fn new() -> Self {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
        Self {
            session_id: since_1970.unwrap_or_default().as_nanos().to_string(),
            channels: Channel::ALL.map(Channel::advertised),
        }
    }
}

impl Talk for Foxglove {
    type Client = Client;
    type Frame = Prepared;

    fn welcome(&self, asked: &Asked<'_>) -> Result<Welcome<Client>, String> {
        let mut ours = PROTOCOLS.into_iter();
        let protocol = ours.find(|protocol| asked.protocols.contains(protocol));
        let protocol = protocol.ok_or_else(|| {
            format!(
                "expected the sub-protocol `{}`, found `{}`: connect with Foxglove, or another program that speaks its WebSocket protocol",
                PROTOCOLS.join("` or `"),
                asked.protocols.join(", ")
            )
        })?;
        let info = Said::ServerInfo {
            name: "Posefuse",
            capabilities: ["time"],
            supported_encodings: [],
            metadata: [("posefuse", env!("CARGO_PKG_VERSION"))].into(),
            session_id: &self.session_id,
        };
        let channels = Said::Advertise {
            channels: &self.channels,
        };
        Ok(Welcome {
            client: Client::default(),
            protocol: Some(protocol),
            greeting: vec![info.to_message(), channels.to_message()],
        })
    }

    fn prepare(&self, live: Arc<LiveFrame>) -> Prepared {
        Prepared::new(live)
    }

    fn live<'a>(&self, frame: &'a Prepared) -> &'a LiveFrame {
        &frame.live
    }

    fn tell(&self, client: &mut Client, frame: &Prepared) -> Vec<Message> {
        let mut messages = vec![time(frame.unix_ns())];
        for (id, subscribed) in &mut client.subscriptions {
            let message = frame.message(subscribed.channel);
            let deletions = match subscribed.channel {
                Channel::Scene => subscribed.deletions(frame),
                _ => Vec::new(),
            };
            // Both are parts of one `SceneUpdate`: in protobuf messages that follow each other merge.
            messages.push(message_data(*id, frame.unix_ns(), [&deletions, message]));
        }
        messages
    }

    fn hear(&self, client: &mut Client, text: &str) -> Vec<Message> {
        match serde_json::from_str(text) {
            Ok(Heard::Subscribe { subscriptions }) => subscriptions
                .into_iter()
                .filter_map(|wish| client.subscribe(wish).err())
                .map(|why| status(Level::Error, why))
                .collect(),
            Ok(Heard::Unsubscribe { subscription_ids }) => {
                for id in subscription_ids {
                    client.subscriptions.remove(&id);
                }
                Vec::new()
            }
            Err(error) => vec![status(
                Level::Warning,
                format!("expected `subscribe` or `unsubscribe`: {error}"),
            )],
        }
    }
}

fn status(level: Level, message: String) -> Message {
    Said::Status { level, message }.to_message()
}

impl Client {
    fn subscribe(&mut self, wish: Subscription) -> Result<(), String> {
        let Subscription { id, channel_id } = wish;
        let channel = Channel::of_id(channel_id).ok_or_else(|| {
            format!("there is no channel {channel_id}: subscribe to one that was advertised")
        })?;
        if self.subscriptions.contains_key(&id) {
            return Err(format!(
                "there is a subscription {id} already: choose another number"
            ));
        }
        if self.subscriptions.len() >= SUBSCRIPTIONS {
            return Err(format!(
                "there are {SUBSCRIPTIONS} subscriptions, as many as may be: end one"
            ));
        }
        let shown = BTreeSet::new();
        self.subscriptions.insert(id, Subscribed { channel, shown });
        Ok(())
    }
}

impl Subscribed {
    /// The removal of those who are shown and not in this frame.
    fn deletions(&mut self, frame: &Prepared) -> Vec<u8> {
        let tracks = frame.live.frame.tracks.iter();
        let now: BTreeSet<TrackId> = tracks.map(|track| track.id).collect();
        let left = self.shown.difference(&now).copied();
        let deletions = deletions_of(left, frame.unix_ns());
        self.shown = now;
        deletions
    }
}
