//! What happens to devices: plugged in, pulled out, at a file's end.
#![allow(unsafe_code, reason = "OpenNI2 calls these functions")]

use std::ffi::{c_int, c_void};
use std::sync::{Mutex, mpsc};

use super::c::{DEVICE_STATE_EOF, OniDeviceCallbacks, OniDeviceInfo};
use super::library::DeviceInfo;

/// What happened to a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceEvent {
    /// It is there now.
    Connected(DeviceInfo),
    /// It is gone.
    Disconnected(DeviceInfo),
    /// A file has no more frames.
    EndOfFile(DeviceInfo),
    /// Its state changed otherwise: an `ONI_DEVICE_STATE_...`.
    State(DeviceInfo, i32),
}

/// What OpenNI2 holds the address of: the functions to call and where their news go.
pub(super) struct Listener {
    table: OniDeviceCallbacks,
    /// Called from several threads of the library.
    events: Mutex<mpsc::Sender<DeviceEvent>>,
}

impl Listener {
    pub(super) fn new(events: mpsc::Sender<DeviceEvent>) -> Box<Self> {
        Box::new(Self {
            table: OniDeviceCallbacks {
                device_connected: Some(connected),
                device_disconnected: Some(disconnected),
                device_state_changed: Some(state_changed),
            },
            events: Mutex::new(events),
        })
    }

    /// What is given to OpenNI2.
    pub(super) fn parts(&mut self) -> (*mut OniDeviceCallbacks, *mut c_void) {
        let cookie = ptr_to(self);
        (&mut self.table, cookie)
    }

    fn tell(&self, event: DeviceEvent) {
        if let Ok(events) = self.events.lock() {
            // Nobody listens any more when the receiver is gone: that is at the very end.
            let _ = events.send(event);
        }
    }
}

fn ptr_to(listener: &Listener) -> *mut c_void {
    std::ptr::from_ref(listener).cast_mut().cast()
}

fn tell(
    info: *const OniDeviceInfo,
    cookie: *mut c_void,
    event: impl FnOnce(DeviceInfo) -> DeviceEvent,
) {
    // SAFETY: `cookie` is the listener that was registered, which lives until it is unregistered; `info` is valid for
    // the length of this call. Neither is written to.
    let (listener, info) = unsafe { (cookie.cast::<Listener>().as_ref(), info.as_ref()) };
    if let (Some(listener), Some(info)) = (listener, info) {
        listener.tell(event(DeviceInfo::from_c(info)));
    }
}

extern "system" fn connected(info: *const OniDeviceInfo, cookie: *mut c_void) {
    tell(info, cookie, DeviceEvent::Connected);
}

extern "system" fn disconnected(info: *const OniDeviceInfo, cookie: *mut c_void) {
    tell(info, cookie, DeviceEvent::Disconnected);
}

extern "system" fn state_changed(info: *const OniDeviceInfo, state: c_int, cookie: *mut c_void) {
    tell(info, cookie, |info| match state {
        DEVICE_STATE_EOF => DeviceEvent::EndOfFile(info),
        state => DeviceEvent::State(info, state),
    });
}
