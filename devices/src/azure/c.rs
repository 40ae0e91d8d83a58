//! What the Azure Kinect Sensor SDK (`k4a.h`, `k4atypes.h`) and its Body Tracking SDK 1.1 (`k4abt.h`, `k4abttypes.h`) pass
//! over, as far as it is used here.
#![allow(
    unsafe_code,
    reason = "the addresses of C functions are given their types here"
)]

use std::ffi::{c_char, c_float, c_int, c_uint, c_void};

/// A `k4a_device_t`, `k4a_capture_t`, `k4abt_tracker_t` or `k4abt_frame_t`.
pub(super) type Handle = *mut c_void;
/// `k4a_result_t` and `k4a_buffer_result_t`: 0 is good. `k4a_wait_result_t`: 0 good, 1 failed, 2 nothing in time.
pub(super) type Status = c_int;
/// `K4A_WAIT_RESULT_TIMEOUT`.
pub(super) const TIMEOUT: Status = 2;

/// How many joints a skeleton has, in the order of the joint set `azure-kinect`.
pub(super) const JOINTS: usize = 32;

/// `k4a_device_configuration_t`.
#[repr(C)]
pub(super) struct DeviceConfig {
    pub(super) color_format: c_int,
    pub(super) color_resolution: c_int,
    pub(super) depth_mode: c_int,
    pub(super) fps: c_int,
    pub(super) synchronized_images_only: bool,
    pub(super) depth_delay_off_color_us: i32,
    pub(super) wired_sync_mode: c_int,
    pub(super) subordinate_delay_off_master_us: u32,
    pub(super) disable_streaming_indicator: bool,
}

/// `k4a_calibration_camera_t`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Camera {
    pub(super) rotation: [c_float; 9],
    pub(super) translation_mm: [c_float; 3],
    pub(super) model: c_int,
    pub(super) parameter_count: c_uint,
    /// cx, cy, fx, fy, distortion ...
    pub(super) parameters: [c_float; 15],
    pub(super) width: c_int,
    pub(super) height: c_int,
    pub(super) metric_radius: c_float,
}

/// `k4a_calibration_t`.
#[repr(C)]
pub(super) struct Calibration {
    pub(super) depth: Camera,
    pub(super) color: Camera,
    pub(super) extrinsics: [[[c_float; 12]; 4]; 4],
    pub(super) depth_mode: c_int,
    pub(super) color_resolution: c_int,
    /// Ours: room for a library whose structure is longer.
    pub(super) spare: [u64; 64],
}

/// `k4abt_tracker_configuration_t` since 1.1; passed by value.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct TrackerConfig {
    pub(super) sensor_orientation: c_int,
    pub(super) processing_mode: c_int,
    pub(super) gpu_device_id: i32,
    pub(super) model_path: *const c_char,
}

/// `k4abt_joint_t`.
#[derive(Clone, Copy, Default)]
#[repr(C)]
pub(super) struct Joint {
    pub(super) position_mm: [c_float; 3],
    /// w, x, y, z.
    pub(super) orientation: [c_float; 4],
    /// 0 none (out of range), 1 low (hidden, predicted), 2 medium, 3 high (promised for later versions).
    pub(super) confidence: c_int,
}

/// `k4abt_skeleton_t`.
#[derive(Clone, Copy, Default)]
#[repr(C)]
pub(super) struct Skeleton {
    pub(super) joints: [Joint; JOINTS],
}

pub(super) mod sensor {
    //! `k4a.h`.
    use super::{Calibration, DeviceConfig, Handle, Status, c_char, c_int};
    use crate::find::functions;

    functions! {
        "k4a.h";
        count = "k4a_device_get_installed_count": () -> u32;
        open = "k4a_device_open": (u32, *mut Handle) -> Status;
        close = "k4a_device_close": (Handle);
        serial = "k4a_device_get_serialnum": (Handle, *mut c_char, *mut usize) -> Status;
        start = "k4a_device_start_cameras": (Handle, *const DeviceConfig) -> Status;
        stop = "k4a_device_stop_cameras": (Handle);
        calibration = "k4a_device_get_calibration": (Handle, c_int, c_int, *mut Calibration) -> Status;
        capture = "k4a_device_get_capture": (Handle, *mut Handle, i32) -> Status;
        release = "k4a_capture_release": (Handle);
    }
}

pub(super) mod tracker {
    //! `k4abt.h`.
    use super::{Calibration, Handle, Skeleton, Status, TrackerConfig, c_float};
    use crate::find::functions;

    functions! {
        "k4abt.h";
        create = "k4abt_tracker_create": (*const Calibration, TrackerConfig, *mut Handle) -> Status;
        shutdown = "k4abt_tracker_shutdown": (Handle);
        destroy = "k4abt_tracker_destroy": (Handle);
        set_smoothing = "k4abt_tracker_set_temporal_smoothing": (Handle, c_float);
        enqueue = "k4abt_tracker_enqueue_capture": (Handle, Handle, i32) -> Status;
        pop = "k4abt_tracker_pop_result": (Handle, *mut Handle, i32) -> Status;
        release = "k4abt_frame_release": (Handle);
        bodies = "k4abt_frame_get_num_bodies": (Handle) -> u32;
        skeleton = "k4abt_frame_get_body_skeleton": (Handle, u32, *mut Skeleton) -> Status;
        id = "k4abt_frame_get_body_id": (Handle, u32) -> u32;
        timestamp = "k4abt_frame_get_device_timestamp_usec": (Handle) -> u64;
    }
}

#[cfg(test)]
mod tests {
    use std::mem::{offset_of, size_of};

    use super::*;

    #[test]
    #[cfg(target_pointer_width = "64")]
    fn structures_have_the_layout_of_c() {
        assert_eq!(size_of::<DeviceConfig>(), 36);
        assert_eq!(
            (size_of::<Camera>(), offset_of!(Calibration, spare)),
            (128, 1032)
        );
        assert_eq!(
            (size_of::<Skeleton>(), size_of::<TrackerConfig>()),
            (1024, 24)
        );
    }
}
