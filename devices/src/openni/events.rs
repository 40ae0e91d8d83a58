//! What happens to devices: plugged in, pulled out, at a file's end.
#![allow(unsafe_code, reason = "OpenNI2 calls these functions")]

use std::ffi::{c_int, c_void};
use std::sync::mpsc;

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
    /// Called from several threads of the library, none of which may be made to wait.
    events: mpsc::SyncSender<DeviceEvent>,
}

impl Listener {
    pub(super) fn new(events: mpsc::SyncSender<DeviceEvent>) -> Box<Self> {
        Box::new(Self {
            table: OniDeviceCallbacks {
                device_connected: Some(connected),
                device_disconnected: Some(disconnected),
                device_state_changed: Some(state_changed),
            },
            events,
        })
    }

    /// What is given to OpenNI2.
    pub(super) fn parts(&mut self) -> (*mut OniDeviceCallbacks, *mut c_void) {
        let cookie = ptr_to(self);
        (&mut self.table, cookie)
    }

    fn tell(&self, event: DeviceEvent) {
        // Dropped where as many wait as may, and where the receiver is gone: that is at the very end.
        let _ = self.events.try_send(event);
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

#[cfg(test)]
mod tests {
    use super::super::c::fixed;
    use super::super::library::MOST_EVENTS;
    use super::*;

    #[test]
    fn events_that_nobody_asks_for_neither_pile_up_nor_hold_up_the_library() {
        let (sender, events) = mpsc::sync_channel(MOST_EVENTS);
        let mut listener = Listener::new(sender);
        let (_, cookie) = listener.parts();
        let info = OniDeviceInfo {
            uri: fixed("posefuse://0"),
            vendor: fixed(""),
            name: fixed(""),
            usb_vendor_id: 0,
            usb_product_id: 0,
        };
        for state in 0..1000 {
            state_changed(&info, 10 + state, cookie);
        }
        let of = |state| DeviceEvent::State(DeviceInfo::from_c(&info), state);
        let kept: Vec<DeviceEvent> = events.try_iter().collect();
        assert_eq!(kept.len(), MOST_EVENTS);
        assert_eq!((&kept[0], &kept[63]), (&of(10), &of(73)));
        state_changed(&info, 5, cookie);
        assert_eq!(events.try_recv(), Ok(of(5)), "there is room again");
    }
}
