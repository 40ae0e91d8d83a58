//! A subscriber that keeps account of every fused frame it gets.

use std::sync::{Arc, Mutex};

use posefuse_proto::v1;
use tokio::task::JoinHandle;
use tokio::time::Instant;
use tonic::Status;

use super::Room;

/// A fused frame as a subscriber got it.
#[derive(Clone, Debug)]
pub struct SeenFrame {
    /// When it came.
    pub at: Instant,
    /// The frame.
    pub frame: v1::RoomFrame,
}

/// Follows `Room.Watch` until it ends or this is dropped.
pub struct Follower {
    seen: Arc<Mutex<Vec<SeenFrame>>>,
    task: JoinHandle<Status>,
}

impl Follower {
    /// Begins to follow the room's fused frames.
    pub async fn new(room: &Room) -> Self {
        let stream = room
            .client()
            .await
            .watch(v1::WatchRequest { max_rate_hz: 0.0 })
            .await;
        let mut stream = stream.expect("the server takes subscribers").into_inner();
        let seen: Arc<Mutex<Vec<SeenFrame>>> = Arc::default();
        let keep = seen.clone();
        let task = tokio::spawn(async move {
            loop {
                match stream.message().await {
                    Ok(Some(frame)) => keep.lock().unwrap().push(SeenFrame {
                        at: Instant::now(),
                        frame,
                    }),
                    Ok(None) => return Status::ok("the stream ended"),
                    Err(status) => return status,
                }
            }
        });
        Self { seen, task }
    }

    /// The frames that came at or after `from`.
    pub fn since(&self, from: Instant) -> Vec<SeenFrame> {
        let seen = self.seen.lock().unwrap();
        seen.iter()
            .filter(|frame| frame.at >= from)
            .cloned()
            .collect()
    }

    /// All frames; fails if a number is missing or a time does not increase.
    pub fn complete(&self) -> Vec<SeenFrame> {
        let seen = self.seen.lock().unwrap();
        for pair in seen.windows(2) {
            let (one, next) = (&pair[0].frame, &pair[1].frame);
            assert_eq!(one.number + 1, next.number, "a subscriber lost frames");
            assert!(
                one.time_ns < next.time_ns,
                "{} ns then {} ns",
                one.time_ns,
                next.time_ns
            );
        }
        seen.clone()
    }

    /// Waits for the stream's end (the server was killed, say): everything that came.
    pub async fn ended(mut self) -> Vec<SeenFrame> {
        let end = tokio::time::timeout(std::time::Duration::from_secs(10), &mut self.task).await;
        assert!(end.is_ok(), "the stream has not ended");
        self.complete()
    }
}

impl Drop for Follower {
    fn drop(&mut self) {
        self.task.abort();
    }
}
