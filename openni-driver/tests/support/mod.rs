//! The real OpenNI2 with the driver that was just built, in a folder of its own.
#![allow(
    clippy::unwrap_used,
    dead_code,
    reason = "a test's helpers may fail the test, and each test uses its share"
)]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

use posefuse_devices::openni::OpenNi;

/// The file of the library as Debian names it.
const LIBRARY: &str = "libOpenNI2.so.0";

/// OpenNI2 and virtual sensors.
pub(crate) struct Room {
    folder: tempfile::TempDir,
    /// What else the control file says.
    rest: &'static str,
    plugged: Mutex<Vec<usize>>,
}

static ROOM: OnceLock<Option<Room>> = OnceLock::new();

/// The room of this process, with `sensors` virtual sensors; `None`, said plainly: OpenNI2 is not installed.
pub(crate) fn room(sensors: usize, rest: &'static str) -> Option<&'static Room> {
    let room = ROOM.get_or_init(|| {
        let Some(library) = installed() else {
            eprintln!("SKIPPED: no {LIBRARY} on this computer (Debian: apt install libopenni2-0)");
            return None;
        };
        let room = Room::new(&library, sensors, rest);
        // SAFETY: the driver's threads, which read the variable, do not run before this.
        #[allow(unsafe_code, reason = "the driver learns the file's name no other way")]
        unsafe {
            std::env::set_var("POSEFUSE_VIRTUAL", room.control());
        }
        Some(room)
    });
    room.as_ref()
}

fn installed() -> Option<PathBuf> {
    let roots = ["/usr/lib", "/usr/lib64", "/usr/local/lib"];
    let within = |root: &&str| fs::read_dir(root).into_iter().flatten().flatten();
    let folders = roots.iter().flat_map(|root| {
        let inner = within(root).map(|entry| entry.path());
        std::iter::once(PathBuf::from(root)).chain(inner)
    });
    let mut files = folders.map(|folder| folder.join(LIBRARY));
    files.find(|file| file.exists())
}

/// The driver, beside the test's own program.
fn driver() -> PathBuf {
    let program = std::env::current_exe().unwrap();
    let folders = program.ancestors().skip(1).take(2);
    let mut files = folders.map(|folder| folder.join("libPosefuseVirtual.so"));
    files
        .find(|file| file.exists())
        .expect("cargo builds the driver before its tests")
}

impl Room {
    fn new(library: &Path, sensors: usize, rest: &'static str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let drivers = folder.path().join("OpenNI2/Drivers");
        fs::create_dir_all(&drivers).unwrap();
        symlink(library, folder.path().join(LIBRARY)).unwrap();
        symlink(driver(), drivers.join("libPosefuseVirtual.so.0")).unwrap();
        let theirs = library
            .parent()
            .unwrap()
            .join("OpenNI2/Drivers/libOniFile.so.0");
        symlink(theirs, drivers.join("libOniFile.so.0")).unwrap();
        let room = Self {
            folder,
            rest,
            plugged: Mutex::new((0..sensors).collect()),
        };
        room.write(&room.plugged.lock().unwrap());
        room
    }

    /// The folder that OPENNI2_REDIST would name.
    pub(crate) fn library(&self) -> &Path {
        self.folder.path()
    }

    fn control(&self) -> PathBuf {
        self.folder.path().join("virtual.toml")
    }

    /// OpenNI2, started.
    pub(crate) fn openni(&self) -> Arc<OpenNi> {
        OpenNi::load(Some(self.library())).unwrap()
    }

    /// Plugs a sensor in or pulls it out.
    pub(crate) fn plug(&self, sensor: usize, inside: bool) {
        let mut plugged = self.plugged.lock().unwrap();
        plugged.retain(|&other| other != sensor);
        if inside {
            plugged.push(sensor);
        }
        self.write(&plugged);
    }

    fn write(&self, plugged: &MutexGuard<'_, Vec<usize>>) {
        let text = format!("plugged = {:?}\n{}", **plugged, self.rest);
        // In one step, so that no half of it is read.
        let new = self.folder.path().join("virtual.new");
        fs::write(&new, text).unwrap();
        fs::rename(new, self.control()).unwrap();
    }
}
