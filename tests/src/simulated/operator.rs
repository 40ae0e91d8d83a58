//! The operator's host: follows all streams of the server, whatever becomes of it, and sends requests.

use std::time::Duration;

use futures_util::future::{LocalBoxFuture, try_join_all};
use hyper_util::rt::TokioIo;
use posefuse_proto::v1::room_client::RoomClient;
use posefuse_proto::v1::{self, SensorState};
use tokio::sync::mpsc;
use tokio::time::sleep;
use tonic::transport::{Channel, Endpoint, Uri};
use tonic::{Status, Streaming};

use super::host::connect;
use super::{Happening, Log};

/// How soon the operator tries again.
const RETRY: Duration = Duration::from_millis(5);

/// Something to ask the server.
pub(super) type Job = Box<dyn FnOnce(RoomClient<Channel>) -> LocalBoxFuture<'static, ()> + Send>;

/// Runs until nobody can send jobs any more.
pub(super) async fn operate(
    url: String,
    sensor_names: Vec<String>,
    mut jobs: mpsc::UnboundedReceiver<Job>,
    log: Log,
) -> turmoil::Result {
    for stream in [
        Stream::Frames,
        Stream::Sensors(sensor_names),
        Stream::Status,
    ] {
        tokio::task::spawn_local(follow(url.clone(), stream, log.clone()));
    }
    while let Some(job) = jobs.recv().await {
        let url = url.clone();
        tokio::task::spawn_local(async move { job(client(&url).await).await });
    }
    Ok(())
}

/// A connection to the server, as soon as there can be one.
async fn client(url: &str) -> RoomClient<Channel> {
    loop {
        let endpoint = Endpoint::from_shared(url.to_owned())
            .expect("an address")
            .connect_timeout(Duration::from_secs(1))
            .http2_keep_alive_interval(Duration::from_millis(500))
            .keep_alive_timeout(Duration::from_secs(1))
            .keep_alive_while_idle(true);
        let connector = tower::service_fn(|uri: Uri| async move {
            connect(uri.host().unwrap_or_default())
                .await
                .map(TokioIo::new)
        });
        match endpoint.connect_with_connector(connector).await {
            Ok(channel) => return RoomClient::new(channel),
            Err(_) => sleep(RETRY).await,
        }
    }
}

enum Stream {
    Frames,
    /// Of the sensors with these names.
    Sensors(Vec<String>),
    Status,
}

/// Follows one stream through all lives of the server.
async fn follow(url: String, stream: Stream, log: Log) {
    loop {
        let mut client = client(&url).await;
        // Whatever ends a stream, another follows.
        let _ = match &stream {
            Stream::Frames => frames(&mut client, &log).await,
            Stream::Sensors(names) => {
                let each = names.iter().map(|name| sensor(client.clone(), name, &log));
                try_join_all(each).await.map(|_| ())
            }
            Stream::Status => status(&mut client, &log).await,
        };
        sleep(RETRY).await;
    }
}

async fn each<M>(mut stream: Streaming<M>, mut with: impl FnMut(M)) -> Result<(), Status> {
    while let Some(message) = stream.message().await? {
        with(message);
    }
    Ok(())
}

async fn frames(client: &mut RoomClient<Channel>, log: &Log) -> Result<(), Status> {
    let stream = client.watch(v1::WatchRequest { max_rate_hz: 0.0 }).await?;
    let pose = |track: &v1::Track| {
        track
            .positions
            .iter()
            .take(6)
            .map(|p| p.to_bits())
            .collect()
    };
    each(stream.into_inner(), |frame| {
        log.add(Happening::Fused {
            number: frame.number,
            time_ns: frame.time_ns,
            pose: frame.tracks.first().map_or_else(Vec::new, pose),
        });
    })
    .await
}

/// One stream for each sensor: the server gives numbers in the order of joining, names stay.
async fn sensor(mut client: RoomClient<Channel>, name: &str, log: &Log) -> Result<(), Status> {
    let request = v1::WatchSensorsRequest {
        sensors: vec![name.to_owned()],
        max_rate_hz: 0.0,
    };
    let stream = client.watch_sensors(request).await?;
    each(stream.into_inner(), |observation| {
        log.add(Happening::Observed {
            sensor: name.to_owned(),
            sequence: observation.sequence,
            captured_ns: observation.captured_ns,
        });
    })
    .await
}

async fn status(client: &mut RoomClient<Channel>, log: &Log) -> Result<(), Status> {
    let stream = client
        .watch_status(v1::WatchStatusRequest { max_rate_hz: 30.0 })
        .await?;
    let mut known: Vec<(String, SensorState)> = Vec::new();
    each(stream.into_inner(), |status| {
        let now = status.sensors.iter().map(|sensor| {
            let name = sensor.info.as_ref().map(|info| info.name.clone());
            (name.unwrap_or_default(), sensor.state())
        });
        let now: Vec<_> = now.collect();
        for (sensor, state) in now.iter().filter(|entry| !known.contains(entry)) {
            log.add(Happening::State {
                sensor: sensor.clone(),
                state: *state,
            });
        }
        known = now;
    })
    .await
}
