//! One device, open: a sensor, or a recording that takes its place.
#![allow(unsafe_code, reason = "calls OpenNI2's C functions")]

use std::ffi::{c_int, c_void};
use std::path::Path;
use std::ptr;
use std::sync::Arc;

use super::api::Handle;
use super::c::{
    DEVICE_IMAGE_REGISTRATION, DEVICE_PLAYBACK_REPEAT, DEVICE_PLAYBACK_SPEED, DEVICE_SERIAL_NUMBER,
    IMAGE_REGISTRATION_DEPTH_TO_COLOR, IMAGE_REGISTRATION_OFF, OniDeviceInfo, SENSOR_DEPTH,
    STATUS_OK,
};
use super::library::c_text;
use super::{DeviceInfo, Mode, OpenNi, OpenNiError};

/// An open device. It is closed when this and its streams are dropped.
#[derive(Clone)]
pub struct Device {
    open: Arc<Open>,
}

/// Closes the device when the last one who uses it is gone.
pub(super) struct Open {
    pub(super) openni: Arc<OpenNi>,
    pub(super) handle: Handle,
    info: DeviceInfo,
}

// SAFETY: OpenNI2 locks its own state; a handle may be used from any thread.
unsafe impl Send for Open {}
// SAFETY: as above; the handle is never changed.
unsafe impl Sync for Open {}

/// How a recording is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Playback {
    /// Each frame when it is asked for: none is lost, however slow or fast the reader is.
    OnDemand,
    /// By the recording's own times, so many times faster. Frames that come while nobody waits are lost.
    Paced(f32),
}

impl OpenNi {
    /// Opens a device by its URI or its serial number, or a recording by its file; `None`: the first device there is.
    ///
    /// To look for a serial number, every device that can be opened is opened for a moment.
    pub fn open(self: &Arc<Self>, which: Option<&str>) -> Result<Device, OpenNiError> {
        let present = self.devices()?;
        let named = |wanted: &str| present.iter().find(|info| info.uri == wanted);
        match which {
            None => match present.first() {
                Some(first) => self.open_uri(&first.uri),
                None => Err(no_device("any", &present)),
            },
            Some(uri) if named(uri).is_some() => self.open_uri(uri),
            Some(file) if is_recording(file) => self.open_uri(file),
            Some(serial) => {
                let opened = present
                    .iter()
                    .filter_map(|info| self.open_uri(&info.uri).ok());
                let mut fitting =
                    opened.filter(|device| device.serial().as_deref() == Some(serial));
                fitting.next().ok_or_else(|| no_device(serial, &present))
            }
        }
    }

    /// Opens a device by its URI, or a recording by its file.
    pub fn open_uri(self: &Arc<Self>, uri: &str) -> Result<Device, OpenNiError> {
        let text = c_text(uri)?;
        let mut handle: Handle = ptr::null_mut();
        // SAFETY: a text that ends with zero, and a variable for the handle.
        let status = unsafe { (self.api.device_open)(text.as_ptr(), &mut handle) };
        self.check(status, || format!("open {uri}"))?;
        let mut open = Open {
            openni: self.clone(),
            handle,
            info: DeviceInfo {
                uri: uri.to_owned(),
                vendor: String::new(),
                name: String::new(),
                usb: [0; 2],
            },
        };
        let mut info = OniDeviceInfo {
            uri: [0; _],
            vendor: [0; _],
            name: [0; _],
            usb_vendor_id: 0,
            usb_product_id: 0,
        };
        // SAFETY: the handle is open; the function fills the variable.
        if unsafe { (self.api.device_info)(handle, &mut info) } == STATUS_OK {
            open.info = DeviceInfo::from_c(&info);
        }
        Ok(Device {
            open: Arc::new(open),
        })
    }
}

/// Whether a name is one of a recording's file.
pub fn is_recording(name: &str) -> bool {
    let ending = Path::new(name).extension();
    ending.is_some_and(|ending| ending.eq_ignore_ascii_case("oni"))
}

fn no_device(wanted: &str, present: &[DeviceInfo]) -> OpenNiError {
    OpenNiError::NoDevice {
        wanted: wanted.to_owned(),
        present: present.iter().map(|info| info.uri.clone()).collect(),
    }
}

impl Device {
    /// What it is.
    pub fn info(&self) -> &DeviceInfo {
        &self.open.info
    }

    /// Its serial number, where it tells one.
    pub fn serial(&self) -> Option<String> {
        let mut text = [0u8; 256];
        let mut size = text.len() as c_int;
        // SAFETY: the function writes at most `size` bytes and sets `size` to how many.
        let status = unsafe {
            let api = &self.open.openni.api;
            let data: *mut c_void = text.as_mut_ptr().cast();
            (api.device_get_property)(self.open.handle, DEVICE_SERIAL_NUMBER, data, &mut size)
        };
        let until_zero = text.split(|&byte| byte == 0).next().unwrap_or_default();
        let serial = String::from_utf8_lossy(until_zero).trim().to_owned();
        (status == STATUS_OK && !serial.is_empty()).then_some(serial)
    }

    /// The depth modes that give millimetres or tenths of them. Empty: it has no depth.
    pub fn depth_modes(&self) -> Vec<Mode> {
        // SAFETY: null or an entry that stays as long as the device is open, with an array of as many modes as it says.
        let modes = unsafe {
            let api = &self.open.openni.api;
            let Some(sensor) = (api.device_sensor_info)(self.open.handle, SENSOR_DEPTH).as_ref()
            else {
                return Vec::new();
            };
            let count = usize::try_from(sensor.num_supported_video_modes).unwrap_or(0);
            if sensor.supported_video_modes.is_null() || count == 0 {
                return Vec::new();
            }
            std::slice::from_raw_parts(sensor.supported_video_modes, count)
        };
        let mut modes: Vec<Mode> = modes.iter().filter_map(Mode::from_c).collect();
        modes.dedup();
        modes
    }

    /// Moves depth to where the colour camera sees it, or leaves it where it was measured. A device without a colour
    /// camera refuses the first and takes the second for granted.
    pub fn register_to_colour(&self, on: bool) -> Result<(), OpenNiError> {
        let mode = match on {
            true => IMAGE_REGISTRATION_DEPTH_TO_COLOR,
            false => IMAGE_REGISTRATION_OFF,
        };
        // SAFETY: a plain call on an open device.
        let can = unsafe {
            let has = self.open.openni.api.device_has_property;
            has(self.open.handle, DEVICE_IMAGE_REGISTRATION) != 0
        };
        if !on && !can {
            return Ok(());
        }
        self.set(
            DEVICE_IMAGE_REGISTRATION,
            &mode,
            "choose the registration of depth and colour",
        )
    }

    /// A whole number of 8 bytes that a driver tells under a property of its own; `None`: it does not.
    pub fn own_property(&self, property: i32) -> Option<i64> {
        let mut value: i64 = 0;
        let mut size = size_of::<i64>() as c_int;
        // SAFETY: the function writes at most `size` bytes, which the value has.
        let status = unsafe {
            let get = self.open.openni.api.device_get_property;
            get(
                self.open.handle,
                property,
                ptr::from_mut(&mut value).cast(),
                &mut size,
            )
        };
        (status == STATUS_OK && size == size_of::<i64>() as c_int).then_some(value)
    }

    /// Whether it is a recording.
    pub fn is_recording(&self) -> bool {
        // SAFETY: a plain call on an open device.
        unsafe {
            let has = self.open.openni.api.device_has_property;
            has(self.open.handle, DEVICE_PLAYBACK_SPEED) != 0
        }
    }

    /// How a recording is played, once and not again from the beginning. Refused by a sensor.
    pub fn play(&self, how: Playback) -> Result<(), OpenNiError> {
        let speed: f32 = match how {
            Playback::OnDemand => -1.0,
            Playback::Paced(speed) => speed,
        };
        self.set(
            DEVICE_PLAYBACK_REPEAT,
            &(0 as c_int),
            "play the recording once",
        )?;
        self.set(
            DEVICE_PLAYBACK_SPEED,
            &speed,
            "set the speed of the recording",
        )
    }

    pub(super) fn openni(&self) -> &Arc<OpenNi> {
        &self.open.openni
    }

    pub(crate) fn handle(&self) -> Handle {
        self.open.handle
    }

    fn set<T>(&self, property: c_int, value: &T, doing: &str) -> Result<(), OpenNiError> {
        let data: *const c_void = ptr::from_ref(value).cast();
        // SAFETY: the value is as long as is said, and only read.
        let status = unsafe {
            let set = self.open.openni.api.device_set_property;
            set(self.open.handle, property, data, size_of::<T>() as c_int)
        };
        let doing = || format!("{doing} of {}", self.open.info.uri);
        self.open.openni.check(status, doing)
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        // SAFETY: opened in `open_uri`, closed once; its streams hold this, so none is left.
        unsafe { (self.openni.api.device_close)(self.handle) };
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Device")
            .field("info", &self.open.info)
            .finish_non_exhaustive()
    }
}
