//! Trackers that a sensor's maker gives: opened, read, and opened again when the sensor was pulled out and is back.

use std::sync::Arc;

use super::device_clock::DeviceClock;
use super::{Description, SensorSource, SourceBody, SourceError, SourceFrame};
use crate::Clock;
use posefuse_skeleton::AgentTime;

/// A tracker that gives nothing for this long is opened anew, nanoseconds.
const SILENT_NS: i64 = 5_000_000_000;

/// One frame of a tracker: the device's time, nanoseconds, and who is in view.
pub(super) type Tracked = (i64, Vec<SourceBody>);

/// A maker's tracker.
pub(super) trait Vendor: Send {
    /// The open tracker; dropping it closes it.
    type Tracker: Send;

    /// What the sensor is.
    fn description(&self) -> Description;

    /// Opens it. [`SourceError::Trouble`]: the sensor is not there, and may come.
    fn open(&self) -> Result<Self::Tracker, SourceError>;

    /// Waits a moment for the next frame. An error means that the tracker is of no use any more.
    fn read(&self, tracker: &mut Self::Tracker) -> Result<Option<Tracked>, String>;
}

/// A maker's tracker as a sensor.
pub(super) struct VendorSource<V: Vendor> {
    vendor: V,
    clock: Arc<dyn Clock>,
    tracker: Option<V::Tracker>,
    times: DeviceClock,
    heard_ns: i64,
}

impl<V: Vendor> VendorSource<V> {
    /// Opens the tracker; a sensor that is not there is waited for.
    pub(super) fn new(vendor: V, clock: &Arc<dyn Clock>) -> Result<Self, SourceError> {
        let mut source = Self {
            vendor,
            heard_ns: clock.monotonic_ns(),
            clock: clock.clone(),
            tracker: None,
            times: DeviceClock::default(),
        };
        match source.open() {
            Err(SourceError::Trouble(why)) => tracing::warn!("{why}"),
            other => other?,
        }
        Ok(source)
    }

    fn open(&mut self) -> Result<(), SourceError> {
        self.tracker = Some(self.vendor.open()?);
        self.times = DeviceClock::default();
        self.heard_ns = self.clock.monotonic_ns();
        Ok(())
    }
}

impl<V: Vendor> SensorSource for VendorSource<V> {
    fn description(&self) -> Description {
        self.vendor.description()
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        loop {
            let Some(tracker) = &mut self.tracker else {
                self.open()?;
                continue;
            };
            let read = self.vendor.read(tracker);
            let now_ns = self.clock.monotonic_ns();
            match read {
                Ok(Some((device_ns, bodies))) => {
                    self.heard_ns = now_ns;
                    return Ok(Some(SourceFrame {
                        captured: AgentTime::from_ns(self.times.captured_ns(device_ns, now_ns)),
                        due_ns: None,
                        bodies,
                    }));
                }
                Ok(None) if now_ns.saturating_sub(self.heard_ns) < SILENT_NS => {}
                Ok(None) => {
                    self.tracker = None;
                    let seconds = SILENT_NS / 1_000_000_000;
                    return Err(SourceError::Trouble(format!(
                        "the sensor has given nothing for {seconds} s and is started anew"
                    )));
                }
                Err(why) => {
                    self.tracker = None;
                    return Err(SourceError::Trouble(why));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicI64, Ordering};

    use posefuse_skeleton::JointSet;

    use super::*;

    /// A clock that a second passes on whenever it is read.
    #[derive(Default)]
    struct Seconds(AtomicI64);

    impl Clock for Seconds {
        fn monotonic_ns(&self) -> i64 {
            self.0.fetch_add(1_000_000_000, Ordering::Relaxed)
        }
        fn unix_ns(&self) -> i64 {
            0
        }
    }

    type Reads = VecDeque<Result<Option<Tracked>, String>>;

    /// A sensor whose tracker, each time it is opened, gives the next of these.
    struct Scripted(Mutex<VecDeque<Result<Reads, SourceError>>>);

    impl Vendor for Scripted {
        type Tracker = Reads;

        fn description(&self) -> Description {
            Description {
                model: "scripted".into(),
                joint_set: JointSet::Nite,
                camera: None,
            }
        }

        fn open(&self) -> Result<Reads, SourceError> {
            let next = self.0.lock().unwrap().pop_front();
            next.unwrap_or_else(|| Err(SourceError::Final("the script is over".into())))
        }

        fn read(&self, tracker: &mut Reads) -> Result<Option<Tracked>, String> {
            tracker.pop_front().unwrap_or(Ok(None))
        }
    }

    fn source(script: Vec<Result<Reads, SourceError>>) -> VendorSource<Scripted> {
        let clock: Arc<dyn Clock> = Arc::new(Seconds::default());
        VendorSource::new(Scripted(Mutex::new(script.into())), &clock).unwrap()
    }

    fn frame(device_ns: i64) -> Result<Option<Tracked>, String> {
        Ok(Some((device_ns, Vec::new())))
    }

    #[test]
    fn a_sensor_that_is_not_there_is_waited_for_and_one_that_goes_comes_back() {
        let away = || Err(SourceError::Trouble("plug it in".into()));
        let mut source = source(vec![
            away(),
            away(),
            Ok([frame(5), Err("pulled out".into())].into()),
            Ok([frame(1)].into()),
        ]);
        let trouble = |words: &str| Err(SourceError::Trouble(words.into()));
        assert_eq!(source.next_frame(), trouble("plug it in"));
        let first = source.next_frame().unwrap().unwrap();
        assert_eq!(source.next_frame(), trouble("pulled out"));
        let second = source.next_frame().unwrap().unwrap();
        assert!(
            second.captured > first.captured,
            "its clock begins anew, ours does not"
        );
    }

    #[test]
    fn a_silent_tracker_is_started_anew_and_one_that_cannot_be_is_the_end() {
        let mut source = source(vec![Ok([frame(1)].into())]);
        source.next_frame().unwrap();
        match source.next_frame() {
            Err(SourceError::Trouble(why)) => assert!(why.contains("nothing for 5 s"), "{why}"),
            other => panic!("{other:?}"),
        }
        let over = SourceError::Final("the script is over".into());
        assert_eq!(source.next_frame(), Err(over));
    }
}
