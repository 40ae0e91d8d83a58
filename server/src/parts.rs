//! What a server is given from outside: clock, listener, storage, threads. With simulated ones the same server runs
//! in a simulated network from a seed. It uses no randomness, so none is handed in.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use futures_util::future::BoxFuture;
use posefuse_session::Storage;
use posefuse_skeleton::Timestamp;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::oneshot;
use tokio::time::Instant;

use crate::ServerError;

/// The parts a server is made with.
pub struct Parts<L> {
    /// Where connections come from.
    pub listener: L,
    /// What time it is.
    pub clock: Arc<dyn Clock>,
    /// Where takes are kept.
    pub takes: Arc<dyn Storage>,
    /// Where the calibration is kept; may be the same folder.
    pub calibration: Arc<dyn Storage>,
    /// Where the fusion and recorder loops run.
    pub threads: Threads,
}

/// The server's clock: monotonic, with its distance from civil time.
pub trait Clock: Send + Sync + 'static {
    /// The time now; never runs backwards.
    fn now(&self) -> Timestamp;
    /// Civil time (nanoseconds since 1970, UTC) minus this clock's, as it is now: civil time may be set anew.
    fn unix_offset_ns(&self) -> i64;
    /// Comes back when `deadline` has passed.
    fn sleep_until(&self, deadline: Timestamp) -> BoxFuture<'static, ()>;
}

impl dyn Clock {
    /// Comes back after `duration`.
    pub(crate) fn sleep(&self, duration: Duration) -> BoxFuture<'static, ()> {
        self.sleep_until(self.now().plus_ns(duration.as_nanos() as i64))
    }

    /// Civil time now, nanoseconds since 1970, UTC.
    pub(crate) fn unix_ns(&self) -> i64 {
        self.now().ns().saturating_add(self.unix_offset_ns())
    }

    /// Civil time now, RFC 3339, UTC, to the second.
    pub(crate) fn rfc3339(&self) -> String {
        let seconds = self.unix_ns().div_euclid(1_000_000_000);
        jiff::Timestamp::from_second(seconds)
            .map_or_else(|_| String::new(), |time| time.to_string())
    }

    /// Civil time now where the server stands, as a name that sorts by time.
    pub(crate) fn local_name(&self) -> String {
        let seconds = self.unix_ns().div_euclid(1_000_000_000);
        let local = jiff::Timestamp::from_second(seconds).unwrap_or_default();
        let local = local.to_zoned(jiff::tz::TimeZone::system());
        local.strftime("%Y-%m-%d_%H-%M-%S").to_string()
    }
}

/// Tokio's clock: the machine's monotonic one, or a simulated network's inside of one. Zero when it was made.
pub struct SystemClock {
    zero: Instant,
    civil: Civil,
}

enum Civil {
    /// The machine's, looked up each time: it is set anew by the network's time or after a suspension.
    Machine,
    /// At a fixed distance.
    Fixed(i64),
}

impl SystemClock {
    /// A clock that starts now, civil time from the machine.
    pub fn new() -> Self {
        Self {
            zero: Instant::now(),
            civil: Civil::Machine,
        }
    }

    /// A clock that starts now, when civil time is `unix_offset_ns` after 1970.
    pub fn with_unix_offset_ns(unix_offset_ns: i64) -> Self {
        Self {
            zero: Instant::now(),
            civil: Civil::Fixed(unix_offset_ns),
        }
    }
}

impl Default for SystemClock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock for SystemClock {
    fn now(&self) -> Timestamp {
        Timestamp::from_ns(self.zero.elapsed().as_nanos() as i64)
    }

    fn unix_offset_ns(&self) -> i64 {
        match self.civil {
            Civil::Fixed(offset_ns) => offset_ns,
            Civil::Machine => {
                let unix = SystemTime::now()
                    .duration_since(SystemTime::UNIX_EPOCH)
                    .unwrap_or_default();
                (unix.as_nanos() as i64).saturating_sub(self.now().ns())
            }
        }
    }

    fn sleep_until(&self, deadline: Timestamp) -> BoxFuture<'static, ()> {
        let since_zero = Duration::from_nanos(deadline.ns().max(0) as u64);
        Box::pin(tokio::time::sleep_until(self.zero + since_zero))
    }
}

/// Where connections come from: the system's TCP or a simulated one.
pub trait Listener: Send + 'static {
    /// One connection.
    type Io: AsyncRead + AsyncWrite + Send + Unpin + 'static;
    /// The next connection, with the address of its other end.
    fn accept(&mut self) -> impl Future<Output = io::Result<(Self::Io, SocketAddr)>> + Send;
    /// The address listened on.
    fn local_addr(&self) -> io::Result<SocketAddr>;
}

impl Listener for tokio::net::TcpListener {
    type Io = tokio::net::TcpStream;

    async fn accept(&mut self) -> io::Result<(Self::Io, SocketAddr)> {
        let (stream, peer) = tokio::net::TcpListener::accept(self).await?;
        stream.set_nodelay(true)?;
        Ok((stream, peer))
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        tokio::net::TcpListener::local_addr(self)
    }
}

/// Where the loops of fusion and recording run, and work that blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Threads {
    /// Each on a named thread of its own.
    #[default]
    Own,
    /// All as tasks of the current runtime: for a simulated network.
    Inline,
}

impl Threads {
    /// Runs `future` to its end on a thread called `name`. The receiver fails if it panicked.
    pub(crate) fn spawn<T: Send + 'static>(
        self,
        name: &'static str,
        future: impl Future<Output = T> + Send + 'static,
    ) -> Result<oneshot::Receiver<T>, ServerError> {
        let (done, result) = oneshot::channel();
        let future = async move {
            let _ = done.send(future.await);
        };
        if self == Self::Inline {
            tokio::spawn(future);
            return Ok(result);
        }
        let failed = |source| ServerError::Thread { name, source };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .build()
            .map_err(failed)?;
        std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || runtime.block_on(future))
            .map_err(failed)?;
        Ok(result)
    }

    /// Lets others run before this thread goes to sleep for want of work. When the processor is busy, work gathers
    /// meanwhile, and many messages cost one wake-up instead of each its own.
    pub(crate) fn give_way(self) {
        if self == Self::Own {
            std::thread::yield_now();
        }
    }

    /// Runs work that reads files or computes for long, away from the connections.
    pub(crate) async fn blocking<T: Send + 'static>(
        self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ServerError> {
        match self {
            Self::Own => tokio::task::spawn_blocking(work)
                .await
                .map_err(|_| ServerError::Stopped("blocking work")),
            Self::Inline => Ok(work()),
        }
    }
}
