//! The depth images of one sensor of a simulated room, in real time: what its people and furniture look like to a real
//! sensor, for a body tracker to make skeletons of.
//!
//! Room, clock, lost frames and their delays are those of the [`SimConfig`]'s sensor; only what a frame holds differs.

use std::sync::Arc;
use std::time::Duration;

use posefuse_bodytrack::TrackerConfig;
use posefuse_simulator::World;
use posefuse_simulator::depth::DepthCamera;
use posefuse_skeleton::Intrinsics;
use serde::{Deserialize, Serialize};

use super::sim::SimSource;
use super::{DepthFrame, DepthSource, SensorClock, SensorSource, SimConfig, SourceError};
use crate::Clock;

/// Images later than this are left out: a device has no queue either, ns.
const LATE_NS: i64 = 50_000_000;

/// Which room, which of its sensors, and what kind of camera it has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimDepthConfig {
    /// The room and the sensor.
    pub room: SimConfig,
    /// Its optics.
    #[serde(default)]
    pub optics: SimOptics,
    /// The tracker behind it.
    #[serde(default)]
    pub tracker: TrackerConfig,
}

impl SimDepthConfig {
    /// With the usual tracker.
    pub fn new(room: SimConfig, optics: SimOptics) -> Self {
        Self {
            room,
            optics,
            tracker: TrackerConfig::default(),
        }
    }
}

/// A kind of depth camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SimOptics {
    /// As Kinect v1, Xtion and Astra see: 320 x 240 pixels over 57 x 43 degrees.
    #[default]
    StructuredLight,
    /// As Kinect v2 sees: 512 x 424 pixels over 71 x 60 degrees.
    TimeOfFlight,
}

impl SimOptics {
    /// The camera.
    pub fn camera(self) -> DepthCamera {
        match self {
            Self::StructuredLight => DepthCamera::structured_light(320, 240),
            Self::TimeOfFlight => DepthCamera::time_of_flight(512, 424),
        }
    }
}

/// A simulated depth sensor, paced by the agent's clock.
pub(super) struct SimDepth {
    frames: SimSource,
    world: World,
    sensor: usize,
    camera: DepthCamera,
    clock: Arc<dyn Clock>,
}

impl SimDepth {
    pub(super) fn open(
        config: &SimDepthConfig,
        clock: &Arc<dyn Clock>,
    ) -> Result<Self, SourceError> {
        let frames = SimSource::open(&config.room, clock)?;
        let world = World::new(&config.room.scenario)
            .map_err(|error| SourceError::Final(format!("sim source: {error}")))?;
        Ok(Self {
            frames,
            world,
            sensor: config.room.sensor,
            camera: config.optics.camera(),
            clock: clock.clone(),
        })
    }
}

impl DepthSource for SimDepth {
    fn model(&self) -> String {
        "simulated depth sensor (Posefuse body tracking)".into()
    }

    fn intrinsics(&self) -> Intrinsics {
        self.camera.intrinsics
    }

    fn clock(&self) -> SensorClock {
        SensorSource::clock(&self.frames)
    }

    fn next_frame(&mut self) -> Result<Option<DepthFrame>, SourceError> {
        let (frame, due_ns) = loop {
            let (frame, due_ns) = self.frames.next_due();
            if due_ns.saturating_sub(self.clock.monotonic_ns()) > -LATE_NS {
                break (frame, due_ns);
            }
        };
        let seconds = frame.at_ns as f64 * 1e-9;
        let image = self.world.depth(self.sensor, seconds, &self.camera);
        // As a device does: nobody has an image before it was caught and sent.
        let early_ns = due_ns.saturating_sub(self.clock.monotonic_ns());
        if let Ok(early_ns @ 1..) = u64::try_from(early_ns) {
            std::thread::sleep(Duration::from_nanos(early_ns));
        }
        Ok(Some(DepthFrame {
            captured: frame.captured,
            due_ns: None,
            image,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SystemClock;
    use crate::source::{SourceConfig, SourceFrame};
    use posefuse_bodytrack::BackendChoice;
    use posefuse_simulator::Scenario;

    #[test]
    fn a_person_in_the_simulated_room_is_tracked_through_the_depth_images() {
        let mut tracker = TrackerConfig::default();
        tracker.models.backend = BackendChoice::Rten;
        let scenario = Scenario {
            seed: 5,
            ..Scenario::default()
        };
        let config = SourceConfig::SimDepth(SimDepthConfig {
            room: SimConfig {
                scenario,
                sensor: 0,
                epoch_unix_ns: None,
            },
            optics: SimOptics::StructuredLight,
            tracker,
        });
        let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
        let mut source = config.open(&clock).unwrap();
        assert!(source.previews().is_some());
        assert!(source.description().camera.unwrap().view_deg[0] > 56.0);
        let began = std::time::Instant::now();
        let mut frames: Vec<SourceFrame> = Vec::new();
        while began.elapsed() < Duration::from_secs(6)
            && frames.last().is_none_or(|frame| frame.bodies.is_empty())
        {
            frames.push(source.next_frame().unwrap().unwrap());
        }
        let body = &frames.last().unwrap().bodies[0];
        assert_eq!(body.joints.len(), 25);
        assert!(frames.is_sorted_by_key(|frame| frame.captured));
    }
}
