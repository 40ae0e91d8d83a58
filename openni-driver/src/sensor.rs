//! One simulated sensor: what it sees when, by which clock, and whether it is plugged in.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use posefuse_simulator::World;

use crate::control::Control;

/// Frames a second.
pub(crate) const FPS: u32 = 30;

/// A sensor, plugged in or not.
#[derive(Debug)]
pub(crate) struct VirtualSensor {
    /// Its number in the room.
    pub(crate) index: usize,
    pub(crate) world: Arc<World>,
    pub(crate) clock: SensorTime,
    /// Counts how often it was plugged in and pulled out: odd is in.
    plugs: AtomicU64,
    pub(crate) delay: Duration,
    pub(crate) jitter: Duration,
    pub(crate) repeat_frames: usize,
}

impl VirtualSensor {
    pub(crate) fn new(
        index: usize,
        world: &Arc<World>,
        clock: SensorTime,
        control: &Control,
    ) -> Self {
        Self {
            index,
            world: world.clone(),
            clock,
            plugs: AtomicU64::new(0),
            delay: Duration::from_secs_f64(control.delay_ms * 1e-3),
            jitter: Duration::from_secs_f64(control.jitter_ms * 1e-3),
            repeat_frames: (control.repeat_s * f64::from(FPS)).round() as usize,
        }
    }

    pub(crate) fn uri(&self) -> String {
        format!("posefuse://{}", self.index)
    }

    pub(crate) fn serial(&self) -> String {
        format!("posefuse-{}", self.index)
    }

    /// Plugs it in or pulls it out; `false` if it was so already.
    pub(crate) fn plug(&self, inside: bool) -> bool {
        let changes = (self.plugs.load(Ordering::Acquire) % 2 == 1) != inside;
        if changes {
            self.plugs.fetch_add(1, Ordering::AcqRel);
        }
        changes
    }

    /// The number of this stay in the connector; `None`: it is pulled out.
    pub(crate) fn stay(&self) -> Option<u64> {
        Some(self.plugs.load(Ordering::Acquire)).filter(|plugs| plugs % 2 == 1)
    }
}

/// The clock of the sensors of a room. It shows microseconds since the driver started, as those of real sensors do:
/// OpenNI2's player waits before the first frame of a recording for as long as that frame's time says. It drifts as it is told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SensorTime {
    start: Instant,
    start_unix_ns: i64,
    rate: f64,
}

impl SensorTime {
    pub(crate) fn starting_now(drift_ppm: f64) -> Self {
        let unix = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        Self {
            start: Instant::now(),
            start_unix_ns: i64::try_from(unix.as_micros() * 1000).unwrap_or(i64::MAX),
            rate: 1.0 + drift_ppm * 1e-6,
        }
    }

    /// What it shows, microseconds.
    pub(crate) fn shows_us(&self, at: Instant) -> u64 {
        let gone_ns = at.saturating_duration_since(self.start).as_nanos() as f64 * self.rate;
        gone_ns.round() as u64 / 1000
    }

    /// Civil time when it showed 0, nanoseconds since 1970; whole microseconds, as it shows them.
    pub(crate) fn zero_unix_ns(&self) -> i64 {
        self.start_unix_ns
    }

    /// Civil time, nanoseconds since 1970.
    pub(crate) fn unix_ns(&self, at: Instant) -> i64 {
        let gone = at.saturating_duration_since(self.start).as_nanos();
        self.start_unix_ns
            .saturating_add(i64::try_from(gone).unwrap_or(i64::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plugging_is_told_once_and_each_stay_has_a_number_of_its_own() {
        let control = Control::default();
        let world = Arc::new(World::new(&control.scenario).unwrap());
        let sensor = VirtualSensor::new(0, &world, SensorTime::starting_now(0.0), &control);
        assert_eq!((sensor.stay(), sensor.plug(false)), (None, false));
        assert_eq!((sensor.plug(true), sensor.plug(true)), (true, false));
        let first = sensor.stay().unwrap();
        assert!(sensor.plug(false) && sensor.stay().is_none() && sensor.plug(true));
        assert_ne!(sensor.stay(), Some(first));
    }

    #[test]
    fn a_fast_clock_gains_what_it_is_told_to() {
        let clock = SensorTime::starting_now(100.0);
        let at = |seconds: u64| clock.start + Duration::from_secs(seconds);
        assert_eq!(clock.shows_us(at(10)) - clock.shows_us(at(0)), 10_001_000);
        assert_eq!(clock.unix_ns(at(10)) - clock.unix_ns(at(0)), 10_000_000_000);
    }
}
