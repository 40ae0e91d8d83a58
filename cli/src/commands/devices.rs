//! `posefuse devices`: the depth sensors of this computer.

use std::path::PathBuf;

use clap::Args;
use posefuse_devices::openni::{DeviceInfo, OpenNi, OpenNiError, usb};
use serde::Serialize;

use crate::failure::Outcome;
use crate::global::Global;
use crate::output;

/// List the depth sensors of this computer, and say what keeps one from working
#[derive(Debug, Args)]
pub(crate) struct DevicesArgs {
    /// OpenNI2's library or the folder that it lies in [default: OPENNI2_REDIST, then the system's]
    #[arg(long, value_name = "PATH")]
    library: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct DevicesView {
    library: String,
    version: String,
    devices: Vec<DeviceView>,
    usb: Vec<UsbView>,
}

/// A sensor that OpenNI2 sees.
#[derive(Serialize)]
struct DeviceView {
    uri: String,
    name: String,
    serial: Option<String>,
    modes: Vec<String>,
    trouble: Option<String>,
}

/// A sensor that is plugged in, whether or not anything can read it.
#[derive(Serialize)]
struct UsbView {
    model: &'static str,
    ids: String,
    bus: u32,
    speed_mbit: u32,
    serial: Option<String>,
    trouble: Option<String>,
}

pub(crate) fn run(args: &DevicesArgs, global: &Global) -> anyhow::Result<Outcome> {
    let plugged = usb::sensors();
    let openni = match OpenNi::load(args.library.as_deref()) {
        Ok(openni) => openni,
        Err(error) => {
            // What is plugged in can be told without it.
            plugged
                .iter()
                .for_each(|sensor| output::note(describe(sensor)));
            return Err(error.into());
        }
    };
    let devices: Vec<DeviceView> = openni
        .devices()?
        .iter()
        .map(|info| view(&openni, info, &plugged))
        .collect();
    if global.json {
        output::json(&DevicesView {
            library: openni.library().display().to_string(),
            version: openni.version(),
            devices,
            usb: plugged.iter().map(usb_view).collect(),
        })?;
        return Ok(Outcome::Done);
    }
    if devices.is_empty() {
        output::line("no depth sensor")?;
        output::note(usb::advice_without_device(&plugged));
        return Ok(Outcome::Done);
    }
    let mut rows = vec![
        ["URI", "NAME", "SERIAL", "MODES"]
            .map(str::to_owned)
            .to_vec(),
    ];
    rows.extend(devices.iter().map(|device| {
        let serial = device.serial.clone().unwrap_or_else(|| "-".to_owned());
        vec![
            device.uri.clone(),
            device.name.clone(),
            serial,
            device.modes.join(" "),
        ]
    }));
    output::print_table(&rows)?;
    for device in &devices {
        if let Some(trouble) = &device.trouble {
            output::warn(&format!("{}: {trouble}", device.uri));
        }
    }
    Ok(Outcome::Done)
}

/// Opens it for a moment: serial number and modes are not told otherwise.
fn view(
    openni: &std::sync::Arc<OpenNi>,
    info: &DeviceInfo,
    plugged: &[usb::UsbSensor],
) -> DeviceView {
    let opened = openni.open_uri(&info.uri);
    let trouble = opened.as_ref().err().map(|error: &OpenNiError| {
        let advice = usb::advice(info.usb, plugged);
        let advice =
            advice.unwrap_or_else(|| "another program, or an agent, may be using it".to_owned());
        format!("{error}; {advice}")
    });
    let device = opened.ok();
    let modes = device
        .as_ref()
        .map(|device| device.depth_modes())
        .unwrap_or_default();
    DeviceView {
        uri: info.uri.clone(),
        name: usb::model(info.usb)
            .map_or_else(|| format!("{} {}", info.vendor, info.name), str::to_owned),
        serial: device.and_then(|device| device.serial()),
        modes: modes.iter().map(ToString::to_string).collect(),
        trouble,
    }
}

fn usb_view(sensor: &usb::UsbSensor) -> UsbView {
    let [vendor, product] = sensor.ids;
    UsbView {
        model: sensor.model,
        ids: format!("{vendor:04x}:{product:04x}"),
        bus: sensor.bus,
        speed_mbit: sensor.speed_mbit,
        serial: sensor.serial.clone(),
        trouble: sensor.trouble(),
    }
}

fn describe(sensor: &usb::UsbSensor) -> String {
    let trouble = sensor
        .trouble()
        .map_or_else(String::new, |trouble| format!("; {trouble}"));
    format!(
        "a {} is plugged in at USB bus {}{trouble}",
        sensor.model, sensor.bus
    )
}
