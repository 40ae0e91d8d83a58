//! Sinks that listen: four clients of each read everything, and in a second run one more comes that never reads.
//!
//! Two figures each: what the server's status says (until the operating system has the bytes), and what clients see (until they
//! have the message).

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use futures_util::{SinkExt, StreamExt};
use posefuse_sinks::{Config, Tap};
use posefuse_skeleton::RoomFrame;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

use crate::figures::share;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

const CLIENTS: usize = 4;

/// When each frame was offered, and how long each took to each client, milliseconds.
#[derive(Default)]
struct Journal {
    offered: Mutex<Vec<Instant>>,
    taken_ms: Mutex<Vec<f64>>,
}

pub(crate) async fn measure_all(frames: Arc<[RoomFrame]>, rate_hz: f64) -> Result<()> {
    println!("sinks that listen, milliseconds");
    println!("sink       still  status p50   p99   clients p50   p99   lost");
    for (kind, port) in [("websocket", 47401), ("foxglove", 48765)] {
        for still in [false, true] {
            let address = SocketAddr::from(([127, 0, 0, 1], port));
            measure(kind, address, still, frames.clone(), rate_hz).await?;
        }
    }
    Ok(())
}

async fn measure(
    kind: &str,
    address: SocketAddr,
    still: bool,
    frames: Arc<[RoomFrame]>,
    rate_hz: f64,
) -> Result<()> {
    let mut config = Config::default();
    (config.websocket.listen, config.foxglove.listen) = (address, address);
    let (sinks, tap, hub) = posefuse_sinks::open(&config)?;
    let hub = tokio::spawn(hub.run());
    sinks.switch(kind, true)?;
    let journal = Arc::new(Journal::default());
    let mut readers = Vec::new();
    for _ in 0..CLIENTS {
        let client = connect(address).await?;
        readers.push(tokio::spawn(read(client, journal.clone())));
    }
    let _stays = match still {
        true => Some(connect(address).await?),
        false => None,
    };
    let playing = journal.clone();
    tokio::task::spawn_blocking(move || play(&tap, &playing, &frames, rate_hz)).await?;
    let _ = hub.await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    let all = sinks.statuses().into_iter();
    let status = all.filter(|status| status.kind.name() == kind);
    for status in status {
        let [p50, p99] = percentiles(&journal);
        println!(
            "{kind:<10} {:<5}  {:>10.2} {:>5.2}   {p50:>11.2} {p99:>5.2}   {}",
            if still { "one" } else { "none" },
            status.p50_ms.unwrap_or(f64::NAN),
            status.p99_ms.unwrap_or(f64::NAN),
            status.dropped,
        );
    }
    readers.iter().for_each(|reader| reader.abort());
    sinks.stop().await;
    Ok(())
}

async fn connect(address: SocketAddr) -> Result<tokio_tungstenite::WebSocketStream<TcpStream>> {
    let mut request = format!("ws://{address}/").into_client_request()?;
    let protocol = "foxglove.sdk.v1".parse()?;
    // The JSON sink knows no sub-protocols, and a client must not be left without an answer to its wish.
    if address.port() == 48765 {
        request
            .headers_mut()
            .insert("sec-websocket-protocol", protocol);
    }
    let stream = loop {
        match TcpStream::connect(address).await {
            Ok(stream) => break stream,
            Err(_) => tokio::time::sleep(Duration::from_millis(50)).await,
        }
    };
    stream.set_nodelay(true)?;
    let (mut client, _) = tokio_tungstenite::client_async(request, stream).await?;
    if address.port() == 48765 {
        let wish =
            r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":1},{"id":2,"channelId":2}]}"#;
        client.send(Message::text(wish)).await?;
    }
    Ok(client)
}

async fn read(mut client: tokio_tungstenite::WebSocketStream<TcpStream>, journal: Arc<Journal>) {
    let mut frames = 0;
    while let Some(Ok(message)) = client.next().await {
        let is_last_of_a_frame = match &message {
            Message::Text(text) => text.contains("\"frame\""),
            // The second subscription is the last that is told of a frame.
            Message::Binary(bytes) => bytes[0] == 1 && bytes[1] == 2,
            _ => false,
        };
        if !is_last_of_a_frame {
            continue;
        }
        let offered = lock(&journal.offered).get(frames).copied();
        if let Some(offered) = offered {
            lock(&journal.taken_ms).push(offered.elapsed().as_secs_f64() * 1e3);
        }
        frames += 1;
    }
}

fn play(tap: &Tap, journal: &Journal, frames: &[RoomFrame], rate_hz: f64) {
    let begun = Instant::now() + Duration::from_millis(300);
    for (number, frame) in frames.iter().enumerate() {
        let due = begun + Duration::from_secs_f64(number as f64 / rate_hz);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        lock(&journal.offered).push(Instant::now());
        tap.offer(frame, || 0);
    }
}

fn percentiles(journal: &Journal) -> [f64; 2] {
    let all = lock(&journal.taken_ms).clone();
    [0.5, 0.99].map(|of| share(&all, of))
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}
