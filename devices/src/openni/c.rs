//! OpenNI2's C types and constants, as its headers `OniCTypes.h`, `OniCEnums.h`, `OniCProperties.h` and
//! `OniDriverTypes.h` (version 2.2) lay them out. `tests/openni_layout.rs` compares the layout with installed headers.
//!
//! Enumerations of C are whole numbers here: a library may give a value that no list of ours has.

use std::ffi::{c_char, c_int, c_void};

/// Length of the texts in [`OniDeviceInfo`], the closing zero included.
pub const MAX_STR: usize = 256;
/// The interface that these declarations are of: 2.2.
pub const API_VERSION: c_int = 2 * 1000 + 2;

/// `OniStatus`.
pub type OniStatus = c_int;
/// `ONI_STATUS_OK`.
pub const STATUS_OK: OniStatus = 0;
/// `ONI_STATUS_ERROR`.
pub const STATUS_ERROR: OniStatus = 1;
/// `ONI_STATUS_NOT_IMPLEMENTED`.
pub const STATUS_NOT_IMPLEMENTED: OniStatus = 2;
/// `ONI_STATUS_NOT_SUPPORTED`.
pub const STATUS_NOT_SUPPORTED: OniStatus = 3;
/// `ONI_STATUS_BAD_PARAMETER`.
pub const STATUS_BAD_PARAMETER: OniStatus = 4;
/// `ONI_STATUS_OUT_OF_FLOW`.
pub const STATUS_OUT_OF_FLOW: OniStatus = 5;
/// `ONI_STATUS_NO_DEVICE`.
pub const STATUS_NO_DEVICE: OniStatus = 6;
/// `ONI_STATUS_TIME_OUT`.
pub const STATUS_TIME_OUT: OniStatus = 102;

/// `ONI_SENSOR_DEPTH`, an `OniSensorType`.
pub const SENSOR_DEPTH: c_int = 3;
/// `ONI_PIXEL_FORMAT_DEPTH_1_MM`, an `OniPixelFormat`.
pub const PIXEL_DEPTH_1_MM: c_int = 100;
/// `ONI_PIXEL_FORMAT_DEPTH_100_UM`.
pub const PIXEL_DEPTH_100_UM: c_int = 101;

/// `ONI_DEVICE_STATE_OK`, an `OniDeviceState`.
pub const DEVICE_STATE_OK: c_int = 0;
/// `ONI_DEVICE_STATE_ERROR`.
pub const DEVICE_STATE_ERROR: c_int = 1;
/// `ONI_DEVICE_STATE_NOT_READY`.
pub const DEVICE_STATE_NOT_READY: c_int = 2;
/// `ONI_DEVICE_STATE_EOF`.
pub const DEVICE_STATE_EOF: c_int = 3;

/// `ONI_IMAGE_REGISTRATION_OFF`, an `OniImageRegistrationMode`.
pub const IMAGE_REGISTRATION_OFF: c_int = 0;
/// `ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR`.
pub const IMAGE_REGISTRATION_DEPTH_TO_COLOR: c_int = 1;

/// `ONI_DEVICE_PROPERTY_DRIVER_VERSION`: [`OniVersion`].
pub const DEVICE_DRIVER_VERSION: c_int = 1;
/// `ONI_DEVICE_PROPERTY_SERIAL_NUMBER`: text.
pub const DEVICE_SERIAL_NUMBER: c_int = 3;
/// `ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION`: `OniImageRegistrationMode`.
pub const DEVICE_IMAGE_REGISTRATION: c_int = 5;
/// `ONI_DEVICE_PROPERTY_PLAYBACK_SPEED`: float; negative is "each frame when it is asked for".
pub const DEVICE_PLAYBACK_SPEED: c_int = 100;
/// `ONI_DEVICE_PROPERTY_PLAYBACK_REPEAT_ENABLED`: `OniBool`.
pub const DEVICE_PLAYBACK_REPEAT: c_int = 101;

/// `ONI_STREAM_PROPERTY_CROPPING`: five ints, enabled, origin x and y, width, height.
pub const STREAM_CROPPING: c_int = 0;
/// `ONI_STREAM_PROPERTY_HORIZONTAL_FOV`: float, radians.
pub const STREAM_HORIZONTAL_FOV: c_int = 1;
/// `ONI_STREAM_PROPERTY_VERTICAL_FOV`: float, radians.
pub const STREAM_VERTICAL_FOV: c_int = 2;
/// `ONI_STREAM_PROPERTY_VIDEO_MODE`: [`OniVideoMode`].
pub const STREAM_VIDEO_MODE: c_int = 3;
/// `ONI_STREAM_PROPERTY_MAX_VALUE`: int.
pub const STREAM_MAX_VALUE: c_int = 4;
/// `ONI_STREAM_PROPERTY_MIN_VALUE`: int.
pub const STREAM_MIN_VALUE: c_int = 5;
/// `ONI_STREAM_PROPERTY_STRIDE`: int, bytes a row.
pub const STREAM_STRIDE: c_int = 6;
/// `ONI_STREAM_PROPERTY_MIRRORING`: `OniBool`.
pub const STREAM_MIRRORING: c_int = 7;
/// `ONI_STREAM_PROPERTY_NUMBER_OF_FRAMES`: int, of a file's stream.
pub const STREAM_NUMBER_OF_FRAMES: c_int = 8;

/// `OniVersion`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "as the header names them")]
pub struct OniVersion {
    pub major: c_int,
    pub minor: c_int,
    pub maintenance: c_int,
    pub build: c_int,
}

/// `OniVideoMode`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "as the header names them")]
pub struct OniVideoMode {
    pub pixel_format: c_int,
    pub resolution_x: c_int,
    pub resolution_y: c_int,
    pub fps: c_int,
}

/// `OniSensorInfo`.
#[repr(C)]
#[derive(Debug)]
#[allow(missing_docs, reason = "as the header names them")]
pub struct OniSensorInfo {
    pub sensor_type: c_int,
    pub num_supported_video_modes: c_int,
    pub supported_video_modes: *mut OniVideoMode,
}

/// `OniDeviceInfo`.
#[repr(C)]
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "as the header names them")]
pub struct OniDeviceInfo {
    pub uri: [c_char; MAX_STR],
    pub vendor: [c_char; MAX_STR],
    pub name: [c_char; MAX_STR],
    pub usb_vendor_id: u16,
    pub usb_product_id: u16,
}

/// `OniFrame`.
#[repr(C)]
#[derive(Debug)]
#[allow(missing_docs, reason = "as the header names them")]
pub struct OniFrame {
    pub data_size: c_int,
    pub data: *mut c_void,
    pub sensor_type: c_int,
    pub timestamp: u64,
    pub frame_index: c_int,
    pub width: c_int,
    pub height: c_int,
    pub video_mode: OniVideoMode,
    pub cropping_enabled: c_int,
    pub crop_origin_x: c_int,
    pub crop_origin_y: c_int,
    pub stride: c_int,
}

/// `OniDeviceInfoCallback`.
pub type DeviceInfoCallback = extern "system" fn(*const OniDeviceInfo, *mut c_void);
/// `OniDeviceStateCallback`.
pub type DeviceStateCallback = extern "system" fn(*const OniDeviceInfo, c_int, *mut c_void);

/// `OniDeviceCallbacks`.
#[repr(C)]
#[allow(missing_docs, reason = "as the header names them")]
pub struct OniDeviceCallbacks {
    pub device_connected: Option<DeviceInfoCallback>,
    pub device_disconnected: Option<DeviceInfoCallback>,
    pub device_state_changed: Option<DeviceStateCallback>,
}

/// `OniStreamServices`: what OpenNI2 does for the stream of a driver.
#[repr(C)]
#[allow(missing_docs, reason = "as the header names them")]
pub struct OniStreamServices {
    pub stream_services: *mut c_void,
    pub get_default_required_frame_size: extern "system" fn(*mut c_void) -> c_int,
    pub acquire_frame: extern "system" fn(*mut c_void) -> *mut OniFrame,
    pub add_frame_ref: extern "system" fn(*mut c_void, *mut OniFrame),
    pub release_frame: extern "system" fn(*mut c_void, *mut OniFrame),
}

/// What a fixed-length text of OpenNI2 says, up to its closing zero.
pub fn text(field: &[c_char]) -> String {
    let bytes = field.iter().take_while(|&&byte| byte != 0);
    let bytes: Vec<u8> = bytes.map(|&byte| byte as u8).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A text as a fixed-length text of OpenNI2; what does not fit is left out.
pub fn fixed(text: &str) -> [c_char; MAX_STR] {
    let mut field = [0; MAX_STR];
    let room = field.iter_mut().take(MAX_STR - 1);
    for (to, from) in room.zip(text.bytes()) {
        *to = from as c_char;
    }
    field
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_keep_their_closing_zero_whatever_their_length() {
        assert_eq!(text(&fixed("posefuse://0")), "posefuse://0");
        let long = "x".repeat(300);
        assert_eq!(text(&fixed(&long)).len(), MAX_STR - 1);
    }
}
