//! The task that owns the monitor.

use std::sync::Arc;
use std::time::Duration;

use posefuse_calibration::{DriftMonitor, DriftOptions, SensorDrift};
use posefuse_session::Event;
use posefuse_skeleton::{Calibration, SensorId};
use tokio::sync::mpsc;

use super::recent::Recent;
use super::tap::{Seen, newly_missed};
use super::{Config, Missed, words};
use crate::room::Room;

/// Between two looks: an alarm takes two that agree.
const BEAT: Duration = Duration::from_secs(1);

/// Runs until the server stops.
pub(crate) async fn watch(room: Arc<Room>, mut seen: mpsc::Receiver<Seen>, missed: Missed) {
    let mut watch = Watch {
        monitor: DriftMonitor::new(options(&room.config.drift)),
        in_force: None,
        sensors: 0,
        alarmed: Vec::new(),
        recording: false,
        room: room.clone(),
    };
    let mut known_missed = 0;
    let mut beat = room.clock.sleep(BEAT);
    loop {
        tokio::select! {
            biased;
            () = room.stop.cancelled() => return,
            () = &mut beat => {
                watch.look().await;
                if let Some(new) = newly_missed(&missed, &mut known_missed) {
                    tracing::debug!(new, "comparisons found no room in the queue of the drift watch");
                }
                beat = room.clock.sleep(BEAT);
            }
            received = seen.recv() => match received {
                Some(Seen::Comparison(comparison)) => watch.monitor.add(*comparison),
                Some(Seen::Frame(sensor, frame)) => room.drift.recent().add(sensor, frame),
                None => return,
            }
        }
    }
}

fn options(config: &Config) -> DriftOptions {
    DriftOptions {
        alarm_m: config.alarm_mm * 1e-3,
        alarm_rad: config.alarm_deg.to_radians(),
        ..DriftOptions::default()
    }
}

struct Watch {
    room: Arc<Room>,
    monitor: DriftMonitor,
    in_force: Option<Arc<Calibration>>,
    /// How many sensors there were at the last look.
    sensors: usize,
    /// Whose alarms have been told.
    alarmed: Vec<SensorId>,
    /// Whether a take ran at the last look.
    recording: bool,
}

impl Watch {
    async fn look(&mut self) {
        let room = self.room.clone();
        let now = room.clock.now();
        room.drift.recent().forget_before(Recent::start(now));
        self.follow_calibration();
        let mut monitor = std::mem::take(&mut self.monitor);
        let looking = room.threads.blocking(move || {
            let found = monitor.look(now);
            (monitor, found)
        });
        let Ok((monitor, found)) = looking.await else {
            tracing::error!(
                "a look at the sensors' places failed: what was learnt of them is lost"
            );
            self.monitor = DriftMonitor::new(options(&room.config.drift));
            self.in_force = None;
            return;
        };
        self.monitor = monitor;
        let recording = room.takes.is_recording();
        if recording && !self.recording {
            // A take that begins with a sensor out of place is to say so, too.
            self.alarmed.clear();
        }
        self.recording = recording;
        for drift in &found {
            self.tell(drift);
        }
        self.alarmed.retain(|sensor| {
            let is_seen = found.iter().find(|drift| drift.sensor == *sensor);
            is_seen.is_none_or(|drift| drift.alarm)
        });
        room.drift.set(&found);
    }

    /// Tells the monitor where the sensors stand, when that or the sensors have changed.
    fn follow_calibration(&mut self) {
        let current = self.room.calibration.current();
        let sensors = self.room.registry.sensors();
        let is_same = match (&current, &self.in_force) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        if is_same && sensors.len() == self.sensors {
            return;
        }
        let poses = sensors.iter().filter_map(|sensor| {
            let pose = current.as_ref()?.sensors.get(sensor.name())?;
            Some((sensor.id(), pose))
        });
        self.monitor.place(poses);
        if !is_same {
            self.alarmed.clear();
            self.room.drift.forget();
        }
        self.sensors = sensors.len();
        self.in_force = current;
    }

    /// Notes a new alarm, in the log and in the running take.
    fn tell(&mut self, drift: &SensorDrift) {
        if !drift.alarm || self.alarmed.contains(&drift.sensor) {
            return;
        }
        self.alarmed.push(drift.sensor);
        let registry = &self.room.registry;
        let name = registry.name(drift.sensor);
        let text = words::what(drift, &name, |other| registry.name(other));
        tracing::warn!(sensor = name, "{text}");
        self.room.takes.event(Event {
            time_ns: self.room.clock.now().ns(),
            kind: "sensor-moved".to_owned(),
            sensor: name,
            text,
            ..Event::default()
        });
    }
}
