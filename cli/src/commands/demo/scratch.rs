//! The demo's temporary folder. It is locked as long as the demo lives, so that the next one can tell what a killed
//! demo has left behind, and removes it.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use tempfile::TempDir;

const PREFIX: &str = "posefuse-demo-";
const LOCK: &str = "lock";

/// A folder that goes with the demo.
pub(super) struct Scratch {
    folder: TempDir,
    /// Held open: the lock ends with the process, however it ends.
    _lock: File,
}

impl Scratch {
    /// A fresh folder in `parent`, out of which what dead demos have left is removed first.
    pub(super) fn in_folder(parent: &Path) -> io::Result<Self> {
        remove_stale(parent);
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
        // Locked before it has the name that others look for.
        let unnamed = folder.path().join("lock.new");
        let lock = File::create(&unnamed)?;
        lock.lock()?;
        fs::rename(unnamed, folder.path().join(LOCK))?;
        Ok(Self {
            folder,
            _lock: lock,
        })
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Whoever cannot remove a folder (another user's) leaves it.
fn remove_stale(parent: &Path) {
    let entries = fs::read_dir(parent).into_iter().flatten().flatten();
    for entry in entries {
        let ours = entry.file_name().to_string_lossy().starts_with(PREFIX);
        let lock = File::open(entry.path().join(LOCK));
        if ours && lock.is_ok_and(|lock| lock.try_lock().is_ok()) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_demo_left_goes_and_what_a_running_one_has_stays() {
        let parent = tempfile::tempdir().unwrap();
        let running = Scratch::in_folder(parent.path()).unwrap();
        let killed = Scratch::in_folder(parent.path()).unwrap();
        fs::write(killed.path().join("calibration.toml"), "x").unwrap();
        let left = killed.folder.keep();
        drop(killed._lock);
        let foreign = parent.path().join("posefuse-demo-of-somebody");
        fs::create_dir(&foreign).unwrap();

        let next = Scratch::in_folder(parent.path()).unwrap();
        assert!(!left.exists());
        assert!(running.path().exists() && next.path().exists() && foreign.exists());
    }
}
