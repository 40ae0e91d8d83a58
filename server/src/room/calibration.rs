//! The calibration in force, and its file: read at the start, written in one step, earlier ones kept with their time.

use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use posefuse_calibration::{from_toml, to_toml};
use posefuse_fusion::{ConfigError, Input};
use posefuse_session::{Storage, check_take_name};
use posefuse_skeleton::Calibration;
use serde::{Deserialize, Serialize};
use tonic::Status;

use super::Room;

/// What to do without a calibration.
pub(super) const REMEDY: &str =
    "run `posefuse calibrate`, or press Calibrate on the dashboard, and walk about for 30 s";
/// Largest calibration file that is read, bytes.
const MAX_FILE: u64 = 1 << 20;

/// Where the calibration is kept. Section `[calibration]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The file; earlier ones are kept beside it with their time in the name.
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
pub(super) struct Calibrating(Arc<Room>);

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
    pub(crate) fn load(storage: Arc<dyn Storage>, config: &Config) -> Self {
        let file = config.file_name();
        let (current, trouble) = match read(&*storage, &file) {
            Ok(calibration) => (calibration.map(Arc::new), None),
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
    pub(super) async fn begin_calibrating(self: &Arc<Self>) -> Result<Calibrating, Status> {
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
    pub(super) async fn put_in_force(
        self: &Arc<Self>,
        calibration: Calibration,
    ) -> Result<(), Status> {
        // On a task of its own: a client that goes away must not leave file, engine and server with different ones.
        let room = self.clone();
        let change = async move { room.change_calibration(calibration).await };
        self.tasks
            .spawn(change)
            .await
            .map_err(|_| Status::internal("changing the calibration failed"))?
    }

    async fn change_calibration(&self, calibration: Calibration) -> Result<(), Status> {
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
        let (text, stamp) = (
            to_toml(&calibration),
            self.clock.rfc3339().replace(':', "-"),
        );
        let written = self
            .threads
            .blocking(move || write(&*storage, &file, &text, &stamp))
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

fn read_bytes(storage: &dyn Storage, file: &str) -> io::Result<Option<Vec<u8>>> {
    let file = match storage.open(file) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let length = file.length()?;
    if length > MAX_FILE {
        return Err(io::Error::other(format!(
            "it has {length} bytes, far too many for a calibration"
        )));
    }
    let mut bytes = vec![0; length as usize];
    file.read_at(0, &mut bytes)?;
    Ok(Some(bytes))
}

fn read(storage: &dyn Storage, file: &str) -> Result<Option<Calibration>, String> {
    let Some(bytes) = read_bytes(storage, file).map_err(|error| error.to_string())? else {
        return Ok(None);
    };
    let text = String::from_utf8(bytes).map_err(|_| "it is not text".to_owned())?;
    from_toml(&text)
        .map(Some)
        .map_err(|error| error.to_string())
}

/// Writes the file in one step; what it held before goes into a file with `stamp` in its name.
fn write(storage: &dyn Storage, file: &str, text: &str, stamp: &str) -> io::Result<()> {
    if let Some(old) = read_bytes(storage, file)?
        && old != text.as_bytes()
    {
        let stem = file.strip_suffix(".toml").unwrap_or(file);
        put(storage, &format!("{stem}.until-{stamp}.toml"), &old)?;
    }
    put(storage, file, text.as_bytes())?;
    storage.sync()
}

/// Writes `bytes` beside `file`, then renames, so that a crash leaves the old or the new one.
fn put(storage: &dyn Storage, file: &str, bytes: &[u8]) -> io::Result<()> {
    let beside = format!("{file}.new");
    match storage.remove(&beside) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let mut new = storage.create(&beside)?;
    new.append(bytes)?;
    new.sync()?;
    drop(new);
    storage.rename(&beside, file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use posefuse_session::MemoryStorage;

    #[test]
    fn the_old_file_is_kept_and_a_bad_one_is_named() {
        let storage = MemoryStorage::new();
        write(&storage, "calibration.toml", "one", "t1").unwrap();
        write(&storage, "calibration.toml", "two", "t2").unwrap();
        assert_eq!(storage.read("calibration.toml").unwrap(), b"two");
        assert_eq!(storage.read("calibration.until-t2.toml").unwrap(), b"one");
        assert_eq!(storage.list().unwrap().len(), 2);

        let store = CalibrationStore::load(Arc::new(storage), &Config::default());
        assert!(store.current().is_none());
        let trouble = store.trouble().unwrap();
        assert!(
            trouble.contains("calibration.toml") && trouble.contains("not used"),
            "{trouble}"
        );
    }
}
