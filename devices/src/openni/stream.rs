//! The depth of one device, frame after frame.
#![allow(unsafe_code, reason = "calls OpenNI2's C functions")]

use std::ffi::{c_int, c_void};
use std::ptr;
use std::time::Duration;

use posefuse_skeleton::{DepthImage, Intrinsics};

use super::api::Handle;
use super::c::{
    OniFrame, OniVideoMode, PIXEL_DEPTH_1_MM, PIXEL_DEPTH_100_UM, SENSOR_DEPTH, STATUS_ERROR,
    STATUS_OK, STATUS_TIME_OUT, STREAM_HORIZONTAL_FOV, STREAM_MIRRORING, STREAM_NUMBER_OF_FRAMES,
    STREAM_VERTICAL_FOV, STREAM_VIDEO_MODE,
};
use super::library;
use super::pixels::{Layout, image};
use super::{Device, Mode, OpenNiError, WantedMode};

/// The fields of view of a device that does not tell them: those of the sensors of PrimeSense, radians.
const USUAL_VIEW: [f64; 2] = [1.0144, 0.7898];

/// How long a recording's stream rests between its stop and its end. The thread of OpenNI2 2.2 that plays recordings goes
/// through the streams without a lock, all the time while one runs, every 10 ms for an instant while none does.
const SETTLE: Duration = Duration::from_millis(50);

/// One depth image as OpenNI2 gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Counted by the device; a step of more than 1 is frames that were lost.
    pub index: i32,
    /// The device's clock, microseconds since it started, or as the driver pleases.
    pub timestamp_us: u64,
    /// What was seen. Not mirrored.
    pub image: DepthImage,
}

/// A depth stream. It is stopped when this is dropped.
pub struct DepthStream {
    device: Device,
    pub(super) handle: Handle,
    mode: Mode,
    camera: Intrinsics,
    /// The device mirrors and cannot leave that off.
    mirrored: bool,
}

// SAFETY: OpenNI2 locks its own state; a handle may be used from any thread, and this one is used by its owner only.
unsafe impl Send for DepthStream {}

impl Device {
    /// Makes the depth stream, in the mode that is wanted (a recording has one only), unmirrored where the device
    /// lets one choose. It gives frames once it is [started](DepthStream::start).
    pub fn depth(&self, wanted: Option<WantedMode>) -> Result<DepthStream, OpenNiError> {
        let uri = || self.info().uri.clone();
        let offered = self.depth_modes();
        if offered.is_empty() {
            return Err(OpenNiError::NoDepth { uri: uri() });
        }
        let mode = Mode::choose(&offered, wanted).ok_or_else(|| OpenNiError::NoMode {
            uri: uri(),
            wanted: wanted.map_or_else(String::new, |wanted| wanted.to_string()),
            offered,
        })?;
        let mut handle: Handle = ptr::null_mut();
        let api = &self.openni().api;
        // SAFETY: the device is open; the function fills the variable.
        let status =
            unsafe { (api.device_create_stream)(self.handle(), SENSOR_DEPTH, &mut handle) };
        self.openni()
            .check(status, || format!("make a depth stream of {}", uri()))?;
        let mut stream = DepthStream {
            device: self.clone(),
            handle,
            mode,
            camera: Intrinsics::from_view(mode.width, mode.height, USUAL_VIEW[0], USUAL_VIEW[1]),
            mirrored: false,
        };
        stream.set_up()?;
        Ok(stream)
    }
}

impl DepthStream {
    fn set_up(&mut self) -> Result<(), OpenNiError> {
        // While another stream of the device runs, its mode may be asked for and not be set.
        let mut video = self.mode.to_c();
        let told = self.get::<OniVideoMode>(STREAM_VIDEO_MODE, &mut video);
        let is_so = told && Mode::from_c(&video) == Some(self.mode);
        if !is_so && !self.device.is_recording() {
            self.set(STREAM_VIDEO_MODE, &self.mode.to_c())
                .map_err(|status| self.failed(status, "choose the mode"))?;
        } else if told {
            self.mode = Mode::from_c(&video).unwrap_or(self.mode);
        }
        // What cannot be switched off is undone in each frame.
        let refused = self.set(STREAM_MIRRORING, &(0 as c_int)).is_err();
        let mut mirroring: c_int = 0;
        self.mirrored = self.get(STREAM_MIRRORING, &mut mirroring) && mirroring != 0;
        if self.mirrored || refused {
            tracing::debug!(
                self.mirrored,
                "the device does not let one choose its mirroring"
            );
        }
        let mut view = [0f32; 2];
        let told = self.get(STREAM_HORIZONTAL_FOV, &mut view[0])
            && self.get(STREAM_VERTICAL_FOV, &mut view[1]);
        let sound = view.iter().all(|view| (0.1..3.0).contains(view));
        let view = match told && sound {
            true => view.map(f64::from),
            false => {
                let uri = &self.device.info().uri;
                tracing::warn!(
                    "{uri} does not tell its field of view; taken for that of a PrimeSense sensor"
                );
                USUAL_VIEW
            }
        };
        self.camera = Intrinsics::from_view(self.mode.width, self.mode.height, view[0], view[1]);
        Ok(())
    }

    /// The device that it is of.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// How it gives depth.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Its camera, from the fields of view that the device tells.
    pub fn camera(&self) -> Intrinsics {
        self.camera
    }

    /// How many frames a recording has.
    pub fn frames(&self) -> Option<u32> {
        let mut frames: c_int = 0;
        let told = self.get(STREAM_NUMBER_OF_FRAMES, &mut frames);
        u32::try_from(frames).ok().filter(|_| told)
    }

    /// Lets frames come.
    pub fn start(&self) -> Result<(), OpenNiError> {
        // SAFETY: a plain call on a stream of ours.
        let status = unsafe { (self.api().stream_start)(self.handle) };
        match status {
            STATUS_OK => Ok(()),
            status => Err(self.failed(status, "start the depth stream")),
        }
    }

    /// Ends that; the stream may be started again.
    pub fn stop(&self) {
        // SAFETY: a plain call on a stream of ours.
        unsafe { (self.api().stream_stop)(self.handle) };
    }

    /// The newest frame that was not given yet, as soon as there is one; `None`: none came in time.
    pub fn next(&self, timeout: Duration) -> Result<Option<Frame>, OpenNiError> {
        let (mut handle, mut which) = (self.handle, 0 as c_int);
        let ms = c_int::try_from(timeout.as_millis()).unwrap_or(c_int::MAX);
        // SAFETY: an array of one handle, and a variable for the index.
        let status = unsafe { (self.api().wait_for_any_stream)(&mut handle, 1, &mut which, ms) };
        match status {
            STATUS_OK => self.read().map(Some),
            STATUS_TIME_OUT => Ok(None),
            status => Err(self.failed(status, "wait for a depth frame")),
        }
    }

    fn read(&self) -> Result<Frame, OpenNiError> {
        let mut frame: *mut OniFrame = ptr::null_mut();
        // SAFETY: the function sets the pointer to a frame that is ours until it is released below.
        let status = unsafe { (self.api().stream_read_frame)(self.handle, &mut frame) };
        if status != STATUS_OK {
            return Err(self.failed(status, "read a depth frame"));
        }
        if frame.is_null() {
            return Err(self.failed(STATUS_ERROR, "read the depth frame that it said had come"));
        }
        // SAFETY: a frame of ours, with as many bytes of data as it says.
        let (read, bytes) = unsafe {
            let read = &*frame;
            let size = usize::try_from(read.data_size).unwrap_or(0);
            let bytes: &[u8] = match read.data.is_null() {
                true => &[],
                false => std::slice::from_raw_parts(read.data.cast(), size),
            };
            (read, bytes)
        };
        let frame_of_ours = Frame {
            index: read.frame_index,
            timestamp_us: read.timestamp,
            image: image(bytes, &self.layout(read)),
        };
        // SAFETY: given by `stream_read_frame`, released once; nothing above is used after this.
        unsafe { (self.api().frame_release)(frame) };
        Ok(frame_of_ours)
    }

    fn layout(&self, frame: &OniFrame) -> Layout {
        let cropped = frame.cropping_enabled != 0;
        let origin =
            [frame.crop_origin_x, frame.crop_origin_y].map(|at| if cropped { at } else { 0 });
        Layout {
            full: [self.mode.width, self.mode.height],
            size: [frame.width, frame.height].map(|side| u32::try_from(side).unwrap_or(0)),
            origin: origin.map(|at| u32::try_from(at).unwrap_or(0)),
            row_bytes: usize::try_from(frame.stride).unwrap_or(0),
            unit_um: match frame.video_mode.pixel_format {
                PIXEL_DEPTH_1_MM => 1000,
                PIXEL_DEPTH_100_UM => 100,
                _ => self.mode.unit_um,
            },
            mirrored: self.mirrored,
        }
    }

    fn api(&self) -> &super::api::Api {
        &self.device.openni().api
    }

    fn failed(&self, status: c_int, doing: &str) -> OpenNiError {
        let uri = &self.device.info().uri;
        library::failed(self.api(), status, &format!("{doing} of {uri}"))
    }

    fn set<T>(&self, property: c_int, value: &T) -> Result<(), c_int> {
        let data: *const c_void = ptr::from_ref(value).cast();
        // SAFETY: the value is as long as is said, and only read.
        let status = unsafe {
            let set = self.api().stream_set_property;
            set(self.handle, property, data, size_of::<T>() as c_int)
        };
        match status {
            STATUS_OK => Ok(()),
            status => Err(status),
        }
    }

    /// Whether the value was told; `T` is a plain C type for which any bytes are a value.
    fn get<T: Copy>(&self, property: c_int, value: &mut T) -> bool {
        let mut size = size_of::<T>() as c_int;
        let data: *mut c_void = ptr::from_mut(value).cast();
        // SAFETY: the function writes at most `size` bytes, which the value has.
        let status = unsafe {
            let get = self.api().stream_get_property;
            get(self.handle, property, data, &mut size)
        };
        status == STATUS_OK && size == size_of::<T>() as c_int
    }
}

impl Drop for DepthStream {
    fn drop(&mut self) {
        // SAFETY: made in `depth`, destroyed once below; the device is still open, for this holds it.
        unsafe { (self.api().stream_stop)(self.handle) };
        if self.device.is_recording() {
            std::thread::sleep(SETTLE);
        }
        // SAFETY: as above.
        unsafe { (self.api().stream_destroy)(self.handle) };
    }
}

impl std::fmt::Debug for DepthStream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DepthStream")
            .field("device", &self.device)
            .field("mode", &self.mode)
            .finish_non_exhaustive()
    }
}
