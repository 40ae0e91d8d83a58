//! What OpenNI2 gave the driver to call, made safe to call.
#![allow(unsafe_code, reason = "calls functions and fills frames of OpenNI2")]

use std::ffi::{c_int, c_void};

use posefuse_devices::openni::c::{
    self, OniDeviceInfo, OniFrame, OniStreamServices, OniVideoMode, SENSOR_DEPTH,
};

/// `NewFrameCallback` of `OniDriverAPI.h`: stream, frame, cookie.
pub(crate) type NewFrame = extern "system" fn(*mut c_void, *mut OniFrame, *mut c_void);
/// `PropertyChangedCallback`: sender, property, value, its size, cookie.
pub(crate) type PropertyChanged =
    extern "system" fn(*mut c_void, c_int, *const c_void, c_int, *mut c_void);

/// A pointer of OpenNI2's, which may be used from any thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Theirs(pub(crate) *mut c_void);

// SAFETY: OpenNI2 calls drivers from many threads and expects to be called from threads of theirs; what it hands out
// stays valid until the stream, device or driver that it was given to is destroyed.
unsafe impl Send for Theirs {}
// SAFETY: as above.
unsafe impl Sync for Theirs {}

/// Who is told that a device came or went.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeviceNews {
    pub(crate) connected: c::DeviceInfoCallback,
    pub(crate) disconnected: c::DeviceInfoCallback,
    pub(crate) cookie: Theirs,
}

impl DeviceNews {
    pub(crate) fn tell(&self, info: &OniDeviceInfo, inside: bool) {
        let call = if inside {
            self.connected
        } else {
            self.disconnected
        };
        call(info, self.cookie.0);
    }
}

/// Who is told of a property's value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PropertyNews {
    pub(crate) handler: PropertyChanged,
    pub(crate) sender: Theirs,
    pub(crate) cookie: Theirs,
}

impl PropertyNews {
    pub(crate) fn tell(&self, property: c_int, value: &[u8]) {
        let data: *const c_void = value.as_ptr().cast();
        (self.handler)(
            self.sender.0,
            property,
            data,
            value.len() as c_int,
            self.cookie.0,
        );
    }
}

/// Where a stream's frames go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameOutlet {
    /// An [`OniStreamServices`].
    pub(crate) services: Theirs,
    pub(crate) handler: NewFrame,
    pub(crate) stream: Theirs,
    pub(crate) cookie: Theirs,
}

/// A frame to be given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outgoing<'a> {
    /// Millimetres, row after row.
    pub(crate) pixels: &'a [u16],
    pub(crate) mode: OniVideoMode,
    pub(crate) number: c_int,
    pub(crate) timestamp_us: u64,
    pub(crate) mirrored: bool,
}

impl FrameOutlet {
    /// Gives a frame; `false` if OpenNI2 has no room for it.
    pub(crate) fn give(&self, outgoing: &Outgoing) -> bool {
        // SAFETY: given by OpenNI2 in `oniDriverStreamSetServices` and valid as long as the stream is, which ends its
        // thread before it is destroyed.
        let Some(services) = (unsafe { self.services.0.cast::<OniStreamServices>().as_ref() })
        else {
            return false;
        };
        let frame = (services.acquire_frame)(services.stream_services);
        // SAFETY: null or a frame that is ours until it is released below.
        let Some(filled) = (unsafe { frame.as_mut() }) else {
            return false;
        };
        let room = usize::try_from(filled.data_size).unwrap_or(0) / size_of::<u16>();
        let fits = room >= outgoing.pixels.len() && !filled.data.is_null();
        if fits {
            // SAFETY: the frame has `data_size` bytes of data, that is at least as many pixels as we have; buffers of
            // OpenNI2 are aligned for any type.
            let to: &mut [u16] = unsafe {
                std::slice::from_raw_parts_mut(filled.data.cast(), outgoing.pixels.len())
            };
            copy(outgoing, to);
            describe(outgoing, filled);
            (self.handler)(self.stream.0, frame, self.cookie.0);
        }
        (services.release_frame)(services.stream_services, frame);
        fits
    }
}

fn copy(outgoing: &Outgoing, to: &mut [u16]) {
    to.copy_from_slice(outgoing.pixels);
    if outgoing.mirrored {
        let width = usize::try_from(outgoing.mode.resolution_x)
            .unwrap_or(1)
            .max(1);
        to.chunks_exact_mut(width).for_each(<[u16]>::reverse);
    }
}

fn describe(outgoing: &Outgoing, frame: &mut OniFrame) {
    frame.data_size = size_of_val(outgoing.pixels) as c_int;
    frame.sensor_type = SENSOR_DEPTH;
    frame.timestamp = outgoing.timestamp_us;
    frame.frame_index = outgoing.number;
    frame.width = outgoing.mode.resolution_x;
    frame.height = outgoing.mode.resolution_y;
    frame.video_mode = outgoing.mode;
    frame.cropping_enabled = 0;
    frame.crop_origin_x = 0;
    frame.crop_origin_y = 0;
    frame.stride = outgoing.mode.resolution_x * size_of::<u16>() as c_int;
}
