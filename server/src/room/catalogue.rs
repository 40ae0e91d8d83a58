//! The takes in the folder: listing them and changing what is noted with them.

use std::sync::Arc;

use posefuse_proto::v1;
use posefuse_session::{Catalogue, TakeChange, TakeError, TakeInfo, TakeState};
use tonic::Status;

use super::Room;

/// Longest slate or notes, bytes.
const MAX_TEXT: usize = 16 * 1024;

impl Room {
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
        let _rewriting = self.takes.rewriting.lock().await;
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

pub(super) fn check_text(field: &str, text: &str) -> Result<(), Status> {
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
        start_unix_ns: info.start_unix_ns,
        timecode: info.timecode.clone(),
        timecode_rate: info.timecode_rate.clone(),
    }
}
