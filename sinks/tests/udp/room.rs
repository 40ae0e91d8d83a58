//! A room with simulated people whose sinks are on, and sockets where they send to.

use std::net::SocketAddr;
use std::sync::LazyLock;
use std::time::Duration;

use nalgebra::Matrix3;
use posefuse_kinematics::{Crowd, Figure};
use posefuse_simulator::motion::{Cast, Performance, Situation};
use posefuse_sinks::{Config, SinkStatus, Sinks, Tap};
use posefuse_skeleton::{
    Confidence, Joint, JointState, Provenance, RoomFrame, SensorId, SensorSet, Timestamp, Track,
    TrackId,
};
use tokio::net::UdpSocket;

pub(crate) const RATE_HZ: f64 = 30.0;
/// Civil time minus the frames' clock.
pub(crate) const UNIX_OFFSET_NS: i64 = 1_800_000_000_250_000_000;

/// When the first frame is, seconds: so that both people walk half a metre and more in the five seconds after it.
pub(crate) static BEGIN_S: LazyLock<f64> = LazyLock::new(|| {
    let performance = performance();
    let at = |person, seconds| {
        let joints = performance.pose(person, seconds);
        joints[Joint::SpineBase].unwrap().vector()
    };
    let path = |person: usize, begin: usize| -> f64 {
        let steps = (0..10).map(|step| begin as f64 + f64::from(step) * 0.5);
        steps
            .map(|from| (at(person, from + 0.5) - at(person, from)).norm())
            .sum()
    };
    let begin = (5..230).find(|begin| path(0, *begin).min(path(1, *begin)) > 0.5);
    begin.expect("they walk together") as f64
});

/// Two people who do everyday things.
pub(crate) fn performance() -> Performance {
    Performance::procedural(Cast {
        seed: 5,
        people: 2,
        area_m: 2.6,
        hugs: false,
        situation: Situation::Everyday,
        away_s: 1.8,
    })
}

/// A frame: of each track its id and which of the people it is.
pub(crate) fn frame(performance: &Performance, number: usize, who: &[(u64, usize)]) -> RoomFrame {
    let seconds = *BEGIN_S + number as f64 / RATE_HZ;
    let sensors = SensorSet::only(SensorId::new(0).unwrap());
    let track = |(id, person): &(u64, usize)| Track {
        id: TrackId(*id),
        since: Timestamp::ZERO,
        sensors,
        skeleton: performance
            .pose(*person, seconds)
            .map(|_, position| JointState {
                position: *position,
                covariance: Matrix3::from_diagonal_element(1e-6),
                confidence: Confidence::FULL,
                provenance: Provenance::Measured(sensors),
            }),
        hands: [None; 2],
    };
    RoomFrame {
        number: number as u64,
        time: Timestamp::from_seconds(seconds),
        look_ahead_ns: 0,
        tracks: who.iter().map(track).collect(),
    }
}

/// Sinks that are on, and the figures that they should be sending.
pub(crate) struct Running {
    pub(crate) sinks: Sinks,
    tap: Tap,
    crowd: Crowd,
}

impl Running {
    pub(crate) fn start(config: &Config) -> Self {
        let (sinks, tap, hub) = posefuse_sinks::open(config).unwrap();
        tokio::spawn(hub.run());
        sinks.start();
        Self {
            sinks,
            tap,
            crowd: Crowd::new(config.bodies.clone()),
        }
    }

    /// Shows a frame, lets the sinks work, and says what its figures are.
    pub(crate) async fn show(&mut self, frame: &RoomFrame) -> Vec<Figure> {
        self.tap.offer(frame, || UNIX_OFFSET_NS);
        for _ in 0..8 {
            tokio::task::yield_now().await;
        }
        self.crowd.step(frame)
    }

    pub(crate) fn status(&self, name: &str) -> SinkStatus {
        let mut all = self.sinks.statuses().into_iter();
        all.find(|status| status.kind.name() == name).unwrap()
    }
}

/// A socket of any free port.
pub(crate) async fn listener() -> (UdpSocket, SocketAddr) {
    let socket = UdpSocket::bind("127.0.0.1:0").await.unwrap();
    let address = socket.local_addr().unwrap();
    (socket, address)
}

/// Sockets of ports that follow each other.
pub(crate) async fn neighbours<const N: usize>() -> [UdpSocket; N] {
    for _ in 0..200 {
        let (first, address) = listener().await;
        let mut sockets = vec![first];
        for offset in 1..N as u16 {
            let port = address.port().saturating_add(offset);
            sockets.extend(UdpSocket::bind(("127.0.0.1", port)).await);
        }
        if let Ok(sockets) = sockets.try_into() {
            return sockets;
        }
    }
    panic!("no free ports that follow each other");
}

/// What comes within five seconds.
pub(crate) async fn within<T>(work: impl Future<Output = T>) -> T {
    tokio::time::timeout(Duration::from_secs(5), work)
        .await
        .expect("nothing came within 5 s")
}
