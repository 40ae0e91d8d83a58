//! A sensor on this computer: found, opened, read, missed when it is pulled out and taken up again when it is back.

use std::sync::Arc;
use std::time::{Duration, Instant};

use posefuse_devices::openni::{
    DepthStream, Device, DeviceEvent, DeviceInfo, OpenNi, OpenNiError, WantedMode, usb,
};
use posefuse_skeleton::{AgentTime, Intrinsics};

use crate::Clock;
use crate::source::device_clock::DeviceClock;
use crate::source::{DepthFrame, DepthSource, SourceError};

/// How long a frame is waited for before it is looked whether the device is still there.
const FRAME: Duration = Duration::from_millis(250);
/// A device that gives nothing for this long is started anew.
const SILENT: Duration = Duration::from_secs(5);
/// How long news of a missing device are waited for before its trouble is told again.
const AWAY: Duration = Duration::from_secs(2);
/// Lost frames are told of at most this often.
const TELL_LOSS: Duration = Duration::from_secs(10);
/// What a sensor is taken for until it is there: the view of most that OpenNI2 reads, radians.
const USUAL: (u32, u32, f64, f64) = (320, 240, 1.0144, 0.7898);

/// One sensor.
pub(super) struct DeviceSource {
    openni: Arc<OpenNi>,
    clock: Arc<dyn Clock>,
    wanted: Option<String>,
    mode: Option<WantedMode>,
    /// The device that it was before, which it must be again.
    known: Option<Known>,
    open: Option<Open>,
    camera: Intrinsics,
}

/// What a device is recognised by.
#[derive(Clone, Debug)]
struct Known {
    info: DeviceInfo,
    serial: Option<String>,
}

/// A device that gives frames.
struct Open {
    stream: DepthStream,
    times: DeviceClock,
    /// The number of its newest frame, and how many were missing in between.
    last: Option<i32>,
    lost: u64,
    told: Instant,
    heard: Instant,
}

impl DeviceSource {
    /// Opens the sensor if it is there; if not, it is waited for.
    ///
    /// # Errors
    /// The mode that is wanted is none of the device's, or it gives no depth.
    pub(super) fn new(
        openni: Arc<OpenNi>,
        wanted: Option<String>,
        mode: Option<WantedMode>,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, SourceError> {
        let (width, height, horizontal, vertical) = USUAL;
        let mut source = Self {
            openni,
            clock,
            wanted,
            mode,
            known: None,
            open: None,
            camera: Intrinsics::from_view(width, height, horizontal, vertical),
        };
        match source.take_up() {
            Err(SourceError::Trouble(why)) => tracing::warn!("{why}"),
            other => other?,
        }
        Ok(source)
    }

    /// Opens the device and starts it.
    fn take_up(&mut self) -> Result<(), SourceError> {
        // News from before say nothing about a device that is opened after them.
        while self.openni.next_event(Duration::ZERO).is_some() {}
        let device = self.find().map_err(|error| self.explained(&error))?;
        let stream = device
            .depth(self.mode)
            .map_err(|error| self.explained(&error))?;
        stream.start().map_err(|error| self.explained(&error))?;
        let (info, serial) = (device.info().clone(), device.serial());
        self.camera = stream.camera();
        let serial_shown = serial.as_deref().unwrap_or("none");
        tracing::info!(uri = info.uri, serial = serial_shown, mode = %stream.mode(), "reading {}", name(&info));
        self.known = Some(Known { info, serial });
        let now = Instant::now();
        self.open = Some(Open {
            stream,
            times: DeviceClock::default(),
            last: None,
            lost: 0,
            told: now,
            heard: now,
        });
        Ok(())
    }

    /// The device that was there before; at first the one that is wanted, or the first that can be opened.
    fn find(&self) -> Result<Device, OpenNiError> {
        let present = self.openni.devices()?;
        if let Some(known) = &self.known {
            return self.find_again(known, &present);
        }
        if self.wanted.is_some() || present.is_empty() {
            return self.openni.open(self.wanted.as_deref());
        }
        if present.len() > 1 {
            let uris: Vec<&str> = present.iter().map(|info| info.uri.as_str()).collect();
            tracing::warn!(
                "there are several sensors ({}); say which with --device",
                uris.join(", ")
            );
        }
        let mut last = None;
        for info in &present {
            match self.openni.open_uri(&info.uri) {
                Ok(device) => return Ok(device),
                Err(error) => last = Some(error),
            }
        }
        last.map_or_else(|| self.openni.open(None), Err)
    }

    /// A USB device comes back under another address, so its serial number counts; a sensor that has none is known by
    /// its address, then by being the only one of its kind.
    fn find_again(&self, known: &Known, present: &[DeviceInfo]) -> Result<Device, OpenNiError> {
        let alike =
            |info: &&DeviceInfo| (info.usb, &info.name) == (known.info.usb, &known.info.name);
        let mut candidates: Vec<&DeviceInfo> = present.iter().filter(alike).collect();
        candidates.sort_by_key(|info| info.uri != known.info.uri);
        if known.serial.is_none() {
            let same = candidates
                .first()
                .is_some_and(|info| info.uri == known.info.uri);
            candidates.truncate(if same || candidates.len() == 1 { 1 } else { 0 });
        }
        let mut failed = None;
        for info in candidates {
            match self.openni.open_uri(&info.uri) {
                Ok(device) if known.serial.is_none() || device.serial() == known.serial => {
                    return Ok(device);
                }
                Ok(_) => {}
                Err(error) => failed = Some(error),
            }
        }
        Err(failed.unwrap_or_else(|| OpenNiError::NoDevice {
            wanted: known
                .serial
                .clone()
                .unwrap_or_else(|| known.info.uri.clone()),
            present: present.iter().map(|info| info.uri.clone()).collect(),
        }))
    }

    fn explained(&self, error: &OpenNiError) -> SourceError {
        explained(error, self.known.as_ref())
    }

    /// Waits for news of devices, then tries again.
    fn wait_for_it(&mut self) -> Result<(), SourceError> {
        let until = Instant::now() + AWAY;
        loop {
            match self.take_up() {
                Err(SourceError::Trouble(why)) if Instant::now() >= until => {
                    return Err(SourceError::Trouble(why));
                }
                Err(SourceError::Trouble(_)) => {}
                other => return other,
            }
            let left = until.saturating_duration_since(Instant::now());
            self.openni.next_event(left);
        }
    }

    /// The device was pulled out, or might as well have been.
    fn gone(&mut self, why: &str) -> SourceError {
        self.open = None;
        let what = self
            .known
            .as_ref()
            .map_or("the sensor".to_owned(), |known| name(&known.info));
        SourceError::Trouble(format!("{what} {why}"))
    }

    fn pulled_out(&self) -> bool {
        let mut gone = false;
        while let Some(event) = self.openni.next_event(Duration::ZERO) {
            if let (DeviceEvent::Disconnected(info), Some(known)) = (event, &self.known) {
                gone |= info.uri == known.info.uri;
            }
        }
        gone
    }
}

impl DepthSource for DeviceSource {
    fn model(&self) -> String {
        match &self.known {
            Some(known) => format!("{} (OpenNI2)", name(&known.info)),
            None => "depth sensor (OpenNI2)".to_owned(),
        }
    }

    fn intrinsics(&self) -> Intrinsics {
        self.camera
    }

    fn next_frame(&mut self) -> Result<Option<DepthFrame>, SourceError> {
        if self.open.is_none() {
            self.wait_for_it()?;
        }
        loop {
            if self.pulled_out() {
                return Err(self.gone("was pulled out: plug it in again"));
            }
            let Some(open) = &mut self.open else {
                return Err(self.gone("is not open"));
            };
            match open.stream.next(FRAME) {
                Ok(Some(frame)) => {
                    let captured_ns =
                        open.took(frame.index, frame.timestamp_us, self.clock.monotonic_ns());
                    return Ok(Some(DepthFrame {
                        captured: AgentTime::from_ns(captured_ns),
                        due_ns: None,
                        image: frame.image,
                    }));
                }
                Ok(None) if open.heard.elapsed() < SILENT => {}
                Ok(None) => {
                    let ids = self.known.as_ref().map_or([0; 2], |known| known.info.usb);
                    let advice = usb::advice(ids, &usb::sensors());
                    let advice = advice.unwrap_or_else(|| {
                        "it is started anew; if that does not help, plug it in again".to_owned()
                    });
                    return Err(self.gone(&format!("gives no images: {advice}")));
                }
                Err(error) if error.no_device() => {
                    return Err(self.gone("is gone: plug it in again"));
                }
                Err(error) => {
                    let explained = self.explained(&error);
                    self.open = None;
                    return Err(explained);
                }
            }
        }
    }
}

impl Open {
    /// When a frame was captured, agent's clock, ns.
    fn took(&mut self, index: i32, timestamp_us: u64, arrived_ns: i64) -> i64 {
        self.heard = Instant::now();
        let step = self
            .last
            .map_or(1, |last| i64::from(index) - i64::from(last));
        self.last = Some(index);
        self.lost += u64::try_from(step - 1).unwrap_or(0);
        if self.lost > 0 && self.told.elapsed() >= TELL_LOSS {
            tracing::warn!("{} images of the sensor were lost on their way", self.lost);
            (self.lost, self.told) = (0, self.heard);
        }
        let device_ns = i64::try_from(timestamp_us)
            .unwrap_or(i64::MAX)
            .saturating_mul(1000);
        self.times.captured_ns(device_ns, arrived_ns)
    }
}

/// An error with what can be done about it. What the device does not offer is final unless it has offered it before: a
/// device that is just coming up may not say all yet.
fn explained(error: &OpenNiError, known: Option<&Known>) -> SourceError {
    let sensors = usb::sensors();
    let ids = known.map_or([0; 2], |known| known.info.usb);
    let advice = match (error, known) {
        (OpenNiError::NoMode { .. } | OpenNiError::NoDepth { .. }, None) => {
            return SourceError::Final(error.to_string());
        }
        (
            OpenNiError::NoMode { .. } | OpenNiError::NoDepth { .. } | OpenNiError::NoDevice { .. },
            Some(_),
        ) => "plug it in again".to_owned(),
        (OpenNiError::NoDevice { present, .. }, None) if present.is_empty() => {
            usb::advice_without_device(&sensors)
        }
        (OpenNiError::NoDevice { .. }, None) => "name one of them with --device".to_owned(),
        _ => {
            let trouble = || sensors.iter().find_map(usb::UsbSensor::trouble);
            let advice = usb::advice(ids, &sensors).or_else(trouble);
            advice.unwrap_or_else(|| "another program may be using it: end that one".to_owned())
        }
    };
    SourceError::Trouble(format!("{error}; {advice}"))
}

/// What a user calls it.
fn name(info: &DeviceInfo) -> String {
    let known = usb::model(info.usb).map(str::to_owned);
    known.unwrap_or_else(|| match info.vendor.is_empty() {
        true => info.name.clone(),
        false => format!("{} {}", info.vendor, info.name),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_that_is_not_offered_is_final_only_of_a_device_that_never_offered_it() {
        let uri = "1d27/0601@1/5".to_owned();
        let known = Known {
            info: DeviceInfo {
                uri: uri.clone(),
                vendor: "PrimeSense".into(),
                name: "PS1080".into(),
                usb: [0x1d27, 0x0601],
            },
            serial: None,
        };
        let depth = OpenNiError::NoDepth { uri: uri.clone() };
        let mode = OpenNiError::NoMode {
            uri,
            wanted: "320x240@60".into(),
            offered: Vec::new(),
        };
        for error in [depth, mode] {
            assert!(matches!(explained(&error, None), SourceError::Final(_)));
            let again = explained(&error, Some(&known));
            assert!(matches!(again, SourceError::Trouble(why) if why.contains("plug it in again")));
        }
    }
}
