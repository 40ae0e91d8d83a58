//! One subscriber: a bounded queue on the fusion thread's side, a stream on the connection's side.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream;
use posefuse_skeleton::Timestamp;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tonic::Status;

use super::{Config, Meter};
use crate::net::EncodedStream;

/// The fusion thread's side.
#[derive(Debug)]
pub(crate) struct Subscriber {
    queue: mpsc::Sender<Bytes>,
    cut: Arc<AtomicBool>,
    cut_after_ns: i64,
    full_since: Option<Timestamp>,
    _place: OwnedSemaphorePermit,
}

/// A new subscriber and its stream, if one of the `places` is free. Its place is free again once the fusion thread has
/// let go of it, so that what that thread holds is bounded.
pub(crate) fn subscribe(
    config: &Config,
    places: &Arc<Semaphore>,
) -> Result<(Subscriber, EncodedStream), Status> {
    let place = place(config, places)?;
    let (queue, messages) = mpsc::channel(config.queue);
    let cut = Arc::new(AtomicBool::new(false));
    let after = Duration::from_millis(config.cut_after_ms);
    let subscriber = Subscriber {
        queue,
        cut: cut.clone(),
        cut_after_ns: after.as_nanos() as i64,
        full_since: None,
        _place: place,
    };
    let stream = stream::unfold(Some((messages, cut)), move |open| async move {
        let (mut messages, cut) = open?;
        if let Some(message) = messages.recv().await {
            return Some((Ok(message), Some((messages, cut))));
        }
        let end = if cut.load(Ordering::Acquire) {
            Status::resource_exhausted(format!(
                "cut: nothing was taken for {} s; subscribe again, with `max_rate_hz` if every frame is too much",
                after.as_secs_f64()
            ))
        } else {
            Status::unavailable("the server is stopping")
        };
        Some((Err(end), None))
    });
    Ok((subscriber, Box::pin(stream)))
}

/// One of the places for subscribers, or why there is none.
pub(crate) fn place(
    config: &Config,
    places: &Arc<Semaphore>,
) -> Result<OwnedSemaphorePermit, Status> {
    places.clone().try_acquire_owned().map_err(|_| {
        Status::resource_exhausted(format!(
            "this room serves {} subscribers already: end one, or raise `max_subscribers` under `[watch]`",
            config.max_subscribers
        ))
    })
}

impl Subscriber {
    /// Whether nobody reads its stream any more.
    pub(super) fn is_gone(&self) -> bool {
        self.queue.is_closed()
    }

    /// Offers a message; `false`: the subscriber is gone, or was cut.
    pub(super) fn offer(&mut self, message: &Bytes, now: Timestamp, meter: &Meter) -> bool {
        match self.queue.try_send(message.clone()) {
            Ok(()) => {
                meter.deliver();
                self.full_since = None;
                true
            }
            Err(mpsc::error::TrySendError::Closed(_)) => false,
            Err(mpsc::error::TrySendError::Full(_)) => {
                meter.drop_one();
                let since = *self.full_since.get_or_insert(now);
                let cut = now.since_ns(since) >= self.cut_after_ns;
                if cut {
                    tracing::warn!("a subscriber was cut: it has taken nothing for too long");
                    self.cut.store(true, Ordering::Release);
                }
                !cut
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_subscriber_that_takes_nothing_loses_its_own_and_is_cut() {
        use futures_util::StreamExt;
        let config = Config {
            max_subscribers: 1,
            queue: 2,
            cut_after_ms: 5000,
        };
        let places = Arc::new(Semaphore::new(config.max_subscribers));
        let meter = Meter::default();
        let (mut slow, mut slow_stream) = subscribe(&config, &places).unwrap();
        let refused = subscribe(&config, &places).err().unwrap();
        assert!(
            refused.message().contains("1 subscribers already"),
            "{refused}"
        );
        let message = Bytes::from_static(b"frame");
        let at = |second: i64| Timestamp::from_ns(second * 1_000_000_000);
        for second in 0..7 {
            assert!(
                slow.offer(&message, at(second), &meter),
                "cut too early, at {second} s"
            );
        }
        assert!(!slow.offer(&message, at(7), &meter));
        drop(slow);
        assert_eq!((meter.delivered(), meter.dropped()), (2, 6));
        assert!(slow_stream.next().await.unwrap().is_ok());
        assert!(slow_stream.next().await.unwrap().is_ok());
        let end = slow_stream.next().await.unwrap().unwrap_err();
        assert_eq!(end.code(), tonic::Code::ResourceExhausted);
        assert!(slow_stream.next().await.is_none());
    }
}
