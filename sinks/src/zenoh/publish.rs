//! The session and what goes out on it.

use std::sync::Arc;

use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Config, Session};

use super::ros::Ros;
use super::{Mode, Settings};
use crate::Frames;
use crate::meter::Meter;

pub(super) async fn run(
    settings: Settings,
    frames: Frames,
    meter: Arc<Meter>,
) -> Result<(), String> {
    let session = open(&settings).await.map_err(|error| {
        format!(
            "cannot reach Zenoh at {}: {error}; start a router there (`zenohd`, `rmw_zenohd`), or set `mode = \"peer\"` and `listen`",
            settings.connect.join(", ")
        )
    })?;
    meter.set_trouble(String::new());
    let failed = |error| format!("Zenoh cannot send: {error}");
    let encoding = Encoding::APPLICATION_PROTOBUF.with_schema("posefuse.v1.RoomFrame");
    let key = format!("{}/frames", settings.key);
    let publisher = publisher(&session, key, encoding).await.map_err(failed)?;
    let mut ros = match settings.ros {
        true => Some(
            Ros::open(&session, settings.ros_domain)
                .await
                .map_err(failed)?,
        ),
        false => None,
    };
    for sequence in 0u64.. {
        let frame = frames.next().await;
        let attachment = sequence.to_le_bytes();
        let put = publisher.put(frame.to_wire()).attachment(attachment);
        put.await.map_err(failed)?;
        if let Some(ros) = &mut ros {
            ros.put(&frame).await.map_err(failed)?;
        }
        meter.sent(&frame);
    }
    Ok(())
}

/// Never waits for a subscriber: what finds no place is dropped. Sent at once, not gathered into batches.
pub(super) async fn publisher(
    session: &Session,
    key: String,
    encoding: Encoding,
) -> zenoh::Result<Publisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(encoding)
        .congestion_control(CongestionControl::Drop)
        .express(true)
        .await
}

async fn open(settings: &Settings) -> zenoh::Result<Session> {
    let mode = match settings.mode {
        Mode::Peer => "peer",
        Mode::Client => "client",
    };
    let json = |endpoints: &[String]| serde_json::to_string(endpoints).unwrap_or_default();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", format!("\"{mode}\"")),
        ("connect/endpoints", json(&settings.connect)),
        ("listen/endpoints", json(&settings.listen)),
        // Nobody is looked for or told of but whom the settings name.
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
    ] {
        config.insert_json5(key, &value)?;
    }
    zenoh::open(config).await
}
