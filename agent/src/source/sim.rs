//! One sensor of a simulated room, in real time.
//!
//! Agents that are given the same scenario and the same epoch, in whatever process, see the same people at the same
//! moment. The sensor's clock is the simulated, faulty one: it stamps the frames and answers the probes. Frames are
//! computed ahead and handed on when the simulated sensor would have delivered them.

use std::sync::Arc;

use posefuse_simulator::{Scenario, SimClock, SimFrame, SimSensor, World};
use posefuse_skeleton::{AgentTime, JointSet};
use serde::{Deserialize, Serialize};

use super::pace::monotonic_of;
use super::{Description, SensorClock, SensorSource, SourceBody, SourceError, SourceFrame};
use crate::Clock;

/// Which room, and which of its sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimConfig {
    /// The room, its people and its errors.
    #[serde(default)]
    pub scenario: Scenario,
    /// The sensor, from 0.
    #[serde(default)]
    pub sensor: usize,
    /// When the scenario starts, civil time in ns since 1970: the same for all agents of a room. May be past (then
    /// the agent joins in midway) or to come. Absent: now.
    #[serde(default)]
    pub epoch_unix_ns: Option<i64>,
}

/// After how long a room without people begins again, ns.
const EMPTY_ROUND_NS: i64 = 300_000_000_000;

/// An epoch for agents that are started by hand at any times: when the performance of the scenario's people last began
/// anew, counted in whole rounds from 1970 on. Agents that are given epochs of different rounds see the same people at
/// the same moment all the same, since each round is as the one before. Both in ns since 1970.
pub fn shared_epoch_unix_ns(scenario: &Scenario, now_unix_ns: i64) -> Result<i64, SourceError> {
    let world = World::new(scenario).map_err(|error| fatal(error.to_string()))?;
    let round_ns = match world.performance().round_s() {
        Some(seconds) => (seconds * 1e9).round() as i64,
        None => EMPTY_ROUND_NS,
    };
    Ok(now_unix_ns - now_unix_ns.rem_euclid(round_ns.max(1)))
}

fn fatal(reason: String) -> SourceError {
    SourceError::Final(format!("sim source: {reason}"))
}

/// A simulated sensor, paced by the agent's clock.
pub(crate) struct SimSource {
    sensor: SimSensor,
    sensor_clock: SimClock,
    clock: Arc<dyn Clock>,
    /// The scenario's start by the agent's monotonic clock.
    epoch_ns: i64,
    joined_in: bool,
    last_due_ns: i64,
}

impl SimSource {
    pub(crate) fn open(config: &SimConfig, clock: &Arc<dyn Clock>) -> Result<Self, SourceError> {
        let world = World::new(&config.scenario).map_err(|error| fatal(error.to_string()))?;
        let sensors = world.sensor_count();
        if config.sensor >= sensors {
            return Err(fatal(format!(
                "`sensor` must be 0 to {} in a room of {sensors}, found {}",
                sensors - 1,
                config.sensor
            )));
        }
        if let Some(epoch_ns) = config.epoch_unix_ns {
            let gone_s = clock.unix_ns().saturating_sub(epoch_ns) as f64 * 1e-9;
            tracing::info!(epoch_ns, "the simulated room began {gone_s:.1} s ago");
        }
        Ok(Self {
            sensor_clock: world.sensor_clock(config.sensor),
            sensor: SimSensor::new(Arc::new(world), config.sensor),
            epoch_ns: match config.epoch_unix_ns {
                Some(unix_ns) => monotonic_of(clock.as_ref(), unix_ns),
                None => clock.monotonic_ns(),
            },
            clock: clock.clone(),
            joined_in: false,
            last_due_ns: i64::MIN,
        })
    }

    /// Simulates what was before the agent began, which takes time in which more goes by.
    fn join_in(&mut self) {
        let elapsed_ns = || self.clock.monotonic_ns().saturating_sub(self.epoch_ns);
        while self.sensor.next_at_ns() < elapsed_ns() {
            self.sensor.skip_to(elapsed_ns() as f64 * 1e-9);
        }
        self.joined_in = true;
    }

    /// The next frame that is not lost on its way, and when it is there, by the agent's monotonic clock.
    pub(super) fn next_due(&mut self) -> (SimFrame, i64) {
        if !self.joined_in {
            self.join_in();
        }
        let frame = loop {
            let frame = self.sensor.next_frame();
            if !frame.dropped {
                break frame;
            }
        };
        let due_ns = self
            .epoch_ns
            .saturating_add(frame.at_ns + frame.arrival_delay_ns.max(0));
        self.last_due_ns = self.last_due_ns.max(due_ns);
        (frame, self.last_due_ns)
    }
}

impl SensorSource for SimSource {
    fn description(&self) -> Description {
        Description {
            model: "simulated Kinect v2".into(),
            joint_set: JointSet::KinectV2,
            camera: None,
        }
    }

    fn clock(&self) -> SensorClock {
        let (faulty, epoch_ns) = (self.sensor_clock, self.epoch_ns);
        Arc::new(move |monotonic_ns: i64| -> AgentTime {
            faulty.shows(monotonic_ns.saturating_sub(epoch_ns))
        })
    }

    fn next_frame(&mut self) -> Result<Option<SourceFrame>, SourceError> {
        let (frame, due_ns) = self.next_due();
        let body = |body: posefuse_simulator::SimBody| SourceBody {
            tracking_id: body.tracking_id,
            joints: body.joints,
            orientations: Vec::new(),
            hands_closed: [None; 2],
        };
        Ok(Some(SourceFrame {
            captured: frame.captured,
            due_ns: Some(due_ns),
            bodies: frame.bodies.into_iter().map(body).collect(),
        }))
    }
}

#[cfg(test)]
mod tests;
