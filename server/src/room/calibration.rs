//! The calibration in force, and its file: read at the start, written in one step, each kept with its time (`history`).

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use posefuse_calibration::to_toml;
use posefuse_fusion::{ConfigError, Input};
use posefuse_session::{Storage, check_take_name};
use posefuse_skeleton::Calibration;
use serde::{Deserialize, Serialize};
use tonic::Status;

use super::{Room, history};

/// What to do without a calibration.
pub(crate) const REMEDY: &str = "run `posefuse calibrate`, or press Calibrate on the dashboard, and walk about until it has seen enough";

/// Where the calibration is kept. Section `[calibration]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The file; a copy of each calibration that was ever put in force is kept beside it, with its time in the name.
    pub file: PathBuf,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            file: "calibration.toml".into(),
        }
    }
}

impl Config {
    /// The file's name without its folder.
    pub(crate) fn file_name(&self) -> String {
        let name = self.file.file_name().and_then(|name| name.to_str());
        name.unwrap_or_default().to_owned()
    }

    /// Checks that the file's name can be one: its folder is reached through a [`Storage`], which takes plain names.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let name = self.file_name();
        check_take_name(&name).map_err(|_| ConfigError::Value {
            key: "calibration.file".to_owned(),
            expected: format!(
                "a path whose last part is made of a-z A-Z 0-9 . _ -, found {}",
                self.file.display()
            ),
        })
    }
}

/// The calibration in force and whether another is being made.
pub(crate) struct CalibrationStore {
    storage: Arc<dyn Storage>,
    file: String,
    current: Mutex<Option<Arc<Calibration>>>,
    trouble: Mutex<Option<String>>,
    calibrating: AtomicBool,
}

/// Holds the right to calibrate.
pub(crate) struct Calibrating(Arc<Room>);

impl Drop for Calibrating {
    fn drop(&mut self) {
        self.0
            .calibration
            .calibrating
            .store(false, Ordering::Release);
    }
}

impl CalibrationStore {
    /// Reads the file. One that cannot be used is a trouble to show, not a reason not to start.
    /// `now` is the civil time, RFC 3339.
    pub(crate) fn load(storage: Arc<dyn Storage>, config: &Config, now: &str) -> Self {
        let file = config.file_name();
        let (current, trouble) = match history::read(&*storage, &file) {
            Ok(calibration) => {
                if let Err(error) = history::adopt(&*storage, &file, now) {
                    tracing::warn!("no copy of the calibration can be kept: {error}");
                }
                (calibration.map(Arc::new), None)
            }
            Err(problem) => {
                let trouble = format!(
                    "the calibration file {file} in {} is not used: {problem}",
                    storage.place()
                );
                tracing::error!("{trouble}");
                (None, Some(trouble))
            }
        };
        Self {
            storage,
            file,
            current: Mutex::new(current),
            trouble: Mutex::new(trouble),
            calibrating: AtomicBool::new(false),
        }
    }

    pub(crate) fn current(&self) -> Option<Arc<Calibration>> {
        self.current
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// The folder, and the file's name in it.
    pub(super) fn place(&self) -> (Arc<dyn Storage>, String) {
        (self.storage.clone(), self.file.clone())
    }

    pub(super) fn trouble(&self) -> Option<String> {
        self.trouble
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    pub(super) fn is_calibrating(&self) -> bool {
        self.calibrating.load(Ordering::Acquire)
    }

    fn set(&self, calibration: Arc<Calibration>) {
        *self.current.lock().unwrap_or_else(PoisonError::into_inner) = Some(calibration);
        *self.trouble.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

impl Room {
    /// Takes the right to calibrate; there is one.
    pub(crate) async fn begin_calibrating(self: &Arc<Self>) -> Result<Calibrating, Status> {
        let _changing = self.changing.lock().await;
        if self.takes.is_recording() {
            return Err(Status::failed_precondition(
                "a take is being recorded: stop it before you calibrate",
            ));
        }
        if self.calibration.calibrating.swap(true, Ordering::AcqRel) {
            return Err(Status::failed_precondition("a calibration runs already"));
        }
        Ok(Calibrating(self.clone()))
    }

    /// Writes a calibration to its file and puts it in force. Refused while a take runs.
    pub(crate) async fn put_in_force(
        self: &Arc<Self>,
        calibration: Calibration,
    ) -> Result<(), Status> {
        let text = to_toml(&calibration);
        self.put_text_in_force(calibration, text).await
    }

    /// The same with the text for the file, which must be that of `calibration`.
    pub(super) async fn put_text_in_force(
        self: &Arc<Self>,
        calibration: Calibration,
        text: String,
    ) -> Result<(), Status> {
        // On a task of its own: a client that goes away must not leave file, engine and server with different ones.
        let room = self.clone();
        let change = async move { room.change_calibration(calibration, text).await };
        self.tasks
            .spawn(change)
            .await
            .map_err(|_| Status::internal("changing the calibration failed"))?
    }

    async fn change_calibration(
        &self,
        calibration: Calibration,
        text: String,
    ) -> Result<(), Status> {
        let _changing = self.changing.lock().await;
        if self.stop.is_cancelled() {
            return Err(Status::unavailable("the server is stopping"));
        }
        if self.takes.is_recording() {
            return Err(Status::failed_precondition(
                "a take is being recorded: stop it before you change the calibration",
            ));
        }
        let (store, calibration) = (&self.calibration, Arc::new(calibration));
        let (storage, file) = (store.storage.clone(), store.file.clone());
        let now = self.clock.rfc3339();
        let written = self
            .threads
            .blocking(move || history::write(&*storage, &file, &text, &now))
            .await;
        written
            .map_err(|error| Status::internal(error.to_string()))?
            .map_err(|error| {
                Status::failed_precondition(format!(
                    "the calibration cannot be written to {} in {}: {error}; it is not in force",
                    store.file,
                    store.storage.place()
                ))
            })?;
        self.inputs
            .send(Input::Calibration(calibration.clone()))
            .await?;
        store.set(calibration);
        tracing::info!("a new calibration is in force");
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use posefuse_session::MemoryStorage;

    #[test]
    fn a_bad_file_is_named_and_a_good_one_kept() {
        let bad = ("calibration.toml".to_owned(), b"two".to_vec());
        let storage = MemoryStorage::holding([bad]);
        let now = "2026-01-01T00:00:00Z";
        let store = CalibrationStore::load(Arc::new(storage.clone()), &Config::default(), now);
        assert!(store.current().is_none());
        let trouble = store.trouble().unwrap();
        assert!(
            trouble.contains("calibration.toml") && trouble.contains("not used"),
            "{trouble}"
        );
        assert_eq!(storage.list().unwrap().len(), 1);
    }
}
