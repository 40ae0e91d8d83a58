//! Several simulated depth sensors, each with the body tracker, fused into one room: the error beside that of each sensor alone.
//!
//! The sensors' clocks are right here and their images come one after the other; the engine knows where the sensors truly stand.

use std::sync::Arc;

use posefuse_bodytrack::{BodyTracker, TrackerConfig};
use posefuse_fusion::{ClockSample, Input};
use posefuse_simulator::depth::DepthCamera;
use posefuse_simulator::{TruePerson, World};
use posefuse_skeleton::{
    AgentTime, Joint, JointMap, JointSet, Observation, Position, RawJoint, Room, RoomFrame,
    SensorId, SensorInfo, Timestamp,
};
use serde::Serialize;

use super::TrialError;
use super::tally::Distances;
use crate::fuse::fuse;
use crate::methods::Method;
use crate::parallel::in_parallel;

const RATE_HZ: f64 = 30.0;
/// Server time of the scenario's start.
const START_NS: i64 = 1_000_000_000;
/// From the light to the server.
const DELAY_NS: i64 = 30_000_000;
/// Clock probes: on their way, and how often.
const WAY_NS: i64 = 400_000;
const PROBE_NS: i64 = 100_000_000;
/// People further from every body than this were not found, metres.
const FOUND_M: f64 = 0.5;

/// A room, from its sensors' depth to fused people.
pub struct Together {
    /// The room.
    pub world: World,
    /// How long, seconds, and how much of that does not count.
    pub seconds: f64,
    /// See above.
    pub skip_s: f64,
    /// Every sensor's.
    pub camera: DepthCamera,
    /// Every sensor's.
    pub tracker: TrackerConfig,
    /// How it is fused.
    pub method: Method,
    /// How many sensors are worked on at once.
    pub threads: usize,
}

/// Errors over all joints of all people, of those who were found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Of their joints.
    pub distances: Distances,
    /// Instants of people.
    pub people: u64,
    /// Those of them that were found.
    pub found: u64,
}

/// The result.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TogetherReport {
    /// Of the fused people.
    pub fused: Errors,
    /// Of each sensor alone.
    pub alone: Vec<Errors>,
}

impl TogetherReport {
    /// The fused error as a share of the mean one of a sensor alone.
    pub fn ratio(&self) -> Option<f64> {
        let alone: Vec<f64> = self
            .alone
            .iter()
            .filter_map(|e| e.distances.mean_mm())
            .collect();
        let mean = alone.iter().sum::<f64>() / alone.len() as f64;
        let ratio = self.fused.distances.mean_mm()? / mean;
        ratio.is_finite().then_some(ratio)
    }
}

impl Errors {
    /// Takes in what was found at an instant.
    fn add(&mut self, truth: &[TruePerson], found: &[JointMap<Position<Room>>]) {
        for person in truth {
            self.people += 1;
            let far = |body: &&JointMap<Position<Room>>| middle_distance(body, &person.joints);
            let best = found.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            let Some(best) = best.filter(|body| far(body) < FOUND_M) else {
                continue;
            };
            self.found += 1;
            for (joint, at) in person.joints.iter() {
                if let Some(found) = best[joint] {
                    self.distances.add(found.distance(*at));
                }
            }
        }
    }
}

fn middle_distance(a: &JointMap<Position<Room>>, b: &JointMap<Position<Room>>) -> f64 {
    let pairs = Joint::TORSO
        .into_iter()
        .filter_map(|joint| Some((a[joint]?, b[joint]?)));
    let far: Vec<f64> = pairs.map(|(a, b)| a.distance(b)).collect();
    match far.is_empty() {
        true => f64::INFINITY,
        false => far.iter().sum::<f64>() / far.len() as f64,
    }
}

impl Together {
    /// Renders, tracks, fuses and compares.
    ///
    /// # Errors
    /// The tracker cannot work, or there are too many sensors.
    pub fn run(&self) -> Result<TogetherReport, TrialError> {
        let work = |sensor: usize| self.sensor(sensor);
        let mut inputs = vec![(
            Timestamp::ZERO,
            Input::Calibration(Arc::new(self.world.true_calibration())),
        )];
        let mut report = TogetherReport::default();
        for sensor in in_parallel(self.world.sensor_count(), self.threads, &work) {
            let (own, errors) = sensor?;
            inputs.extend(own);
            report.alone.push(errors);
        }
        inputs.sort_by_key(|(time, _)| *time);
        let mut give = |frame: RoomFrame| {
            let seconds = frame.time.plus_ns(-START_NS).seconds();
            if seconds >= self.skip_s {
                let poses = frame
                    .tracks
                    .iter()
                    .map(|track| track.skeleton.map(|_, s| s.position));
                let poses: Vec<JointMap<Position<Room>>> = poses.collect();
                report.fused.add(&self.world.truth(seconds), &poses);
            }
        };
        fuse(&self.method, inputs, &mut give);
        Ok(report)
    }

    /// What the engine hears of one sensor, and the sensor's own error.
    #[allow(clippy::type_complexity, reason = "inputs as everywhere in this crate")]
    fn sensor(&self, sensor: usize) -> Result<(Vec<(Timestamp, Input)>, Errors), TrialError> {
        let info = SensorInfo {
            id: SensorId::new(sensor)?,
            name: self.world.sensor_name(sensor).to_owned(),
            model: "simulated depth sensor".to_owned(),
            joint_set: JointSet::KinectV2,
        };
        let mut inputs = vec![(Timestamp::ZERO, Input::Sensor(info.clone()))];
        let end_ns = (self.seconds * 1e9) as i64;
        inputs.extend(
            (0..(START_NS + end_ns) / PROBE_NS).map(|probe| clock(&info, probe * PROBE_NS)),
        );
        let mut tracker = BodyTracker::new(self.tracker.clone(), self.camera.intrinsics)?;
        let room_from_sensor = self.world.room_from_sensor(sensor);
        let mut errors = Errors::default();
        let shift_s = sensor as f64 / self.world.sensor_count() as f64 / RATE_HZ;
        for image in 0..(self.seconds * RATE_HZ) as usize {
            let seconds = image as f64 / RATE_HZ + shift_s;
            let at_ns = START_NS + (seconds * 1e9).round() as i64;
            let depth = self.world.depth(sensor, seconds, &self.camera);
            let bodies = tracker.track(&depth, at_ns)?;
            if seconds >= self.skip_s {
                let poses = bodies
                    .iter()
                    .map(|body| body.joints.map(|_, (at, _)| room_from_sensor.apply(*at)));
                let poses: Vec<JointMap<Position<Room>>> = poses.collect();
                errors.add(&self.world.truth(seconds), &poses);
            }
            let body = |body: &posefuse_bodytrack::TrackedBody| {
                let raw = Joint::ALL.map(|joint| {
                    let (position, confidence) = body.joints[joint]?;
                    Some(RawJoint {
                        position,
                        confidence,
                    })
                });
                crate::room::observed_body(&info, body.id, &raw)
            };
            let received = Timestamp::from_ns(at_ns + DELAY_NS);
            let observation = Observation {
                sensor: info.id,
                sequence: image as u64,
                captured: AgentTime::from_ns(at_ns),
                received,
                bodies: bodies.iter().map(body).collect(),
            };
            inputs.push((received, Input::Observation(observation)));
        }
        Ok((inputs, errors))
    }
}

/// A probe of a clock that is the server's own.
fn clock(info: &SensorInfo, sent_ns: i64) -> (Timestamp, Input) {
    let [sent, returned] = [sent_ns, sent_ns + 2 * WAY_NS].map(Timestamp::from_ns);
    let there = AgentTime::from_ns(sent_ns + WAY_NS);
    let sample = ClockSample {
        sensor: info.id,
        sent,
        returned,
        agent_received: there,
        agent_sent: there,
    };
    (returned, Input::ClockSample(sample))
}
