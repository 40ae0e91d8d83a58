//! An open simulated device.

use std::ffi::c_int;
use std::sync::{Arc, Mutex, PoisonError};

use posefuse_devices::openni::c::{
    DEVICE_DRIVER_VERSION, DEVICE_IMAGE_REGISTRATION, DEVICE_SERIAL_NUMBER, IMAGE_REGISTRATION_OFF,
    OniDeviceInfo, OniSensorInfo, OniStatus, OniVideoMode, SENSOR_DEPTH, STATUS_NOT_SUPPORTED,
    STATUS_OK, fixed,
};

use crate::outward::{PropertyNews, Theirs};
use crate::sensor::VirtualSensor;
use crate::stream::{VirtualStream, modes};

/// A property of this driver's own: when the sensor's clock showed 0, nanoseconds since 1970 by this computer's clock (8
/// bytes). With it a program can check what it makes of the sensor's times, where they do not drift.
const CLOCK_ZERO: c_int = 0x504f_0001;

/// What the device has properties of, in the order in which they are told.
const PROPERTIES: [c_int; 4] = [
    DEVICE_SERIAL_NUMBER,
    DEVICE_DRIVER_VERSION,
    DEVICE_IMAGE_REGISTRATION,
    CLOCK_ZERO,
];

/// A device as OpenNI2 holds it.
#[derive(Debug)]
pub(crate) struct VirtualDevice {
    sensor: Arc<VirtualSensor>,
    stay: u64,
    news: Mutex<Option<PropertyNews>>,
    /// What [`sensor_list`](Self::sensor_list) points to: at the same place as long as the device is open.
    list: Theirs,
    _sensors: Box<[OniSensorInfo; 1]>,
    _modes: Box<[OniVideoMode]>,
}

impl VirtualDevice {
    /// `None`: the sensor is not plugged in.
    pub(crate) fn open(sensor: &Arc<VirtualSensor>) -> Option<Self> {
        let mut modes = modes().into_boxed_slice();
        let mut sensors = Box::new([OniSensorInfo {
            sensor_type: SENSOR_DEPTH,
            num_supported_video_modes: modes.len() as c_int,
            supported_video_modes: modes.as_mut_ptr(),
        }]);
        Some(Self {
            stay: sensor.stay()?,
            sensor: sensor.clone(),
            news: Mutex::new(None),
            list: Theirs(sensors.as_mut_ptr().cast()),
            _sensors: sensors,
            _modes: modes,
        })
    }

    /// An array of `OniSensorInfo` and its length.
    pub(crate) fn sensor_list(&self) -> (*mut OniSensorInfo, c_int) {
        (self.list.0.cast(), 1)
    }

    pub(crate) fn stream(&self, sensor_type: c_int) -> Option<VirtualStream> {
        (sensor_type == SENSOR_DEPTH).then(|| VirtualStream::new(&self.sensor, self.stay))
    }

    pub(crate) fn has(property: c_int) -> bool {
        PROPERTIES.contains(&property)
    }

    /// A property's value, as C has it in memory.
    pub(crate) fn get(&self, property: c_int) -> Option<Vec<u8>> {
        match property {
            DEVICE_SERIAL_NUMBER => {
                let mut text = self.sensor.serial().into_bytes();
                text.push(0);
                Some(text)
            }
            DEVICE_DRIVER_VERSION => {
                let number = |part: &str| part.parse::<c_int>().unwrap_or(0);
                let version = [
                    number(env!("CARGO_PKG_VERSION_MAJOR")),
                    number(env!("CARGO_PKG_VERSION_MINOR")),
                    number(env!("CARGO_PKG_VERSION_PATCH")),
                    0,
                ];
                Some(version.into_iter().flat_map(c_int::to_ne_bytes).collect())
            }
            DEVICE_IMAGE_REGISTRATION => Some(IMAGE_REGISTRATION_OFF.to_ne_bytes().to_vec()),
            CLOCK_ZERO => Some(self.sensor.clock.zero_unix_ns().to_ne_bytes().to_vec()),
            _ => None,
        }
    }

    /// Nothing can be changed; that there is no registration may be said.
    pub(crate) fn set(property: c_int, value: &[u8]) -> OniStatus {
        let off = value == IMAGE_REGISTRATION_OFF.to_ne_bytes();
        match property == DEVICE_IMAGE_REGISTRATION && off {
            true => STATUS_OK,
            false => STATUS_NOT_SUPPORTED,
        }
    }

    pub(crate) fn set_property_callback(&self, news: Option<PropertyNews>) {
        *self.news.lock().unwrap_or_else(PoisonError::into_inner) = news;
    }

    pub(crate) fn tell_all(&self) {
        let news = *self.news.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(news) = news else { return };
        for property in PROPERTIES {
            if let Some(value) = self.get(property) {
                news.tell(property, &value);
            }
        }
    }
}

/// What OpenNI2 is told of a sensor.
pub(crate) fn info(sensor: &VirtualSensor) -> OniDeviceInfo {
    OniDeviceInfo {
        uri: fixed(&sensor.uri()),
        vendor: fixed("Posefuse"),
        name: fixed("simulated depth sensor"),
        usb_vendor_id: 0,
        usb_product_id: 0,
    }
}
