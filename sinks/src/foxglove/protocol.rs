//! The messages of the protocol, as far as a server that only sends needs them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tokio_tungstenite::tungstenite::Message;

/// The sub-protocols that we speak, the preferred one first.
pub(super) const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

const MESSAGE_DATA: u8 = 1;
const TIME: u8 = 2;

/// What a server says as text.
#[derive(Serialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub(super) enum Said<'a> {
    ServerInfo {
        name: &'a str,
        capabilities: [&'a str; 1],
        supported_encodings: [&'a str; 0],
        metadata: BTreeMap<&'a str, &'a str>,
        /// Another one for another run of the server: what a client remembers of the old one is worthless.
        session_id: &'a str,
    },
    Advertise {
        channels: &'a [Advertised],
    },
    Status {
        level: Level,
        message: String,
    },
}

/// A channel as it is offered.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Advertised {
    pub(super) id: u32,
    pub(super) topic: &'static str,
    pub(super) encoding: &'static str,
    pub(super) schema_name: &'static str,
    /// A `FileDescriptorSet`, base64.
    pub(super) schema: String,
    pub(super) schema_encoding: &'static str,
}

/// How bad a status is.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(into = "u8")]
pub(super) enum Level {
    Warning,
    Error,
}

impl From<Level> for u8 {
    fn from(level: Level) -> Self {
        match level {
            Level::Warning => 1,
            Level::Error => 2,
        }
    }
}

impl Said<'_> {
    pub(super) fn to_message(&self) -> Message {
        // Text and numbers: nothing that can fail to be written.
        Message::text(serde_json::to_string(self).unwrap_or_default())
    }
}

/// What a client says as text.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub(super) enum Heard {
    Subscribe { subscriptions: Vec<Subscription> },
    Unsubscribe { subscription_ids: Vec<u32> },
}

/// A wish for the messages of a channel, by a number that the client gives.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Subscription {
    pub(super) id: u32,
    pub(super) channel_id: u32,
}

/// One message of a channel; the parts of the payload follow each other.
pub(super) fn message_data(subscription: u32, unix_ns: u64, payload: [&[u8]; 2]) -> Message {
    let length = payload.iter().map(|part| part.len()).sum::<usize>();
    let mut bytes = Vec::with_capacity(13 + length);
    bytes.push(MESSAGE_DATA);
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(unix_ns.to_le_bytes());
    payload.iter().for_each(|part| bytes.extend(*part));
    Message::binary(bytes)
}

/// The time that a client shows as now.
pub(super) fn time(unix_ns: u64) -> Message {
    let mut bytes = vec![TIME];
    bytes.extend(unix_ns.to_le_bytes());
    Message::binary(bytes)
}
