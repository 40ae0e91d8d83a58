//! The functions of OpenNI2's C interface (`OniCAPI.h`), found in a library that was loaded.
#![allow(
    unsafe_code,
    reason = "the addresses of C functions are given their types here"
)]

use std::ffi::{c_char, c_int, c_void};

use crate::find::functions;

use super::c::{OniDeviceCallbacks, OniDeviceInfo, OniFrame, OniSensorInfo, OniStatus, OniVersion};

/// An `OniDeviceHandle`, `OniStreamHandle`, `OniRecorderHandle` or `OniCallbackHandle`: the library's own.
pub(super) type Handle = *mut c_void;

functions! {
    "OniCAPI.h";
    initialize = "oniInitialize": (c_int) -> OniStatus;
    shutdown = "oniShutdown": ();
    version = "oniGetVersion": () -> OniVersion;
    extended_error = "oniGetExtendedError": () -> *const c_char;
    device_list = "oniGetDeviceList": (*mut *mut OniDeviceInfo, *mut c_int) -> OniStatus;
    release_device_list = "oniReleaseDeviceList": (*mut OniDeviceInfo) -> OniStatus;
    register_device_callbacks = "oniRegisterDeviceCallbacks":
        (*mut OniDeviceCallbacks, *mut c_void, *mut Handle) -> OniStatus;
    unregister_device_callbacks = "oniUnregisterDeviceCallbacks": (Handle);
    wait_for_any_stream = "oniWaitForAnyStream": (*mut Handle, c_int, *mut c_int, c_int) -> OniStatus;
    device_open = "oniDeviceOpen": (*const c_char, *mut Handle) -> OniStatus;
    device_close = "oniDeviceClose": (Handle) -> OniStatus;
    device_sensor_info = "oniDeviceGetSensorInfo": (Handle, c_int) -> *const OniSensorInfo;
    device_info = "oniDeviceGetInfo": (Handle, *mut OniDeviceInfo) -> OniStatus;
    device_create_stream = "oniDeviceCreateStream": (Handle, c_int, *mut Handle) -> OniStatus;
    device_set_property = "oniDeviceSetProperty": (Handle, c_int, *const c_void, c_int) -> OniStatus;
    device_get_property = "oniDeviceGetProperty": (Handle, c_int, *mut c_void, *mut c_int) -> OniStatus;
    device_has_property = "oniDeviceIsPropertySupported": (Handle, c_int) -> c_int;
    stream_destroy = "oniStreamDestroy": (Handle);
    stream_start = "oniStreamStart": (Handle) -> OniStatus;
    stream_stop = "oniStreamStop": (Handle);
    stream_read_frame = "oniStreamReadFrame": (Handle, *mut *mut OniFrame) -> OniStatus;
    stream_set_property = "oniStreamSetProperty": (Handle, c_int, *const c_void, c_int) -> OniStatus;
    stream_get_property = "oniStreamGetProperty": (Handle, c_int, *mut c_void, *mut c_int) -> OniStatus;
    frame_release = "oniFrameRelease": (*mut OniFrame);
    create_recorder = "oniCreateRecorder": (*const c_char, *mut Handle) -> OniStatus;
    recorder_attach_stream = "oniRecorderAttachStream": (Handle, Handle, c_int) -> OniStatus;
    recorder_start = "oniRecorderStart": (Handle) -> OniStatus;
    recorder_stop = "oniRecorderStop": (Handle);
    recorder_destroy = "oniRecorderDestroy": (*mut Handle) -> OniStatus;
}
