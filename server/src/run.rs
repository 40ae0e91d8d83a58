//! A server's life: put the parts together, serve until told to stop, then drain.

use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use posefuse_fusion::{ConfigError, Input};
use posefuse_session::{DiskStorage, RecoveryOutcome, Storage, recover};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, oneshot};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::drift::{self, Drift};
use crate::fusion_thread::{self, Command, Fusion};
use crate::ingest::{IngestService, Registry};
use crate::net;
use crate::repair::Repair;
use crate::room::{CalibrationStore, Noted, Room, RoomService, Takes, Triggers, watch_over};
use crate::{Clock, Config, Listener, Parts, ServerError, SystemClock, Threads};

/// How long agents' streams and other work may take to end.
const DRAIN: Duration = Duration::from_secs(2);

impl Parts<TcpListener> {
    /// The parts of a real server: TCP, the disk, the machine's clock, threads of its own.
    ///
    /// # Errors
    /// [`ServerError::Folder`] if the take folder or the calibration's cannot be written; what
    /// [`bind`](crate::bind) gives.
    pub async fn system(config: &Config) -> Result<Self, ServerError> {
        let takes = folder(&config.takes.folder)?;
        let calibration = match config.calibration.file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => folder(parent)?,
            _ => folder(".".as_ref())?,
        };
        Ok(Self {
            listener: crate::bind(config).await?,
            clock: Arc::new(SystemClock::new()),
            takes,
            calibration,
            threads: Threads::Own,
        })
    }
}

fn folder(path: &std::path::Path) -> Result<Arc<dyn Storage>, ServerError> {
    let storage = DiskStorage::new(path).map_err(ServerError::Folder)?;
    Ok(Arc::new(storage))
}

/// Runs a server until `shutdown` comes, then lets everything finish: a running take gets its end.
///
/// # Errors
/// A configuration, folder or address that cannot be used, before anything is served; a thread of the server that
/// ended by itself, afterwards.
pub async fn run<L: Listener>(
    config: Config,
    parts: Parts<L>,
    shutdown: impl Future<Output = ()>,
) -> Result<(), ServerError> {
    config.validate()?;
    let listen = parts
        .listener
        .local_addr()
        .map_err(|source| ServerError::Listen {
            address: config.listen,
            source,
        })?;
    net::check_address(listen, config.allow_remote)?;
    let running = Running::start(config, &parts).await?;
    let router = running.router(listen);
    let stop_serving = CancellationToken::new();
    let serving = tokio::spawn(net::serve(
        parts.listener,
        router,
        running.room.config.net.clone(),
        parts.clock.clone(),
        running.room.connections.clone(),
        stop_serving.clone(),
    ));
    tracing::info!(address = %listen, "the server listens");
    let outcome = running.until(shutdown).await;
    tracing::info!("the server stops");
    stop_serving.cancel();
    running.drain(&*parts.clock).await;
    let _ = serving.await;
    outcome
}

struct Running {
    room: Arc<Room>,
    agents: TaskTracker,
    fusion_ended: tokio::sync::Mutex<oneshot::Receiver<()>>,
}

impl Running {
    async fn start<L>(config: Config, parts: &Parts<L>) -> Result<Self, ServerError> {
        let troubles = recover_takes(parts).await?;
        let (storage, calibration) = (parts.calibration.clone(), config.calibration.clone());
        let now = parts.clock.rfc3339();
        let calibration = parts
            .threads
            .blocking(move || CalibrationStore::load(storage, &calibration, &now))
            .await?;
        let first = calibration.current().map(Input::Calibration);
        let for_models = config.clone();
        let model = parts
            .threads
            .blocking(move || Repair::open(&for_models))
            .await?;
        let (sinks, live, hub) =
            posefuse_sinks::open(&config.sinks).map_err(|error| ConfigError::Value {
                key: format!("sinks.{}", error.key),
                expected: error.expected,
            })?;
        let _ended_with_fusion = parts.threads.spawn("bodies", hub.run())?;
        let Fusion {
            inputs,
            commands,
            snapshot,
            counters,
            ended,
            seen,
            missed,
            repair,
        } = fusion_thread::start(
            &config,
            first.into_iter().collect(),
            model,
            live,
            parts.clock.clone(),
            parts.threads,
        )?;
        let places = Arc::new(Semaphore::new(config.watch.max_subscribers));
        let triggers = Triggers::new(&config.trigger);
        let room = Arc::new(Room {
            config,
            clock: parts.clock.clone(),
            threads: parts.threads,
            storage: parts.takes.clone(),
            registry: Arc::new(Registry::default()),
            inputs,
            commands,
            snapshot,
            counters,
            repair,
            sinks,
            places,
            connections: Arc::default(),
            calibration,
            takes: Takes::new(troubles),
            triggers,
            drift: Drift::default(),
            noted: Noted::default(),
            muting: tokio::sync::Mutex::default(),
            changing: tokio::sync::Mutex::default(),
            disk_free: AtomicU64::new(u64::MAX),
            planning: Arc::new(Semaphore::new(1)),
            tasks: TaskTracker::new(),
            stop: CancellationToken::new(),
        });
        room.look_at_disk().await;
        room.sinks.start();
        room.listen_for_triggers();
        room.tasks.spawn(watch_over(room.clone()));
        room.tasks.spawn(drift::watch(room.clone(), seen, missed));
        Ok(Self {
            room,
            agents: TaskTracker::new(),
            fusion_ended: tokio::sync::Mutex::new(ended),
        })
    }

    fn router(&self, listen: std::net::SocketAddr) -> axum::Router {
        let ingest = IngestService {
            registry: self.room.registry.clone(),
            inputs: self.room.inputs.clone(),
            clock: self.room.clock.clone(),
            tasks: self.agents.clone(),
            stop: self.room.stop.clone(),
        };
        net::router(
            &self.room.config,
            listen,
            ingest,
            RoomService(self.room.clone()),
        )
    }

    async fn until(&self, shutdown: impl Future<Output = ()>) -> Result<(), ServerError> {
        let mut ended = self.fusion_ended.lock().await;
        tokio::select! {
            () = shutdown => Ok(()),
            _ = &mut *ended => {
                tracing::error!("the fusion thread ended: the server cannot go on");
                Err(ServerError::Stopped("fusion"))
            }
        }
    }

    /// In the order of a frame's journey: agents, what they sent, the take, the sinks.
    async fn drain(&self, clock: &dyn Clock) {
        let room = &self.room;
        room.stop.cancel();
        self.agents.close();
        within(clock, self.agents.wait()).await;
        room.note_stop();
        match room.end_take().await {
            Ok(take) => tracing::info!(take = take.name, "the running take was finished"),
            Err(status) => tracing::debug!(%status, "no take to finish"),
        }
        if room.commands.send(Command::End).await.is_ok() {
            let mut ended = self.fusion_ended.lock().await;
            within(clock, async {
                let _ = (&mut *ended).await;
            })
            .await;
        }
        within(clock, room.sinks.stop()).await;
        room.tasks.close();
        within(clock, room.tasks.wait()).await;
    }
}

async fn within(clock: &dyn Clock, work: impl Future<Output = ()>) {
    tokio::select! {
        () = work => {}
        () = clock.sleep(DRAIN) => tracing::warn!("some work did not end in time and is left"),
    }
}

/// Repairs takes that a crash cut off; what could not be repaired is told in words.
async fn recover_takes<L>(parts: &Parts<L>) -> Result<Vec<String>, ServerError> {
    let storage = parts.takes.clone();
    let recoveries = parts.threads.blocking(move || recover(&storage)).await?;
    let mut troubles = Vec::new();
    for recovery in recoveries.map_err(ServerError::Folder)? {
        let name = recovery.name;
        match recovery.outcome {
            RecoveryOutcome::Recovered { info, lost_bytes } => {
                tracing::warn!(
                    take = name,
                    frames = info.frames,
                    lost_bytes,
                    "a take that was cut off is repaired"
                );
            }
            RecoveryOutcome::Damaged(problem) => {
                tracing::error!(
                    take = name,
                    problem,
                    "a take that was cut off could not be repaired"
                );
                troubles.push(format!(
                    "take `{name}` could not be repaired and is left as it was: {problem}"
                ));
            }
        }
    }
    Ok(troubles)
}
