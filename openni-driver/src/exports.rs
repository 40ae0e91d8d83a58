//! The C interface of a driver (`OniDriverAPI.h`): what OpenNI2 looks up and calls.
//!
//! Devices and streams go out as pointers to boxes of ours and come back in each call until they are closed or
//! destroyed; OpenNI2 does neither while another of its calls on the same one is under way.
#![allow(
    unsafe_code,
    reason = "C calls these functions, with pointers of its own"
)]
#![allow(
    clippy::missing_safety_doc,
    reason = "what OpenNI2 has to keep to is written in OniDriverAPI.h"
)]

use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr;
use std::sync::{Mutex, PoisonError};

use posefuse_devices::openni::c::{
    DeviceInfoCallback, DeviceStateCallback, IMAGE_REGISTRATION_OFF, OniSensorInfo, OniStatus,
    STATUS_BAD_PARAMETER, STATUS_ERROR, STATUS_NOT_IMPLEMENTED, STATUS_NOT_SUPPORTED, STATUS_OK,
};

use crate::device::VirtualDevice;
use crate::driver::Driver;
use crate::outward::{DeviceNews, NewFrame, PropertyChanged, PropertyNews, Theirs};
use crate::stream::VirtualStream;

static DRIVER: Mutex<Option<Driver>> = Mutex::new(None);

fn with_driver<T>(ask: impl FnOnce(&Driver) -> Option<T>) -> Option<T> {
    let driver = DRIVER.lock().unwrap_or_else(PoisonError::into_inner);
    ask(driver.as_ref()?)
}

/// The old driver ends with the lock released: its watcher may be telling OpenNI2 news, which may ask us something.
fn swap_driver(new: Option<Driver>) {
    let old = std::mem::replace(
        &mut *DRIVER.lock().unwrap_or_else(PoisonError::into_inner),
        new,
    );
    drop(old);
}

/// # Safety
/// `text` is null or ends with zero.
unsafe fn text<'a>(text: *const c_char) -> Option<&'a str> {
    // SAFETY: as the caller promises.
    (!text.is_null())
        .then(|| unsafe { CStr::from_ptr(text) })?
        .to_str()
        .ok()
}

/// # Safety
/// `data` is null or has `size` bytes.
unsafe fn bytes<'a>(data: *const c_void, size: c_int) -> &'a [u8] {
    let size = usize::try_from(size).unwrap_or(0);
    if data.is_null() || size == 0 {
        return &[];
    }
    // SAFETY: as the caller promises.
    unsafe { std::slice::from_raw_parts(data.cast(), size) }
}

/// # Safety
/// `data` has room for `*size` bytes.
unsafe fn give(value: Option<Vec<u8>>, data: *mut c_void, size: *mut c_int) -> OniStatus {
    let Some(value) = value else {
        return STATUS_NOT_SUPPORTED;
    };
    // SAFETY: null or a variable of the caller's.
    let Some(size) = (unsafe { size.as_mut() }) else {
        return STATUS_BAD_PARAMETER;
    };
    if data.is_null() || usize::try_from(*size).map_or(true, |room| room < value.len()) {
        return STATUS_BAD_PARAMETER;
    }
    // SAFETY: there is room for as many bytes, as was looked at above.
    unsafe { ptr::copy_nonoverlapping(value.as_ptr(), data.cast(), value.len()) };
    *size = value.len() as c_int;
    STATUS_OK
}

/// # Safety
/// `handle` came from [`oniDriverDeviceOpen`] and was not closed.
unsafe fn device<'a>(handle: *mut c_void) -> &'a VirtualDevice {
    // SAFETY: as the caller promises, it is a box of ours.
    unsafe { &*handle.cast() }
}

/// # Safety
/// `handle` came from [`oniDriverDeviceCreateStream`] and was not destroyed.
unsafe fn stream<'a>(handle: *mut c_void) -> &'a VirtualStream {
    // SAFETY: as the caller promises, it is a box of ours.
    unsafe { &*handle.cast() }
}

fn boxed<T>(value: Option<T>) -> *mut c_void {
    value.map_or(ptr::null_mut(), |value| {
        Box::into_raw(Box::new(value)).cast()
    })
}

fn news(
    handler: Option<PropertyChanged>,
    sender: *mut c_void,
    cookie: *mut c_void,
) -> Option<PropertyNews> {
    handler.map(|handler| PropertyNews {
        handler,
        sender: Theirs(sender),
        cookie: Theirs(cookie),
    })
}

/// Defines exported functions, whose bodies may use what OpenNI2 promises of their arguments.
macro_rules! exported {
    ($($(#[$doc:meta])* fn $name:ident($($arg:ident: $kind:ty),*) $(-> $result:ty)? { $($body:tt)* })*) => {$(
        $(#[$doc])*
        // SAFETY: OpenNI2 looks this name up; no other function of a program with it is called so.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case, reason = "OpenNI2 looks for this name")]
        unsafe extern "C" fn $name($($arg: $kind),*) $(-> $result)? {
            $($body)*
        }
    )*};
}

// --- the driver
exported! {
    /// Nothing needs to be made yet.
    fn oniDriverCreate(_services: *mut c_void) {}

    /// Ends the driver; its devices are closed by then.
    fn oniDriverDestroy() {
        swap_driver(None);
    }

    /// Starts it and tells of the devices that are there.
    fn oniDriverInitialize(
        connected: Option<DeviceInfoCallback>,
        disconnected: Option<DeviceInfoCallback>,
        _state_changed: Option<DeviceStateCallback>,
        cookie: *mut c_void
    ) -> OniStatus {
        let (Some(connected), Some(disconnected)) = (connected, disconnected) else {
            return STATUS_BAD_PARAMETER;
        };
        let cookie = Theirs(cookie);
        match Driver::start(DeviceNews { connected, disconnected, cookie }) {
            Ok(driver) => {
                swap_driver(Some(driver));
                STATUS_OK
            }
            Err(error) => {
                eprintln!("there are no virtual sensors of posefuse: {error}");
                STATUS_ERROR
            }
        }
    }

    /// Whether a URI that OpenNI2 has not heard of is a device of ours.
    fn oniDriverTryDevice(uri: *const c_char) -> OniStatus {
        // SAFETY: OpenNI2 gives a text.
        let ours = unsafe { text(uri) }.and_then(|uri| with_driver(|driver| Some(driver.has(uri))));
        if ours == Some(true) { STATUS_OK } else { STATUS_ERROR }
    }

    /// Depth alone needs no other stream's moment.
    fn oniDriverEnableFrameSync(_streams: *mut *mut c_void, _count: c_int) -> *mut c_void {
        ptr::null_mut()
    }

    /// As above.
    fn oniDriverDisableFrameSync(_group: *mut c_void) {}
}

// --- devices
exported! {
    /// Opens a device; null: it is not there.
    fn oniDriverDeviceOpen(uri: *const c_char, _mode: *const c_char) -> *mut c_void {
        // SAFETY: OpenNI2 gives a text.
        boxed(unsafe { text(uri) }.and_then(|uri| with_driver(|driver| driver.open(uri))))
    }

    /// Closes it.
    fn oniDriverDeviceClose(handle: *mut c_void) {
        if !handle.is_null() {
            // SAFETY: made by `boxed` in `oniDriverDeviceOpen`, given back once.
            drop(unsafe { Box::from_raw(handle.cast::<VirtualDevice>()) });
        }
    }

    /// It has depth.
    fn oniDriverDeviceGetSensorInfoList(
        handle: *mut c_void,
        list: *mut *mut OniSensorInfo,
        count: *mut c_int
    ) -> OniStatus {
        // SAFETY: an open device, and two variables.
        unsafe { (*list, *count) = device(handle).sensor_list() };
        STATUS_OK
    }

    /// A stream of depth; null: of anything else.
    fn oniDriverDeviceCreateStream(handle: *mut c_void, sensor_type: c_int) -> *mut c_void {
        // SAFETY: an open device.
        boxed(unsafe { device(handle) }.stream(sensor_type))
    }

    /// Ends it.
    fn oniDriverDeviceDestroyStream(_device: *mut c_void, handle: *mut c_void) {
        if !handle.is_null() {
            // SAFETY: made by `boxed` in `oniDriverDeviceCreateStream`, given back once.
            drop(unsafe { Box::from_raw(handle.cast::<VirtualStream>()) });
        }
    }

    /// Sets a property.
    fn oniDriverDeviceSetProperty(
        _device: *mut c_void,
        property: c_int,
        data: *const c_void,
        size: c_int
    ) -> OniStatus {
        // SAFETY: the data has that size.
        VirtualDevice::set(property, unsafe { bytes(data, size) })
    }

    /// Tells one.
    fn oniDriverDeviceGetProperty(
        handle: *mut c_void,
        property: c_int,
        data: *mut c_void,
        size: *mut c_int
    ) -> OniStatus {
        // SAFETY: an open device; the data has the size that is said.
        unsafe { give(device(handle).get(property), data, size) }
    }

    /// Whether it has one.
    fn oniDriverDeviceIsPropertySupported(_device: *mut c_void, property: c_int) -> c_int {
        VirtualDevice::has(property).into()
    }

    /// Whom to tell.
    fn oniDriverDeviceSetPropertyChangedCallback(
        handle: *mut c_void,
        handler: Option<PropertyChanged>,
        cookie: *mut c_void
    ) {
        // SAFETY: an open device.
        unsafe { device(handle) }.set_property_callback(news(handler, handle, cookie));
    }

    /// Tells all.
    fn oniDriverDeviceNotifyAllProperties(handle: *mut c_void) {
        // SAFETY: an open device.
        unsafe { device(handle) }.tell_all();
    }

    /// It knows no commands.
    fn oniDriverDeviceInvoke(_device: *mut c_void, _command: c_int, _data: *mut c_void, _size: c_int) -> OniStatus {
        STATUS_NOT_IMPLEMENTED
    }

    /// As above.
    fn oniDriverDeviceIsCommandSupported(_device: *mut c_void, _command: c_int) -> c_int {
        0
    }

    /// It runs by itself.
    fn oniDriverDeviceTryManualTrigger(_device: *mut c_void) -> OniStatus {
        STATUS_OK
    }

    /// It has no colour camera to register depth to.
    fn oniDriverDeviceIsImageRegistrationModeSupported(_device: *mut c_void, mode: c_int) -> c_int {
        (mode == IMAGE_REGISTRATION_OFF).into()
    }
}

// --- streams
exported! {
    /// Where frames come from.
    fn oniDriverStreamSetServices(handle: *mut c_void, services: *mut c_void) {
        // SAFETY: a stream that was not destroyed.
        unsafe { stream(handle) }.set_services(Theirs(services));
    }

    /// Sets a property.
    fn oniDriverStreamSetProperty(
        handle: *mut c_void,
        property: c_int,
        data: *const c_void,
        size: c_int
    ) -> OniStatus {
        // SAFETY: a stream that was not destroyed; the data has that size.
        unsafe { stream(handle).set(property, bytes(data, size)) }
    }

    /// Tells one.
    fn oniDriverStreamGetProperty(
        handle: *mut c_void,
        property: c_int,
        data: *mut c_void,
        size: *mut c_int
    ) -> OniStatus {
        // SAFETY: a stream that was not destroyed; the data has the size that is said.
        unsafe { give(stream(handle).get(property), data, size) }
    }

    /// Whether it has one.
    fn oniDriverStreamIsPropertySupported(_stream: *mut c_void, property: c_int) -> c_int {
        VirtualStream::has(property).into()
    }

    /// Whom to tell.
    fn oniDriverStreamSetPropertyChangedCallback(
        handle: *mut c_void,
        handler: Option<PropertyChanged>,
        cookie: *mut c_void
    ) {
        // SAFETY: a stream that was not destroyed.
        unsafe { stream(handle) }.set_property_callback(news(handler, handle, cookie));
    }

    /// Tells all.
    fn oniDriverStreamNotifyAllProperties(handle: *mut c_void) {
        // SAFETY: a stream that was not destroyed.
        unsafe { stream(handle) }.tell_all();
    }

    /// It knows no commands.
    fn oniDriverStreamInvoke(_stream: *mut c_void, _command: c_int, _data: *mut c_void, _size: c_int) -> OniStatus {
        STATUS_NOT_IMPLEMENTED
    }

    /// As above.
    fn oniDriverStreamIsCommandSupported(_stream: *mut c_void, _command: c_int) -> c_int {
        0
    }

    /// Lets frames come.
    fn oniDriverStreamStart(handle: *mut c_void) -> OniStatus {
        // SAFETY: a stream that was not destroyed.
        unsafe { stream(handle) }.start()
    }

    /// Ends that.
    fn oniDriverStreamStop(handle: *mut c_void) {
        // SAFETY: a stream that was not destroyed.
        unsafe { stream(handle) }.stop();
    }

    /// Bytes of a frame.
    fn oniDriverStreamGetRequiredFrameSize(handle: *mut c_void) -> c_int {
        // SAFETY: a stream that was not destroyed.
        unsafe { stream(handle) }.frame_size()
    }

    /// Whom to give frames.
    fn oniDriverStreamSetNewFrameCallback(handle: *mut c_void, handler: Option<NewFrame>, cookie: *mut c_void) {
        // SAFETY: a stream that was not destroyed.
        unsafe { stream(handle) }.set_frame_callback(handler, Theirs(handle), Theirs(cookie));
    }

    /// There is no colour camera.
    fn oniDriverStreamConvertDepthToColorCoordinates(
        _depth: *mut c_void,
        _colour: *mut c_void,
        _x: c_int,
        _y: c_int,
        _z: u16,
        _colour_x: *mut c_int,
        _colour_y: *mut c_int
    ) -> OniStatus {
        STATUS_NOT_SUPPORTED
    }
}

#[cfg(test)]
mod tests;
