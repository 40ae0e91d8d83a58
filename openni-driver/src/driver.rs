//! The driver: its sensors, and the thread that sees what is plugged in.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use posefuse_simulator::World;

use crate::control::{Control, ControlError, VARIABLE};
use crate::device::{VirtualDevice, info};
use crate::outward::DeviceNews;
use crate::sensor::{SensorTime, VirtualSensor};

/// How often the control file is looked at.
const LOOK: Duration = Duration::from_millis(50);

/// The driver once OpenNI2 has started it.
#[derive(Debug)]
pub(crate) struct Driver {
    sensors: Vec<Arc<VirtualSensor>>,
    /// Dropped, it ends the watcher.
    end: Option<SyncSender<()>>,
    watcher: Option<JoinHandle<()>>,
}

impl Driver {
    /// Reads the control file that POSEFUSE_VIRTUAL names and tells OpenNI2 of the sensors that are plugged in.
    pub(crate) fn start(news: DeviceNews) -> Result<Self, ControlError> {
        let file = std::env::var_os(VARIABLE).map(PathBuf::from);
        let control = match &file {
            Some(file) => Control::read(file)?,
            None => Control::default(),
        };
        let world = World::new(&control.scenario).map_err(|why| ControlError {
            file: file.clone().unwrap_or_default(),
            why: why.to_string(),
        })?;
        let (world, clock) = (Arc::new(world), SensorTime::starting_now(control.drift_ppm));
        let sensor = |index| Arc::new(VirtualSensor::new(index, &world, clock, &control));
        let sensors: Vec<Arc<VirtualSensor>> = (0..world.sensor_count()).map(sensor).collect();
        plug(&sensors, &control, &news);
        let mut driver = Self {
            sensors,
            end: None,
            watcher: None,
        };
        if let Some(file) = file {
            driver.watch(file, news);
        }
        Ok(driver)
    }

    fn watch(&mut self, file: PathBuf, news: DeviceNews) {
        let (end, ended) = sync_channel::<()>(0);
        let sensors = self.sensors.clone();
        let look = move || {
            let mut last = std::fs::read(&file).ok();
            while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                let now = std::fs::read(&file).ok();
                if now != last {
                    replug(&sensors, &file, &news);
                    last = now;
                }
            }
        };
        let thread = thread::Builder::new()
            .name("virtual-plugs".into())
            .spawn(look);
        self.watcher = thread.ok();
        self.end = Some(end);
    }

    /// Opens a device by its URI.
    pub(crate) fn open(&self, uri: &str) -> Option<VirtualDevice> {
        VirtualDevice::open(self.sensor(uri)?)
    }

    /// Whether there is such a device now.
    pub(crate) fn has(&self, uri: &str) -> bool {
        self.sensor(uri)
            .is_some_and(|sensor| sensor.stay().is_some())
    }

    fn sensor(&self, uri: &str) -> Option<&Arc<VirtualSensor>> {
        self.sensors.iter().find(|sensor| sensor.uri() == uri)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(watcher) = self.watcher.take() {
            // A watcher that panicked has ended, too.
            let _ = watcher.join();
        }
    }
}

/// A file that does not do changes nothing: it may be half written.
fn replug(sensors: &[Arc<VirtualSensor>], file: &Path, news: &DeviceNews) {
    match Control::read(file) {
        Ok(control) => plug(sensors, &control, news),
        Err(error) => eprintln!("posefuse's virtual sensors stay as they are: {error}"),
    }
}

fn plug(sensors: &[Arc<VirtualSensor>], control: &Control, news: &DeviceNews) {
    for sensor in sensors {
        let inside = control.has(sensor.index);
        if sensor.plug(inside) {
            news.tell(&info(sensor), inside);
        }
    }
}
