//! Depth sensors of this computer, and what reads them.

use posefuse_devices::openni::{HOW_TO_INSTALL, OpenNi, OpenNiError, usb};

use super::Finding;

/// No device is opened: an agent may be reading it.
pub(super) fn examine() -> Vec<Finding> {
    let plugged = usb::sensors();
    let mut findings = vec![openni(&plugged)];
    for sensor in &plugged {
        let what = format!("USB bus {}", sensor.bus);
        let crowded = || usb::advice(sensor.ids, &plugged);
        findings.push(match sensor.trouble().or_else(crowded) {
            Some(trouble) => Finding::doubtful(what, sensor.model, trouble),
            None => Finding::good(
                what,
                format!("{}, {} Mbit/s", sensor.model, sensor.speed_mbit),
            ),
        });
    }
    findings
}

fn openni(plugged: &[usb::UsbSensor]) -> Finding {
    let what = "OpenNI2";
    let openni = match OpenNi::load(None) {
        Ok(openni) => openni,
        // A computer without a sensor does not need it.
        Err(OpenNiError::Missing { .. }) if plugged.is_empty() => {
            return Finding::unknown(what, "not installed, and no depth sensor is plugged in");
        }
        Err(OpenNiError::Missing { .. }) => {
            return Finding::doubtful(what, "not installed", HOW_TO_INSTALL);
        }
        Err(error) => return Finding::bad(what, error.to_string(), HOW_TO_INSTALL),
    };
    let version = openni.version();
    match openni.devices() {
        Ok(devices) if devices.is_empty() && plugged.is_empty() => {
            Finding::good(what, format!("{version}; no depth sensor is plugged in"))
        }
        Ok(devices) if devices.is_empty() => {
            let found = format!("{version}; it sees no device");
            Finding::doubtful(what, found, usb::advice_without_device(plugged))
        }
        Ok(devices) => {
            let uris: Vec<&str> = devices.iter().map(|device| device.uri.as_str()).collect();
            Finding::good(what, format!("{version}; it sees {}", uris.join(", ")))
        }
        Err(error) => Finding::bad(what, error.to_string(), "plug the sensors in again"),
    }
}
