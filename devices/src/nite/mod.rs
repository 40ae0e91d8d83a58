//! NiTE 2.2, PrimeSense's body tracker on top of OpenNI2: 15 joints of the joint set `nite`.
//!
//! NiTE's axes are those of OpenNI2's world: x right and y up as its image shows them, z forward, millimetres. Its image is
//! mirrored unless somebody changed that (PrimeSense's driver mirrors by default), so that x points to the sensor's
//! left; [`Options::mirrored`] says which it is. What leaves here is optical: x right, y down, z forward, metres.
//!
//! Not verified with NiTE itself, which is no longer given out.
#![allow(unsafe_code, reason = "calls NiTE's C functions")]

mod c;
mod error;
mod ready;

use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::ptr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use posefuse_skeleton::{Confidence, Position, RawJoint};

use self::c::{
    Api, JOINTS, SKELETON_NONE, SKELETON_TRACKED, Tracker, USER_LOST, USER_NEW, USER_VISIBLE,
};
use self::ready::Ready;
use crate::find;
use crate::openni::OpenNi;

pub use error::{HOW_TO_INSTALL, NiteError};

/// Names of the library.
#[cfg(target_os = "windows")]
const NAMES: [&str; 1] = ["NiTE2.dll"];
#[cfg(target_os = "macos")]
const NAMES: [&str; 1] = ["libNiTE2.dylib"];
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const NAMES: [&str; 1] = ["libNiTE2.so"];

/// Variables that name the folder in which the library lies; NiTE's installer sets them.
const FOLDERS: [&str; 2] = ["NITE2_REDIST64", "NITE2_REDIST"];

/// How people are tracked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The library or its folder; absent: NITE2_REDIST64, NITE2_REDIST, then where the system keeps libraries.
    pub library: Option<PathBuf>,
    /// A device's URI or serial number, by OpenNI2; absent: the first.
    pub device: Option<String>,
    /// Whether NiTE's image is mirrored.
    pub mirrored: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            library: None,
            device: None,
            mirrored: true,
        }
    }
}

/// One person.
#[derive(Clone, Debug, PartialEq)]
pub struct NiteUser {
    /// NiTE's number.
    pub id: u64,
    /// In the order of the joint set `nite`, optical axes; a joint of confidence 0 is missing.
    pub joints: [Option<RawJoint>; JOINTS],
}

/// Everybody whose skeleton is tracked, at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct NiteFrame {
    /// The device's clock.
    pub timestamp_us: u64,
    /// Counts up by one a frame.
    pub index: i32,
    /// Who.
    pub users: Vec<NiteUser>,
}

/// In place of OpenNI2's C++ object for a device, which NiTE wants: a pointer to playback control, the C handle, then what
/// is known of the device. As large as OpenNI2's and larger. NiTE may keep its address.
type StandIn = [*mut c_void; 256];

/// NiTE's user tracker on one device.
pub struct NiteTracker {
    api: Api,
    handle: Tracker,
    mirrored: bool,
    version: String,
    library: PathBuf,
    /// Told by NiTE of each frame. This and what follows is dropped after the tracker is shut down.
    ready: Box<Ready>,
    _stand_in: Option<Box<StandIn>>,
    _device: Option<crate::openni::Device>,
    _openni: Option<Arc<OpenNi>>,
}

// SAFETY: used by one thread at a time, for reading takes it mutably; NiTE's handles are bound to no thread.
unsafe impl Send for NiteTracker {}

impl NiteTracker {
    /// Loads NiTE and starts it on a device.
    pub fn open(options: &Options) -> Result<Self, NiteError> {
        // NiTE needs OpenNI2: loaded before, it is found however it was installed.
        let openni = OpenNi::load(None);
        let found = find::find(options.library.as_deref(), &FOLDERS, &NAMES)
            .map_err(|tried| NiteError::Missing { tried })?;
        let not_nite = |reason: String| NiteError::NotNite {
            library: found.path.clone(),
            reason,
        };
        let api = Api::of(found.library)
            .map_err(|missing| not_nite(format!("it has no function {missing}")))?;
        // SAFETY: a plain call.
        let version = unsafe { (api.version)() };
        let shown = format!(
            "{}.{}.{}.{}",
            version.major, version.minor, version.maintenance, version.build
        );
        // Before 2.2 a user was a shorter structure.
        if (version.major, version.minor) != (2, 2) {
            return Err(not_nite(format!("it is version {shown}")));
        }
        let device = match &options.device {
            None => None,
            Some(wanted) => {
                let openni = openni
                    .as_ref()
                    .map_err(|error| NiteError::Device(error.to_string()))?;
                let opened = openni.open(Some(wanted));
                Some(opened.map_err(|error| NiteError::Device(error.to_string()))?)
            }
        };
        let mut handle: Tracker = ptr::null_mut();
        let stand_in = in_folder_of(&found.path, || start(&api, device.as_ref(), &mut handle))?;
        // SAFETY: the tracker was just made. NiTE's own smoothing only delays what the room smooths better; a NiTE that
        // does not let it be turned off tracks all the same.
        unsafe { (api.set_smoothing)(handle, 0.0) };
        let mut this = Self {
            api,
            handle,
            mirrored: options.mirrored,
            version: shown,
            library: found.path,
            ready: Ready::new(),
            _stand_in: stand_in,
            _device: device,
            _openni: openni.ok(),
        };
        let (callbacks, cookie) = this.ready.parts();
        // SAFETY: both addresses are within the box, which lives until they are unregistered in `drop`.
        let status = unsafe { (this.api.register)(handle, callbacks, cookie) };
        check(
            status,
            "tell of its frames",
            "is it a NiTE 2.2 of PrimeSense's?",
        )?;
        Ok(this)
    }

    /// E.g. `2.2.0.11`.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// The library's file, or the name that the system found it by.
    pub fn library(&self) -> &Path {
        &self.library
    }

    /// The next frame, as [`read`](Self::read) has it, or `None` where NiTE told of none within `timeout`.
    pub fn read_within(&mut self, timeout: Duration) -> Result<Option<NiteFrame>, NiteError> {
        match self.ready.wait(timeout) {
            true => self.read().map(Some),
            false => Ok(None),
        }
    }

    /// Waits for the next frame, for ever where the device gives none. Whoever is in view begins to be tracked.
    pub fn read(&mut self) -> Result<NiteFrame, NiteError> {
        // Before the frame is taken: NiTE may tell of the one after it at any time.
        self.ready.clear();
        let mut frame: *mut c::Frame = ptr::null_mut();
        // SAFETY: the tracker lives as long as `self`; the frame is released below.
        let status = unsafe { (self.api.read)(self.handle, &mut frame) };
        if status != 0 || frame.is_null() {
            return Err(NiteError::Call {
                doing: "give a frame",
                status,
                advice: "has the sensor been pulled out?",
            });
        }
        // SAFETY: NiTE gave the frame, which stays until it is released.
        let seen = unsafe { &*frame };
        let count = usize::try_from(seen.user_count).unwrap_or(0);
        let mut users = Vec::new();
        for index in 0..if seen.users.is_null() { 0 } else { count } {
            // SAFETY: the array has `count` entries and stays as long as the frame.
            let user = unsafe { &*seen.users.add(index) };
            let seen = user.state & (USER_VISIBLE | USER_NEW) != 0 && user.state & USER_LOST == 0;
            if seen && user.skeleton == SKELETON_NONE {
                // SAFETY: the tracker lives; the id is one of its own. After a refusal the next frame asks again.
                unsafe { (self.api.start_skeleton)(self.handle, user.id) };
            }
            let tracked = user.skeleton == SKELETON_TRACKED;
            if tracked && user.state & USER_VISIBLE != 0 && user.state & USER_LOST == 0 {
                users.push(self.user(user));
            }
        }
        let frame_of = NiteFrame {
            timestamp_us: seen.timestamp,
            index: seen.index,
            users,
        };
        // SAFETY: given by `read`, released once, not used any more.
        unsafe { (self.api.release)(self.handle, frame) };
        Ok(frame_of)
    }

    fn user(&self, user: &c::User) -> NiteUser {
        let joint = |joint: &c::Joint| {
            let [x, y, z] = joint.position.map(|mm| f64::from(mm) / 1000.0);
            let confidence = Confidence::saturating(joint.confidence);
            let x = if self.mirrored { -x } else { x };
            (confidence != Confidence::NONE).then(|| RawJoint {
                position: Position::new(x, -y, z),
                confidence,
            })
        };
        NiteUser {
            id: u64::from(user.id.unsigned_abs()),
            joints: std::array::from_fn(|index| joint(&user.joints[index])),
        }
    }
}

impl Drop for NiteTracker {
    fn drop(&mut self) {
        let (callbacks, _) = self.ready.parts();
        // SAFETY: made in `open`, not used after this; pairs with `initialize`.
        unsafe {
            (self.api.unregister)(self.handle, callbacks);
            (self.api.destroy)(self.handle);
            (self.api.shutdown)();
        }
    }
}

fn start(
    api: &Api,
    device: Option<&crate::openni::Device>,
    handle: &mut Tracker,
) -> Result<Option<Box<StandIn>>, NiteError> {
    // SAFETY: a plain call.
    let status = unsafe { (api.initialize)() };
    check(
        status,
        "start",
        "its data, the folder NiTE2, must lie beside the library",
    )?;
    let mut stand_in = device.map(|device| {
        let mut object: Box<StandIn> = Box::new([ptr::null_mut(); 256]);
        object[1] = device.handle();
        object
    });
    let status = match &mut stand_in {
        // SAFETY: the handle is filled in.
        None => unsafe { (api.create)(handle) },
        // SAFETY: the object is large enough, and lives as long as the tracker.
        Some(object) => unsafe { (api.create_by_device)(object.as_mut_ptr().cast(), handle) },
    };
    let made = check(
        status,
        "track people",
        "is the sensor plugged in, free, and one of those NiTE was made for (PrimeSense, Xtion, Kinect v1)?",
    );
    if made.is_err() {
        // SAFETY: pairs with `initialize`.
        unsafe { (api.shutdown)() };
    }
    made.map(|()| stand_in)
}

fn check(status: i32, doing: &'static str, advice: &'static str) -> Result<(), NiteError> {
    match status {
        0 => Ok(()),
        status => Err(NiteError::Call {
            doing,
            status,
            advice,
        }),
    }
}

/// Runs `start` in the library's folder, if its data lie there: NiTE looks for `NiTE2/s.dat` in the current folder.
fn in_folder_of<T>(library: &Path, start: impl FnOnce() -> T) -> T {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = library
        .parent()
        .filter(|folder| folder.join("NiTE2").is_dir());
    let back = std::env::current_dir();
    let moved = folder.is_some_and(|folder| std::env::set_current_dir(folder).is_ok());
    let result = start();
    if let (true, Ok(back)) = (moved, back) {
        let _ = std::env::set_current_dir(back);
    }
    result
}
