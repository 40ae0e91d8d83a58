//! Azure Kinect (and Orbbec's Femto, whose maker gives libraries with the same functions) with Microsoft's Body Tracking SDK
//! 1.1: 32 joints of the joint set `azure-kinect`.
//!
//! Its axes are the depth camera's optical ones: x right, y down, z forward; millimetres become metres here. Confidence is
//! a level: none (out of range) is a missing joint, low (hidden, predicted) 0.5, medium 0.9, high 1.
//!
//! Not verified with the real libraries.
#![allow(unsafe_code, reason = "calls the C functions of k4a and k4abt")]

mod c;
mod error;
mod options;

use std::ptr;
use std::time::{Duration, Instant};

use posefuse_skeleton::{Confidence, Position, RawJoint};

use self::c::{Calibration, DeviceConfig, Handle, JOINTS, Skeleton, TIMEOUT, TrackerConfig};
use crate::find;

pub use error::{AzureError, HOW_TO_INSTALL};
pub use options::{DepthMode, Options, Processing};

/// Names of the libraries.
#[cfg(target_os = "windows")]
const NAMES: [&[&str]; 2] = [&["k4a.dll"], &["k4abt.dll"]];
#[cfg(not(target_os = "windows"))]
const NAMES: [&[&str]; 2] = [
    &["libk4a.so.1.4", "libk4a.so"],
    &["libk4abt.so.1.1", "libk4abt.so"],
];

/// Variables that name the folder of each.
const FOLDERS: [&[&str]; 2] = [
    &["K4A_LIBRARY_PATH"],
    &["K4ABT_LIBRARY_PATH", "K4A_LIBRARY_PATH"],
];

/// One person.
#[derive(Clone, Debug, PartialEq)]
pub struct AzureBody {
    /// The tracker's number.
    pub id: u64,
    /// In the order of the joint set `azure-kinect`, optical axes.
    pub joints: [Option<RawJoint>; JOINTS],
    /// Unit quaternions x y z w, of the joint's axes in the depth camera's; zeros where the joint is missing.
    pub orientations: [[f32; 4]; JOINTS],
}

/// Everybody at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct AzureFrame {
    /// The device's clock.
    pub timestamp_us: u64,
    /// Who.
    pub bodies: Vec<AzureBody>,
}

/// One device with its tracker.
pub struct AzureTracker {
    sensor: c::sensor::Api,
    tracking: c::tracker::Api,
    device: Handle,
    tracker: Handle,
    serial: String,
    /// The tracker has a depth image whose result was not taken yet. It is given one at a time: it would queue more, and
    /// what it cannot keep up with would come out ever later.
    in_flight: bool,
}

// SAFETY: used by one thread at a time, for reading takes it mutably; the handles are bound to no thread.
unsafe impl Send for AzureTracker {}

impl AzureTracker {
    /// Loads the libraries, opens a device and starts it.
    pub fn open(options: &Options) -> Result<Self, AzureError> {
        let folder = options.folder.as_deref();
        let load = |which: usize, what| {
            find::find(folder, FOLDERS[which], NAMES[which])
                .map_err(|tried| AzureError::Missing { what, tried })
        };
        let found = load(0, "the Azure Kinect Sensor SDK")?;
        let sensor = c::sensor::Api::of(found.library).map_err(|missing| AzureError::NotIt {
            library: found.path,
            missing,
        })?;
        let found = load(1, "the Azure Kinect Body Tracking SDK")?;
        let tracking = c::tracker::Api::of(found.library).map_err(|missing| AzureError::NotIt {
            library: found.path,
            missing,
        })?;
        let (device, serial) = open_device(&sensor, options.device.as_deref())?;
        let mut this = Self {
            sensor,
            tracking,
            device,
            tracker: ptr::null_mut(),
            serial,
            in_flight: false,
        };
        this.start(options)?;
        Ok(this)
    }

    /// The device's serial number.
    pub fn serial(&self) -> &str {
        &self.serial
    }

    fn start(&mut self, options: &Options) -> Result<(), AzureError> {
        let config = DeviceConfig {
            color_format: 0,
            color_resolution: 0,
            depth_mode: options.depth_mode.number(),
            // 30 a second.
            fps: 2,
            synchronized_images_only: false,
            depth_delay_off_color_us: 0,
            wired_sync_mode: 0,
            subordinate_delay_off_master_us: 0,
            disable_streaming_indicator: false,
        };
        // SAFETY: all zero bits are a value of this plain structure.
        let mut calibration: Calibration = unsafe { std::mem::zeroed() };
        let tracker_config = TrackerConfig {
            sensor_orientation: 0,
            processing_mode: options.processing.number(),
            gpu_device_id: 0,
            model_path: ptr::null(),
        };
        // SAFETY: the device is open; the structures live through the calls and are the libraries' own kinds.
        unsafe {
            let mode = options.depth_mode.number();
            if (self.sensor.calibration)(self.device, mode, 0, &mut calibration) != 0 {
                return Err(call(
                    "read the calibration",
                    "unplug the sensor and plug it in again",
                ));
            }
            if (self.tracking.create)(&calibration, tracker_config, &mut self.tracker) != 0 {
                self.tracker = ptr::null_mut();
                let advice = "are its model (dnn_model_2_0_op11.onnx) and ONNX Runtime beside it, and is there a graphics \
                    card? Try --processing cpu";
                return Err(call("start the body tracker", advice));
            }
            // Its own smoothing only delays what the room smooths better.
            (self.tracking.set_smoothing)(self.tracker, 0.0);
            if (self.sensor.start)(self.device, &config) != 0 {
                let advice =
                    "does another program have it, and is it on USB 3 with its own power supply?";
                return Err(call("start the depth camera", advice));
            }
        }
        Ok(())
    }

    /// The next frame that is tracked, or `None` where there was none within `timeout`. A tracker slower than the device
    /// gets the newest depth image each time; those between are left out. An error means that the device is gone: open it
    /// again.
    pub fn read(&mut self, timeout: Duration) -> Result<Option<AzureFrame>, AzureError> {
        let begun = Instant::now();
        let left_ms = || {
            let left = timeout.saturating_sub(begun.elapsed());
            i32::try_from(left.as_millis()).unwrap_or(i32::MAX)
        };
        let failed = || call("track people", "is the graphics card busy or gone?");
        if !self.in_flight {
            let Some(capture) = self.newest(left_ms())? else {
                return Ok(None);
            };
            // SAFETY: the tracker lives as long as `self`; the capture is released once, the tracker keeps its own count.
            let queued = unsafe {
                let queued = (self.tracking.enqueue)(self.tracker, capture, left_ms());
                (self.sensor.release)(capture);
                queued
            };
            match queued {
                0 => self.in_flight = true,
                TIMEOUT => return Ok(None),
                _ => return Err(failed()),
            }
        }
        let mut frame: Handle = ptr::null_mut();
        // SAFETY: as above; the frame is released below.
        match unsafe { (self.tracking.pop)(self.tracker, &mut frame, left_ms()) } {
            0 => self.in_flight = false,
            TIMEOUT => return Ok(None),
            _ => return Err(failed()),
        }
        // SAFETY: given by `pop`, used until it is released here, once.
        unsafe {
            let bodies =
                (0..(self.tracking.bodies)(frame)).filter_map(|index| self.body(frame, index));
            let read = AzureFrame {
                timestamp_us: (self.tracking.timestamp)(frame),
                bodies: bodies.collect(),
            };
            (self.tracking.release)(frame);
            Ok(Some(read))
        }
    }

    /// The newest depth image, which the caller releases; older ones that wait are passed over. `None`: there was none
    /// within `wait_ms`.
    fn newest(&self, wait_ms: i32) -> Result<Option<Handle>, AzureError> {
        let (mut newest, mut wait_ms) = (None, wait_ms);
        loop {
            let mut capture: Handle = ptr::null_mut();
            // SAFETY: the device lives as long as `self`; the handle is filled in.
            let status = unsafe { (self.sensor.capture)(self.device, &mut capture, wait_ms) };
            if status == TIMEOUT {
                return Ok(newest);
            }
            if let Some(older) = newest.take() {
                // SAFETY: given by `capture`, released once, not used any more.
                unsafe { (self.sensor.release)(older) };
            }
            if status != 0 {
                return Err(call(
                    "give a depth image",
                    "has the sensor been pulled out?",
                ));
            }
            newest = Some(capture);
            wait_ms = 0;
        }
    }

    fn body(&self, frame: Handle, index: u32) -> Option<AzureBody> {
        let mut skeleton = Skeleton::default();
        // SAFETY: the frame is the caller's and not yet released; the skeleton is filled in.
        let (status, id) = unsafe {
            let status = (self.tracking.skeleton)(frame, index, &mut skeleton);
            (status, (self.tracking.id)(frame, index))
        };
        (status == 0).then(|| AzureBody {
            id: u64::from(id),
            joints: skeleton.joints.map(|joint| raw_joint(&joint)),
            orientations: skeleton.joints.map(|joint| {
                let [w, x, y, z] = joint.orientation;
                match raw_joint(&joint) {
                    Some(_) => [x, y, z, w],
                    None => [0.0; 4],
                }
            }),
        })
    }
}

impl Drop for AzureTracker {
    fn drop(&mut self) {
        // SAFETY: opened here, not used after this; the tracker goes before the device.
        unsafe {
            if !self.tracker.is_null() {
                (self.tracking.shutdown)(self.tracker);
                (self.tracking.destroy)(self.tracker);
            }
            (self.sensor.stop)(self.device);
            (self.sensor.close)(self.device);
        }
    }
}

fn call(doing: &'static str, advice: &'static str) -> AzureError {
    AzureError::Call { doing, advice }
}

fn raw_joint(joint: &c::Joint) -> Option<RawJoint> {
    let confidence = match joint.confidence {
        1 => 0.5,
        2 => 0.9,
        3.. => 1.0,
        _ => return None,
    };
    let [x, y, z] = joint.position_mm.map(|mm| f64::from(mm) / 1000.0);
    Some(RawJoint {
        position: Position::new(x, y, z),
        confidence: Confidence::saturating(confidence),
    })
}

/// Opens the device with this serial number or number; without one the first.
fn open_device(
    sensor: &c::sensor::Api,
    wanted: Option<&str>,
) -> Result<(Handle, String), AzureError> {
    // SAFETY: a plain call.
    let count = unsafe { (sensor.count)() };
    let mut present = Vec::new();
    for index in 0..count {
        let mut device: Handle = ptr::null_mut();
        // SAFETY: the handle is filled in. A device that another program has does not open.
        if unsafe { (sensor.open)(index, &mut device) } != 0 {
            present.push(format!("{index}: in use"));
            continue;
        }
        let serial = serial_of(sensor, device);
        if wanted.is_none_or(|wanted| wanted == serial || wanted == index.to_string()) {
            return Ok((device, serial));
        }
        // SAFETY: opened above, not used any more.
        unsafe { (sensor.close)(device) };
        present.push(format!("{index}: {serial}"));
    }
    Err(AzureError::NoDevice {
        wanted: wanted.unwrap_or("any").to_owned(),
        present: match present.is_empty() {
            true => "none".to_owned(),
            false => present.join(", "),
        },
    })
}

fn serial_of(sensor: &c::sensor::Api, device: Handle) -> String {
    let mut text = [0_u8; 64];
    let mut size = text.len();
    // SAFETY: the buffer is as long as its size says.
    let status = unsafe { (sensor.serial)(device, text.as_mut_ptr().cast(), &mut size) };
    let text = if status == 0 { &text[..] } else { &[] };
    let end = text
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(text.len());
    String::from_utf8_lossy(&text[..end]).into_owned()
}
