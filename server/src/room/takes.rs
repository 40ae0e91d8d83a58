//! Starting, stopping, listing and changing takes.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use posefuse_proto::v1;
use posefuse_session::{
    Catalogue, Event, TakeChange, TakeError, TakeHeader, TakeInfo, TakeState, check_take_name,
};
use posefuse_skeleton::Timestamp;
use tokio::sync::oneshot;
use tonic::Status;

use super::Room;
use crate::fusion_thread::Command;
use crate::record::{self, Opening, Progress, Record, RecorderTap};

/// What takes are stamped with: only the same build goes on from the engine's state in a take.
pub const BUILD: &str = concat!("posefuse ", env!("CARGO_PKG_VERSION"));
/// Longest slate or notes, bytes.
const MAX_TEXT: usize = 16 * 1024;
/// Troubles of earlier takes that are remembered.
const MAX_TROUBLES: usize = 4;

/// The take that is being recorded, if one is, and what became of earlier ones.
#[derive(Default)]
pub(crate) struct Takes {
    /// One change at a time: held while a take starts or stops.
    changing: tokio::sync::Mutex<()>,
    current: Mutex<Option<Recording>>,
    troubles: Mutex<Vec<String>>,
}

struct Recording {
    name: String,
    slate: String,
    notes: String,
    started: String,
    start: Timestamp,
    sensors: Vec<String>,
    progress: Arc<Progress>,
    tap: RecorderTap,
    ended: oneshot::Receiver<TakeInfo>,
}

impl Takes {
    pub(crate) fn new(troubles: Vec<String>) -> Self {
        Self {
            troubles: Mutex::new(troubles),
            ..Self::default()
        }
    }

    fn current(&self) -> MutexGuard<'_, Option<Recording>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn is_recording(&self) -> bool {
        self.current().is_some()
    }

    /// Notes something in the take that is being recorded, if one is.
    pub(super) fn event(&self, event: Event) {
        if let Some(recording) = self.current().as_ref() {
            recording.tap.offer(Record::Event(event));
        }
    }

    /// What went wrong with takes, in words.
    pub(super) fn troubles(&self) -> Vec<String> {
        self.troubles
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    fn add_trouble(&self, trouble: String) {
        let mut troubles = self.troubles.lock().unwrap_or_else(PoisonError::into_inner);
        if troubles.len() == MAX_TROUBLES {
            troubles.remove(0);
        }
        troubles.push(trouble);
    }

    /// Looks whether the take has ended by itself (the disk was full).
    pub(super) fn notice_end(&self, civil_time: &str) {
        let mut current = self.current();
        let Some(recording) = current.as_mut() else {
            return;
        };
        let info = match recording.ended.try_recv() {
            Ok(info) => info,
            Err(oneshot::error::TryRecvError::Empty) => return,
            Err(oneshot::error::TryRecvError::Closed) => TakeInfo {
                trouble: "the recorder ended unexpectedly".to_owned(),
                ..TakeInfo::default()
            },
        };
        let name = recording.name.clone();
        *current = None;
        drop(current);
        tracing::error!(
            take = name,
            trouble = info.trouble,
            "the take ended by itself"
        );
        self.add_trouble(format!(
            "{civil_time}: take `{name}` ended by itself: {}",
            info.trouble
        ));
    }

    /// The running take's list entry.
    pub(super) fn recording(&self, now: Timestamp) -> Option<v1::Take> {
        let current = self.current();
        let recording = current.as_ref()?;
        let progress = &recording.progress;
        Some(v1::Take {
            name: recording.name.clone(),
            slate: recording.slate.clone(),
            notes: recording.notes.clone(),
            state: v1::TakeState::Recording.into(),
            started: recording.started.clone(),
            duration_ns: now.since_ns(recording.start),
            size_bytes: progress.bytes.load(Ordering::Relaxed),
            frames: progress.frames.load(Ordering::Relaxed),
            people: progress.people.load(Ordering::Relaxed) as u32,
            sensors: recording.sensors.clone(),
            dropped: progress.dropped.load(Ordering::Relaxed),
            trouble: String::new(),
        })
    }
}

impl Room {
    pub(super) async fn start_take(
        self: &Arc<Self>,
        request: v1::StartTakeRequest,
    ) -> Result<v1::Take, Status> {
        check_text("slate", &request.slate)?;
        check_text("notes", &request.notes)?;
        // On a task of its own: a client that goes away must not leave a take half begun.
        let room = self.clone();
        let started = self
            .tasks
            .spawn(async move { room.begin_take(request).await });
        started
            .await
            .map_err(|_| Status::internal("starting the take failed"))?
    }

    async fn begin_take(&self, request: v1::StartTakeRequest) -> Result<v1::Take, Status> {
        let _changing = self.takes.changing.lock().await;
        if let Some(recording) = self.takes.current().as_ref() {
            return Err(Status::failed_precondition(format!(
                "take `{}` is being recorded: stop it first",
                recording.name
            )));
        }
        if self.calibration.is_calibrating() {
            return Err(Status::failed_precondition(
                "a calibration runs: wait for its end, or cancel it",
            ));
        }
        if self.stop.is_cancelled() {
            return Err(Status::unavailable("the server is stopping"));
        }
        let started = self.clock.rfc3339();
        let wanted = match request.name.as_str() {
            "" => started
                .trim_end_matches('Z')
                .replace('T', "_")
                .replace(':', "-"),
            name => name.to_owned(),
        };
        check_take_name(&wanted).map_err(refused)?;
        let name = self
            .with_storage(move |storage| Catalogue::unused_name(&**storage, &wanted))
            .await?;
        let recording = self.start_recorder(&name, &request, started).await?;
        tracing::info!(take = name, "recording");
        *self.takes.current() = Some(recording);
        self.takes
            .recording(self.clock.now())
            .ok_or_else(|| Status::internal("the take ended at once"))
    }

    async fn start_recorder(
        &self,
        name: &str,
        request: &v1::StartTakeRequest,
        started: String,
    ) -> Result<Recording, Status> {
        let progress = Arc::new(Progress::default());
        let (tap, records) = RecorderTap::new(
            self.config.takes.queue,
            progress.clone(),
            self.counters.clone(),
        );
        let (reply, preamble) = oneshot::channel();
        self.commands
            .send(Command::Record(tap.clone(), reply))
            .await?;
        let preamble = preamble
            .await
            .map_err(|_| Status::unavailable("the server is stopping"))?;
        let start = preamble.start;
        let header = TakeHeader {
            name: name.to_owned(),
            slate: request.slate.clone(),
            notes: request.notes.clone(),
            started: started.clone(),
            start: Some(start),
            unix_offset_ns: self.clock.unix_offset_ns(),
            config_toml: toml::to_string(&self.config.fusion).unwrap_or_default(),
            calibration: self
                .calibration
                .current()
                .map(|calibration| (*calibration).clone()),
            build: BUILD.to_owned(),
        };
        let recorder = record::start(
            self.threads,
            self.clock.clone(),
            self.storage.clone(),
            &self.config.takes,
            Opening {
                header,
                preamble,
                records,
                progress: progress.clone(),
            },
        )
        .map_err(|error| Status::internal(error.to_string()))?;
        // If the file cannot be begun, the queue closes, and the fusion thread lets go of it by itself.
        recorder
            .ready
            .await
            .map_err(|_| Status::internal("the recorder ended unexpectedly"))?
            .map_err(refused)?;
        let sensors = self.registry.sensors();
        Ok(Recording {
            name: name.to_owned(),
            slate: request.slate.clone(),
            notes: request.notes.clone(),
            started,
            start,
            sensors: sensors
                .iter()
                .map(|sensor| sensor.name().to_owned())
                .collect(),
            progress,
            tap,
            ended: recorder.ended,
        })
    }

    pub(super) async fn stop_take(self: &Arc<Self>) -> Result<v1::Take, Status> {
        let room = self.clone();
        let stopped = self.tasks.spawn(async move { room.end_take().await });
        stopped
            .await
            .map_err(|_| Status::internal("stopping the take failed"))?
    }

    /// Ends the running take: what came before is in it, with index and footer.
    pub(crate) async fn end_take(&self) -> Result<v1::Take, Status> {
        let _changing = self.takes.changing.lock().await;
        let recording = self.takes.current().take();
        let Some(recording) = recording else {
            return Err(Status::failed_precondition("no take is being recorded"));
        };
        let (reply, let_go) = oneshot::channel();
        if self
            .commands
            .send(Command::StopRecording(reply))
            .await
            .is_ok()
        {
            let _ = let_go.await;
        }
        drop(recording.tap);
        let info = recording
            .ended
            .await
            .map_err(|_| Status::internal("the recorder ended unexpectedly"))?;
        tracing::info!(
            take = info.name,
            frames = info.frames,
            dropped = info.dropped,
            "recorded"
        );
        if !info.trouble.is_empty() {
            self.takes
                .add_trouble(format!("take `{}`: {}", info.name, info.trouble));
        }
        Ok(take_to_wire(&info))
    }

    /// Notes in the running take, if there is one, that it ends because the server does.
    pub(crate) fn note_stop(&self) {
        self.takes.event(Event {
            time_ns: self.clock.now().ns(),
            kind: "server-stopped".to_owned(),
            sensor: String::new(),
            text: "the server was stopped while this take was recorded".to_owned(),
        });
    }

    pub(super) async fn list_takes(&self) -> Result<Vec<v1::Take>, Status> {
        let takes = self
            .with_storage(|storage| Catalogue::list(&**storage))
            .await?;
        let running = self.takes.recording(self.clock.now());
        let entry = |info: &TakeInfo| match &running {
            Some(running) if running.name == info.name => running.clone(),
            _ => take_to_wire(info),
        };
        Ok(takes.iter().map(entry).collect())
    }

    pub(super) async fn update_take(
        &self,
        request: v1::UpdateTakeRequest,
    ) -> Result<v1::Take, Status> {
        let (slate, notes) = (request.slate, request.notes);
        check_text("slate", slate.as_deref().unwrap_or_default())?;
        check_text("notes", notes.as_deref().unwrap_or_default())?;
        let _changing = self.takes.changing.lock().await;
        let change = TakeChange { slate, notes };
        let info = self
            .with_storage(move |storage| Catalogue::update(storage, &request.name, &change))
            .await?;
        Ok(take_to_wire(&info))
    }

    /// Work on the take folder, away from the connections.
    pub(super) async fn with_storage<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Arc<dyn posefuse_session::Storage>) -> Result<T, TakeError> + Send + 'static,
    ) -> Result<T, Status> {
        let storage = self.storage.clone();
        let done = self.threads.blocking(move || work(&storage)).await;
        done.map_err(|error| Status::internal(error.to_string()))?
            .map_err(refused)
    }
}

fn check_text(field: &str, text: &str) -> Result<(), Status> {
    if text.len() <= MAX_TEXT {
        return Ok(());
    }
    Err(Status::invalid_argument(format!(
        "`{field}` has {} bytes, at most {MAX_TEXT} are taken",
        text.len()
    )))
}

/// A take's error as an answer to a client.
pub(super) fn refused(error: TakeError) -> Status {
    let text = error.to_string();
    match error {
        TakeError::Name(_) => Status::invalid_argument(text),
        TakeError::Exists(_) => Status::already_exists(text),
        TakeError::Missing(_) => Status::not_found(text),
        TakeError::DiskLow { .. } => Status::resource_exhausted(text),
        TakeError::Damaged { .. } | TakeError::Message { .. } => Status::data_loss(text),
        _ => Status::failed_precondition(text),
    }
}

/// A list entry as the wire says it.
pub(super) fn take_to_wire(info: &TakeInfo) -> v1::Take {
    let state = match info.state {
        TakeState::Recording => v1::TakeState::Recording,
        TakeState::Complete => v1::TakeState::Complete,
        TakeState::Recovered => v1::TakeState::Recovered,
        TakeState::Damaged => v1::TakeState::Damaged,
    };
    v1::Take {
        name: info.name.clone(),
        slate: info.slate.clone(),
        notes: info.notes.clone(),
        state: state.into(),
        started: info.started.clone(),
        duration_ns: info.duration_ns,
        size_bytes: info.size_bytes,
        frames: info.frames,
        people: info.people,
        sensors: info.sensors.clone(),
        dropped: info.dropped,
        trouble: info.trouble.clone(),
    }
}
