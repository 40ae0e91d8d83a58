//! The library itself: found, started, asked for devices, ended.
#![allow(unsafe_code, reason = "calls OpenNI2's C functions")]

use std::ffi::{CStr, CString, c_int};
use std::path::{Path, PathBuf};
use std::ptr;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

use super::OpenNiError;
use super::api::{Api, Handle};
use super::c::{API_VERSION, OniDeviceInfo, OniStatus, STATUS_OK, text};
use super::events::{DeviceEvent, Listener};
use crate::find::{Found, find};

/// Names of the library, the likeliest first.
#[cfg(target_os = "windows")]
const NAMES: [&str; 1] = ["OpenNI2.dll"];
#[cfg(target_os = "macos")]
const NAMES: [&str; 1] = ["libOpenNI2.dylib"];
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const NAMES: [&str; 2] = ["libOpenNI2.so.0", "libOpenNI2.so"];

/// Variables that name the folder in which the library lies.
const FOLDERS: [&str; 2] = ["OPENNI2_REDIST64", "OPENNI2_REDIST"];

/// How many events wait for somebody to ask for them.
pub(super) const MOST_EVENTS: usize = 64;

/// OpenNI2 counts how often it was started, but gives no devices to who comes while it still starts.
static STARTING: Mutex<()> = Mutex::new(());

/// What OpenNI2 says of a device without opening it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Its address, e.g. `1d27/0601@1/5`. A USB device gets another one when it is plugged in again.
    pub uri: String,
    /// Who made it.
    pub vendor: String,
    /// What it is called, e.g. `PS1080`.
    pub name: String,
    /// USB ids of vendor and product; 0 where it is no USB device.
    pub usb: [u16; 2],
}

impl DeviceInfo {
    pub(super) fn from_c(info: &OniDeviceInfo) -> Self {
        Self {
            uri: text(&info.uri),
            vendor: text(&info.vendor),
            name: text(&info.name),
            usb: [info.usb_vendor_id, info.usb_product_id],
        }
    }
}

/// OpenNI2, started. It is ended when this and everything that was opened through it is dropped.
pub struct OpenNi {
    pub(super) api: Api,
    library: PathBuf,
    callbacks: Handle,
    /// Dropped after the callbacks are unregistered; the library holds its address.
    _listener: Box<Listener>,
    events: Mutex<mpsc::Receiver<DeviceEvent>>,
}

// SAFETY: OpenNI2 locks its own state, so its functions may be called from any thread; the handle of the callbacks is
// used once, when this is dropped.
unsafe impl Send for OpenNi {}
// SAFETY: as above; what is ours and not safe to share is behind the mutex.
unsafe impl Sync for OpenNi {}

impl OpenNi {
    /// Loads and starts OpenNI2. `place` is the library or the folder that it lies in; without one it is looked for in
    /// the folder that OPENNI2_REDIST names, then where the system keeps its libraries.
    ///
    /// Its drivers come from the folder `OpenNI2/Drivers` beside the library.
    pub fn load(place: Option<&Path>) -> Result<Arc<Self>, OpenNiError> {
        let Found { library, path } =
            find(place, &FOLDERS, &NAMES).map_err(|tried| OpenNiError::Missing { tried })?;
        let api = Api::of(library).map_err(|missing| OpenNiError::NotOpenNi {
            library: path.clone(),
            missing,
        })?;
        let starting = STARTING.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: a plain call; the interface's version is the one of our declarations.
        let status = unsafe { (api.initialize)(API_VERSION) };
        if status != STATUS_OK {
            let error = failed(&api, status, "start");
            // SAFETY: pairs with the call above, which counts also when it fails for want of drivers.
            unsafe { (api.shutdown)() };
            return Err(error);
        }
        drop(starting);
        let (sender, events) = mpsc::sync_channel(MOST_EVENTS);
        let mut listener = Listener::new(sender);
        let mut callbacks: Handle = ptr::null_mut();
        let (table, cookie) = listener.parts();
        // SAFETY: the listener is boxed and lives until the callbacks are unregistered in `drop`.
        let status = unsafe { (api.register_device_callbacks)(table, cookie, &mut callbacks) };
        let this = Self {
            api,
            library: path,
            callbacks,
            _listener: listener,
            events: Mutex::new(events),
        };
        this.check(status, || "watch for devices".into())?;
        Ok(Arc::new(this))
    }

    /// The library's file, or the name that the system found it by.
    pub fn library(&self) -> &Path {
        &self.library
    }

    /// E.g. `2.2.0.33`.
    pub fn version(&self) -> String {
        // SAFETY: a plain call.
        let version = unsafe { (self.api.version)() };
        format!(
            "{}.{}.{}.{}",
            version.major, version.minor, version.maintenance, version.build
        )
    }

    /// The devices that are there now.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>, OpenNiError> {
        let (mut list, mut count) = (ptr::null_mut::<OniDeviceInfo>(), 0 as c_int);
        // SAFETY: both point to variables of the types that the function fills.
        let status = unsafe { (self.api.device_list)(&mut list, &mut count) };
        self.check(status, || "list the devices".into())?;
        let count = usize::try_from(count).unwrap_or(0);
        let mut devices = Vec::with_capacity(count);
        for index in 0..if list.is_null() { 0 } else { count } {
            // SAFETY: the library gave an array of `count` entries, which stays until it is released below.
            devices.push(DeviceInfo::from_c(unsafe { &*list.add(index) }));
        }
        if !list.is_null() {
            // SAFETY: given by `device_list`, released once.
            unsafe { (self.api.release_device_list)(list) };
        }
        Ok(devices)
    }

    /// The next thing that happened to a device since this was loaded; `None`: nothing within `timeout`.
    ///
    /// Each event is given once, to whoever asks first. 64 wait; while nobody asks, what happens after them is dropped.
    /// A device that was pulled out is then still told by its calls, and what is there by [`devices`](Self::devices).
    pub fn next_event(&self, timeout: Duration) -> Option<DeviceEvent> {
        let events = self.events.lock().ok()?;
        events.recv_timeout(timeout).ok()
    }

    /// `Ok` when the status is; else the error with the library's own words.
    pub(super) fn check(
        &self,
        status: OniStatus,
        doing: impl FnOnce() -> String,
    ) -> Result<(), OpenNiError> {
        match status {
            STATUS_OK => Ok(()),
            status => Err(failed(&self.api, status, &doing())),
        }
    }
}

impl Drop for OpenNi {
    fn drop(&mut self) {
        let _starting = STARTING.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: registered in `load` and not unregistered before; nothing that was opened is left, for it would
        // hold this.
        unsafe {
            if !self.callbacks.is_null() {
                (self.api.unregister_device_callbacks)(self.callbacks);
            }
            (self.api.shutdown)();
        }
    }
}

impl std::fmt::Debug for OpenNi {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OpenNi")
            .field("library", &self.library)
            .finish_non_exhaustive()
    }
}

/// The error of a call that failed, with the library's own words.
pub(super) fn failed(api: &Api, status: OniStatus, doing: &str) -> OpenNiError {
    // SAFETY: gives a text that ends with zero, or null; it is copied at once.
    let text = unsafe {
        let text = (api.extended_error)();
        match text.is_null() {
            true => String::new(),
            false => CStr::from_ptr(text).to_string_lossy().into_owned(),
        }
    };
    OpenNiError::Call {
        doing: doing.to_owned(),
        status,
        text,
    }
}

/// A text for C.
pub(super) fn c_text(text: &str) -> Result<CString, OpenNiError> {
    CString::new(text).map_err(|_| OpenNiError::ZeroByte(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_the_library_it_is_said_what_to_install() {
        let nowhere = tempfile::tempdir().unwrap();
        let error = OpenNi::load(Some(nowhere.path())).unwrap_err();
        assert!(matches!(&error, OpenNiError::Missing { tried } if tried.len() == NAMES.len()));
        let words = error.to_string();
        assert!(
            words.contains("apt install libopenni2-0") && words.contains("OPENNI2_REDIST"),
            "{words}"
        );
        let file = nowhere.path().join("libOpenNI2.so.0");
        std::fs::write(&file, "this is no library").unwrap();
        let error = OpenNi::load(Some(&file)).unwrap_err().to_string();
        assert!(error.contains(&file.display().to_string()), "{error}");
    }
}
