//! Two simulated people through the sinks, and a client that reads.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::net::SocketAddr;
use std::ops::Range;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use futures_util::StreamExt;
use nalgebra::Matrix3;
use posefuse_simulator::motion::{Cast, Performance, Situation};
use posefuse_sinks::{Config, SinkState, SinkStatus, Sinks, Tap};
use posefuse_skeleton::{
    Confidence, JointMap, JointState, Position, Provenance, Room as RoomAxes, RoomFrame, SensorId,
    SensorSet, Timestamp, Track, TrackId,
};
use serde_json::Value;
use tokio::net::TcpStream;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{self, Message};

const RATE_HZ: f64 = 30.0;
/// Civil time at the server's time 0.
const EPOCH_NS: i64 = 1_700_000_000_123_456_789;
/// Nothing here takes longer.
const LONG: Duration = Duration::from_secs(20);

pub(crate) type Client = WebSocketStream<TcpStream>;

/// The capture time of a frame since 1970.
pub(crate) fn unix_ns(number: u64) -> i64 {
    EPOCH_NS + at(number).ns()
}

fn at(number: u64) -> Timestamp {
    Timestamp::from_seconds(number as f64 / RATE_HZ)
}

/// Sinks of which one listens, and people to be shown.
pub(crate) struct Room {
    pub(crate) sinks: Sinks,
    pub(crate) address: SocketAddr,
    kind: &'static str,
    tap: Mutex<Tap>,
    people: Performance,
}

impl Room {
    /// On a free port, once it listens.
    pub(crate) async fn open(kind: &'static str, change: impl FnOnce(&mut Config)) -> Self {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = free.local_addr().unwrap();
        drop(free);
        let room = Self::on(kind, address, change);
        room.wait_until_it_listens().await;
        room
    }

    pub(crate) fn on(
        kind: &'static str,
        address: SocketAddr,
        change: impl FnOnce(&mut Config),
    ) -> Self {
        let mut config = Config::default();
        for (listen, rate_hz) in [
            (&mut config.websocket.listen, &mut config.websocket.rate_hz),
            (&mut config.foxglove.listen, &mut config.foxglove.rate_hz),
        ] {
            *listen = address;
            *rate_hz = 0.0;
        }
        change(&mut config);
        let (sinks, tap, hub) = posefuse_sinks::open(&config).unwrap();
        tokio::spawn(hub.run());
        sinks.switch(kind, true).unwrap();
        let people = Performance::procedural(Cast {
            seed: 7,
            people: 2,
            area_m: 2.6,
            hugs: false,
            situation: Situation::Everyday,
            away_s: 0.0,
        });
        Self {
            sinks,
            address,
            kind,
            tap: Mutex::new(tap),
            people,
        }
    }

    pub(crate) async fn wait_until_it_listens(&self) {
        tokio::time::timeout(LONG, async {
            while self.status().state != SinkState::Running
                || TcpStream::connect(self.address).await.is_err()
            {
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        })
        .await
        .unwrap();
    }

    pub(crate) fn status(&self) -> SinkStatus {
        let mut all = self.sinks.statuses().into_iter();
        all.find(|status| status.kind.name() == self.kind).unwrap()
    }

    pub(crate) async fn wait_for(&self, condition: impl Fn(&SinkStatus) -> bool) {
        let waiting = async {
            while !condition(&self.status()) {
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        let done = tokio::time::timeout(LONG, waiting).await;
        assert!(done.is_ok(), "waited in vain: {:?}", self.status());
    }

    pub(crate) async fn client(&self, path: &str) -> Client {
        connect(self.address, path, None, &[]).await.unwrap().0
    }

    /// The joints of one of the people.
    pub(crate) fn truth(&self, person: usize, number: u64) -> JointMap<Position<RoomAxes>> {
        self.people.pose(person, number as f64 / RATE_HZ)
    }

    /// Frames with those people, no faster than they can be taken.
    pub(crate) fn play(&self, who: impl Fn(f64) -> Vec<usize>, numbers: Range<u64>) {
        let tap = self.tap.lock().unwrap();
        for number in numbers {
            let people = who(number as f64 / RATE_HZ).into_iter();
            let frame = RoomFrame {
                number,
                time: at(number),
                look_ahead_ns: 0,
                tracks: people.map(|person| self.track(person, number)).collect(),
            };
            let before = self.handled();
            tap.offer(&frame, || EPOCH_NS);
            let offered = Instant::now();
            while self.handled() == before && offered.elapsed() < LONG {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    /// Frames that reached a client, or were lost to one.
    fn handled(&self) -> u64 {
        let status = self.status();
        status.delivered + status.dropped
    }

    fn track(&self, person: usize, number: u64) -> Track {
        let sensors = SensorSet::only(SensorId::new(0).unwrap());
        Track {
            id: TrackId(person as u64 + 1),
            since: Timestamp::ZERO,
            sensors,
            skeleton: self.truth(person, number).map(|_, position| JointState {
                position: *position,
                covariance: Matrix3::from_diagonal_element(1e-4),
                confidence: Confidence::FULL,
                provenance: Provenance::Measured(sensors),
            }),
            hands: [None; 2],
        }
    }
}

/// A client of a library, and the sub-protocol that it got.
pub(crate) async fn connect(
    address: SocketAddr,
    path: &str,
    origin: Option<&str>,
    protocols: &[&str],
) -> Result<(Client, Option<String>), tungstenite::Error> {
    let mut request = format!("ws://{address}{path}").into_client_request()?;
    let headers = request.headers_mut();
    if let Some(origin) = origin {
        headers.insert("origin", origin.parse().unwrap());
    }
    if !protocols.is_empty() {
        let protocols = protocols.join(", ").parse().unwrap();
        headers.insert("sec-websocket-protocol", protocols);
    }
    let stream = TcpStream::connect(address).await?;
    let (client, response) = tokio_tungstenite::client_async(request, stream).await?;
    let protocol = response.headers().get("sec-websocket-protocol");
    Ok((client, protocol.map(|p| p.to_str().unwrap().to_owned())))
}

/// The texts that come, up to the one that is waited for.
pub(crate) async fn texts(client: &mut Client, last: impl Fn(&Value) -> bool) -> Vec<Value> {
    let mut all = Vec::new();
    loop {
        let message = tokio::time::timeout(LONG, client.next()).await.unwrap();
        if let Message::Text(text) = message.expect("more messages").unwrap() {
            all.push(serde_json::from_str(&text).unwrap());
            if last(&all[all.len() - 1]) {
                return all;
            }
        }
    }
}

/// The next so many binary messages.
pub(crate) async fn binary(client: &mut Client, count: usize) -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    while all.len() < count {
        let message = tokio::time::timeout(LONG, client.next()).await.unwrap();
        if let Message::Binary(bytes) = message.expect("more messages").unwrap() {
            all.push(bytes.to_vec());
        }
    }
    all
}
