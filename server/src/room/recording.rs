//! Starting and stopping a take.

use std::sync::Arc;

use posefuse_fusion::Input;
use posefuse_proto::v1;
use posefuse_session::{Catalogue, Event, TakeHeader, check_take_name};
use posefuse_skeleton::Calibration;
use tokio::sync::oneshot;
use tonic::Status;

use super::Room;
use super::catalogue::{check_text, refused, take_to_wire};
use super::takes::Recording;
use super::watchman::note_changes;
use crate::fusion_thread::Command;
use crate::record::{self, Opening, Preamble, Progress, RecorderTap};

/// What takes are stamped with: only the same build goes on from the engine's state in a take.
pub const BUILD: &str = posefuse_fusion::BUILD;

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
        let _changing = self.changing.lock().await;
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
            "" => self.clock.local_name(),
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
        let unix_offset_ns = self.clock.unix_offset_ns();
        let start_unix_ns = start.ns().saturating_add(unix_offset_ns);
        let header = TakeHeader {
            name: name.to_owned(),
            slate: request.slate.clone(),
            notes: request.notes.clone(),
            started: started.clone(),
            start: Some(start),
            unix_offset_ns,
            timecode: Some(self.config.timecode.at(start_unix_ns)),
            config_toml: toml::to_string(&self.config.fusion).unwrap_or_default(),
            calibration: calibration_of(&preamble),
            build: BUILD.to_owned(),
        };
        let timecode = header.timecode(start);
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
            start_unix_ns,
            timecode,
            sensors: sensors
                .iter()
                .filter(|sensor| sensor.is_connected())
                .map(|sensor| sensor.name().to_owned())
                .collect(),
            progress,
            tap,
            ended: recorder.ended,
        })
    }

    pub(super) async fn stop_take(self: &Arc<Self>) -> Result<v1::Take, Status> {
        let room = self.clone();
        let stopped = self.tasks.spawn(async move {
            // What happened since the watchman last looked belongs into the take.
            note_changes(&room);
            room.end_take().await
        });
        stopped
            .await
            .map_err(|_| Status::internal("stopping the take failed"))?
    }

    /// Ends the running take: what came before is in it, with index and footer.
    pub(crate) async fn end_take(&self) -> Result<v1::Take, Status> {
        let _changing = self.changing.lock().await;
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
            text: "the server was stopped while this take was recorded".to_owned(),
            ..Event::default()
        });
    }
}

/// The calibration a take begins under: the one that the engine itself names, so that the two cannot differ.
fn calibration_of(preamble: &Preamble) -> Option<Calibration> {
    preamble.inputs.iter().find_map(|input| match input {
        Input::Calibration(calibration) => Some((**calibration).clone()),
        _ => None,
    })
}
