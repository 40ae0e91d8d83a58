//! Depth sensors on this computer's USB, looked up without any driver: what is plugged in, and why it may not work.
//!
//! Only Linux tells this (`/sys/bus/usb/devices`); elsewhere nothing is found.

use std::fs;
use std::path::{Path, PathBuf};

/// How a kind of sensor is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driver {
    /// By a driver that comes with OpenNI2.
    Comes,
    /// By a driver for OpenNI2 that somebody else makes: what it is called.
    Apart(&'static str),
    /// Not by OpenNI2: by what instead.
    Another(&'static str),
}

/// Vendor, product (`None`: all of them), what it is, how it is read. Ids from the udev rules of OpenNI2, libfreenect,
/// libfreenect2, librealsense and the Azure Kinect SDK.
#[rustfmt::skip]
const KNOWN: [(u16, Option<u16>, &str, Driver); 15] = [
    (0x1d27, None, "Xtion or Carmine (PrimeSense)", Driver::Comes),
    (0x045e, Some(0x02ae), "Kinect v1", FREENECT),
    (0x045e, Some(0x02bf), "Kinect v1 for Windows", FREENECT),
    (0x045e, Some(0x02c4), "Kinect v2", FREENECT2),
    (0x045e, Some(0x02d8), "Kinect v2", FREENECT2),
    (0x045e, Some(0x02d9), "Kinect v2", FREENECT2),
    (0x045e, Some(0x097c), "Azure Kinect", AZURE),
    (0x2bc5, None, "Orbbec sensor", Driver::Apart("Orbbec's OpenNI2 package (name its folder in OPENNI2_REDIST)")),
    (0x8086, Some(0x0ad3), "RealSense D415", REALSENSE),
    (0x8086, Some(0x0ad4), "RealSense D430", REALSENSE),
    (0x8086, Some(0x0b07), "RealSense D435", REALSENSE),
    (0x8086, Some(0x0b3a), "RealSense D435i", REALSENSE),
    (0x8086, Some(0x0b5c), "RealSense D455", REALSENSE),
    (0x8086, Some(0x0b64), "RealSense L515", REALSENSE),
    (0x8086, Some(0x0aa5), "RealSense SR300", REALSENSE),
];

/// Vendor and products of what is no depth sensor although its maker's others are: the colour cameras of Orbbec's sensors,
/// which are devices of their own beside the depth.
const NOT_DEPTH: (u16, std::ops::RangeInclusive<u16>) = (0x2bc5, 0x0500..=0x05ff);

/// Megabits a second up to which sensors of one bus get in each other's way: USB 2. USB 3 has enough for several.
const CROWDED_MBIT: u32 = 480;

const FREENECT: Driver =
    Driver::Apart("libFreenectDriver of libfreenect (on Windows Microsoft's Kinect SDK 1.8)");
const FREENECT2: Driver =
    Driver::Apart("libfreenect2-openni2 of libfreenect2 (on Windows Microsoft's Kinect SDK 2.0)");
const AZURE: Driver = Driver::Another("the Azure Kinect SDK");
const REALSENSE: Driver = Driver::Apart("rs2driver of librealsense (wrappers/openni2)");

/// Drivers of the Linux kernel that take a depth sensor for a webcam and do not let go of it, and their modules.
const IN_THE_WAY: [(&str, &str); 1] = [("kinect", "gspca_kinect")];

/// A depth sensor that is plugged in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsbSensor {
    /// What it is, e.g. "Kinect v1".
    pub model: &'static str,
    /// How it is read.
    pub driver: Driver,
    /// Vendor and product.
    pub ids: [u16; 2],
    /// The number of the USB bus that it hangs on: sensors of one bus share its bandwidth.
    pub bus: u32,
    /// Megabits a second that the bus gives it; 0 where that is not told.
    pub speed_mbit: u32,
    /// Its serial number, where it has one.
    pub serial: Option<String>,
    /// Whether this user may use it; `None`: could not be found out.
    pub permitted: Option<bool>,
    /// A kernel module that holds it.
    pub held_by: Option<String>,
}

impl UsbSensor {
    /// The line that a file under `/etc/udev/rules.d` needs, so that everybody may use sensors of this kind.
    pub fn udev_rule(&self) -> String {
        let [vendor, product] = self.ids;
        format!(
            "SUBSYSTEM==\"usb\", ATTR{{idVendor}}==\"{vendor:04x}\", ATTR{{idProduct}}==\"{product:04x}\", MODE=\"0666\""
        )
    }

    /// What keeps it from working, and what to do; `None`: nothing that can be seen from here.
    pub fn trouble(&self) -> Option<String> {
        let Self { model, .. } = self;
        if self.permitted == Some(false) {
            return Some(format!(
                "the {model} is plugged in, but this user may not use it: write the line `{}` to \
                 /etc/udev/rules.d/60-posefuse.rules, run `sudo udevadm control --reload` and plug it in again",
                self.udev_rule()
            ));
        }
        let module = self.held_by.as_ref()?;
        Some(format!(
            "the kernel's {module} holds the {model}: run `sudo modprobe -r {module}` (for good: \
             `echo 'blacklist {module}' | sudo tee /etc/modprobe.d/posefuse.conf`)"
        ))
    }
}

/// The depth sensors that are plugged in.
pub fn sensors() -> Vec<UsbSensor> {
    sensors_in(Path::new("/sys/bus/usb/devices"), Path::new("/dev/bus/usb"))
}

/// What a sensor with these USB ids is called.
pub fn model(ids: [u16; 2]) -> Option<&'static str> {
    known(ids).map(|known| known.0)
}

fn known([vendor, product]: [u16; 2]) -> Option<(&'static str, Driver)> {
    if vendor == NOT_DEPTH.0 && NOT_DEPTH.1.contains(&product) {
        return None;
    }
    let fits =
        |of: u16, which: Option<u16>| of == vendor && which.is_none_or(|which| which == product);
    let mut fitting = KNOWN.iter().filter(|(of, which, ..)| fits(*of, *which));
    fitting
        .next()
        .map(|(_, _, model, driver)| (*model, *driver))
}

/// What can be said of a device that gives no picture although it is there: words for the user, often none.
///
/// `ids`: of the device, as [`DeviceInfo::usb`](super::DeviceInfo::usb) has them; zeros where it is none of USB's.
pub fn advice(ids: [u16; 2], sensors: &[UsbSensor]) -> Option<String> {
    let mine: Vec<&UsbSensor> = sensors.iter().filter(|sensor| sensor.ids == ids).collect();
    if let Some(trouble) = mine.iter().find_map(|sensor| sensor.trouble()) {
        return Some(trouble);
    }
    let slow = |sensor: &&UsbSensor| sensor.speed_mbit <= CROWDED_MBIT;
    let on = |bus: u32| sensors.iter().filter(slow).filter(move |it| it.bus == bus);
    let mut mine = mine.into_iter().filter(slow);
    let crowded = mine.find(|sensor| on(sensor.bus).count() > 1)?;
    Some(format!(
        "several depth sensors hang on USB bus {}, whose bandwidth is enough for one: plug this one into a connector of \
         another USB controller (`lsusb -t` shows which is which)",
        crowded.bus
    ))
}

/// What can be said when OpenNI2 sees no device at all.
pub fn advice_without_device(sensors: &[UsbSensor]) -> String {
    let Some(first) = sensors.first() else {
        return "no depth sensor is plugged in, or it has no power: check its cable, and its own power supply if it \
                has one"
            .to_owned();
    };
    if let Some(trouble) = sensors.iter().find_map(UsbSensor::trouble) {
        return trouble;
    }
    let model = first.model;
    match first.driver {
        Driver::Comes => {
            format!("the {model} is plugged in, but OpenNI2 does not see it: plug it in again")
        }
        Driver::Apart(driver) => {
            format!("the {model} is plugged in, and OpenNI2 needs a driver for it: {driver}")
        }
        Driver::Another(instead) => {
            format!("the {model} is not read through OpenNI2 but through {instead}")
        }
    }
}

fn sensors_in(sys: &Path, nodes: &Path) -> Vec<UsbSensor> {
    let entries = fs::read_dir(sys).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    folders.sort();
    let found = folders.iter().filter_map(|folder| sensor(folder, nodes));
    found.collect()
}

fn sensor(folder: &Path, nodes: &Path) -> Option<UsbSensor> {
    let read = |name: &str| fs::read_to_string(folder.join(name)).ok();
    let id = |name: &str| u16::from_str_radix(read(name)?.trim(), 16).ok();
    let number = |name: &str| read(name)?.trim().parse::<u32>().ok();
    let (vendor, product) = (id("idVendor")?, id("idProduct")?);
    let (model, driver) = known([vendor, product])?;
    let (bus, device) = (number("busnum")?, number("devnum")?);
    Some(UsbSensor {
        model,
        driver,
        ids: [vendor, product],
        bus,
        speed_mbit: number("speed").unwrap_or(0),
        serial: read("serial").map(|serial| serial.trim().to_owned()),
        permitted: may_use(&nodes.join(format!("{bus:03}/{device:03}"))),
        held_by: held_by(folder),
    })
}

fn may_use(node: &Path) -> Option<bool> {
    let opened = fs::OpenOptions::new().read(true).write(true).open(node);
    match opened {
        Ok(_) => Some(true),
        Err(error) if error.kind() == std::io::ErrorKind::PermissionDenied => Some(false),
        Err(_) => None,
    }
}

/// The kernel's module on one of the device's interfaces, if it is one that gets in the way.
fn held_by(folder: &Path) -> Option<String> {
    let interfaces = fs::read_dir(folder).ok()?.flatten();
    let drivers = interfaces.filter_map(|entry| fs::read_link(entry.path().join("driver")).ok());
    let mut modules = drivers.filter_map(|link| {
        let driver = link.file_name()?.to_string_lossy().into_owned();
        IN_THE_WAY.iter().find(|(name, _)| *name == driver)
    });
    modules.next().map(|(_, module)| (*module).to_owned())
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    /// A computer's USB as the kernel shows it.
    fn plug(root: &Path, name: &str, ids: [&str; 2], address: [u32; 2]) -> PathBuf {
        let folder = root.join("sys").join(name);
        fs::create_dir_all(&folder).unwrap();
        let files = [
            ("idVendor", ids[0].to_owned()),
            ("idProduct", ids[1].to_owned()),
            ("busnum", address[0].to_string()),
            ("devnum", address[1].to_string()),
            ("speed", "480".to_owned()),
        ];
        for (file, text) in files {
            fs::write(folder.join(file), text + "\n").unwrap();
        }
        let node = root.join(format!("dev/{:03}", address[0]));
        fs::create_dir_all(&node).unwrap();
        fs::write(node.join(format!("{:03}", address[1])), "").unwrap();
        folder
    }

    fn look(root: &Path) -> Vec<UsbSensor> {
        sensors_in(&root.join("sys"), &root.join("dev"))
    }

    #[test]
    fn sensors_are_found_among_the_rest_and_their_trouble_is_told_with_its_remedy() {
        let root = tempfile::tempdir().unwrap();
        plug(root.path(), "1-1", ["046d", "c52b"], [1, 2]);
        let words = advice_without_device(&look(root.path()));
        assert!(words.contains("plugged in"), "{words}");

        let kinect = plug(root.path(), "1-2", ["045e", "02ae"], [1, 3]);
        let found = look(root.path());
        assert_eq!(found.len(), 1);
        assert_eq!(
            (found[0].model, found[0].permitted),
            ("Kinect v1", Some(true))
        );
        assert_eq!(advice(found[0].ids, &found), None);
        assert!(advice_without_device(&found).contains("libFreenectDriver"));

        let interface = kinect.join("1-2:1.0");
        fs::create_dir_all(&interface).unwrap();
        std::os::unix::fs::symlink("/sys/bus/usb/drivers/kinect", interface.join("driver"))
            .unwrap();
        let words = advice_without_device(&look(root.path()));
        assert!(words.contains("modprobe -r gspca_kinect"), "{words}");
    }

    #[test]
    fn two_sensors_on_one_bus_and_a_missing_permission_are_told() {
        let root = tempfile::tempdir().unwrap();
        plug(root.path(), "3-1", ["1d27", "0601"], [3, 4]);
        plug(root.path(), "3-2", ["2bc5", "0401"], [3, 5]);
        let mut found = look(root.path());
        let words = advice([0x1d27, 0x0601], &found).unwrap();
        assert!(
            words.contains("bus 3") && words.contains("another USB controller"),
            "{words}"
        );

        found[0].permitted = Some(false);
        let words = advice([0x1d27, 0x0601], &found).unwrap();
        let rule =
            r#"SUBSYSTEM=="usb", ATTR{idVendor}=="1d27", ATTR{idProduct}=="0601", MODE="0666""#;
        assert!(words.contains(rule), "{words}");
        assert_eq!(advice([0, 0], &found), None);
    }

    #[test]
    fn colour_cameras_are_no_depth_sensors_and_usb_3_is_not_crowded_by_two() {
        let root = tempfile::tempdir().unwrap();
        let depth = plug(root.path(), "4-1.1", ["2bc5", "0403"], [4, 2]);
        plug(root.path(), "4-1.2", ["2bc5", "0501"], [4, 3]);
        let ids = [0x2bc5, 0x0403];
        let found = look(root.path());
        assert_eq!(found.len(), 1, "the camera beside it is left out");
        assert_eq!((found[0].ids, advice(ids, &found)), (ids, None));
        assert_eq!(
            [0x04ff, 0x0500, 0x05ff, 0x0600].map(|id| model([0x2bc5, id]).is_some()),
            [true, false, false, true]
        );

        let other = plug(root.path(), "4-2", ["1d27", "0601"], [4, 4]);
        assert!(advice(ids, &look(root.path())).is_some(), "both on USB 2");
        fs::write(other.join("speed"), "5000\n").unwrap();
        let found = look(root.path());
        assert_eq!(advice(ids, &found), None, "alone on USB 2");
        assert_eq!(advice([0x1d27, 0x0601], &found), None, "on USB 3");
        fs::write(depth.join("speed"), "5000\n").unwrap();
        assert_eq!(advice(ids, &look(root.path())), None, "both on USB 3");
    }
}
