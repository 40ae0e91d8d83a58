//! A simulated room as the engine sees it: greetings, clock samples and observations in the order a server would take
//! them in. No network, no waiting, the same from the same scenario.

use std::sync::Arc;

use posefuse_fusion::{ClockSample, Input};
use posefuse_simulator::{BodyTruth, SimBody, SimFrame, SimSensor, World};
use posefuse_skeleton::{
    Body, Calibration, Confidence, JointSet, JointState, Observation, Position, RawJoint, SensorId,
    SensorIdError, SensorInfo, Timestamp,
};

/// Server time of the scenario's start: the clocks are mapped in the quarter of a second before.
const START_NS: i64 = 250_000_000;
/// From an agent to the server, and how long an agent takes to answer a probe.
const WAY_NS: i64 = 400_000;
const ANSWER_NS: i64 = 100_000;
/// Probes come fast at first, then now and then, as from a server.
const FIRST_PROBES: i64 = 10;
const FIRST_PROBE_NS: i64 = 20_000_000;
const PROBE_NS: i64 = 1_000_000_000;

/// What a joint is taken to be good for until the engine applies its sensor model, metres: as for a joint from the wire.
const NOMINAL_SIGMA_M: f64 = 0.02;

/// A simulated room, input after input, in the order in which a server would take them in.
pub struct SimulatedRoom {
    world: Arc<World>,
    sensors: Vec<Feed>,
    greeted: usize,
    end_ns: i64,
    /// Of the bodies in the observation given last.
    truth: Vec<BodyTruth>,
}

/// What comes next from one sensor.
struct Feed {
    info: SensorInfo,
    sensor: SimSensor,
    frame: SimFrame,
    /// Of the bodies in `frame`.
    truth: Vec<BodyTruth>,
    probes: i64,
}

impl SimulatedRoom {
    /// The first `seconds` of the room.
    ///
    /// # Errors
    /// More sensors than a room may have.
    pub fn new(world: &Arc<World>, seconds: f64) -> Result<Self, SensorIdError> {
        let feed = |index: usize| -> Result<Feed, SensorIdError> {
            let mut sensor = SimSensor::new(Arc::clone(world), index);
            Ok(Feed {
                info: SensorInfo {
                    id: SensorId::new(index)?,
                    name: world.sensor_name(index).to_owned(),
                    model: "simulated Kinect v2".to_owned(),
                    joint_set: JointSet::KinectV2,
                },
                frame: next_frame(&mut sensor),
                truth: sensor.truth().to_vec(),
                sensor,
                probes: 0,
            })
        };
        Ok(Self {
            world: Arc::clone(world),
            sensors: (0..world.sensor_count())
                .map(feed)
                .collect::<Result<_, SensorIdError>>()?,
            greeted: 0,
            truth: Vec::new(),
            end_ns: (seconds * 1e9).round() as i64,
        })
    }

    /// The room's sensors.
    pub fn sensors(&self) -> impl Iterator<Item = &SensorInfo> {
        self.sensors.iter().map(|feed| &feed.info)
    }

    /// Whose the bodies of the observation given last are, and which of them have left and right exchanged.
    pub fn body_truth(&self) -> &[BodyTruth] {
        &self.truth
    }

    /// Seconds of the scenario at a server time.
    pub fn scenario_seconds(time: Timestamp) -> f64 {
        time.plus_ns(-START_NS).seconds()
    }

    /// The server time at a scenario's second.
    pub fn server_time(seconds: f64) -> Timestamp {
        Timestamp::from_seconds(seconds).plus_ns(START_NS)
    }
}

/// What the best calibration there can be would find: where the sensors truly stand, and how far towards them joints
/// are truly reported.
pub fn perfect_calibration(world: &World) -> Calibration {
    Calibration {
        ray_bias_m: world.true_ray_bias_m(),
        ..world.true_calibration()
    }
}

impl Iterator for SimulatedRoom {
    type Item = (Timestamp, Input);

    /// The next input and the server time at which it comes.
    fn next(&mut self) -> Option<Self::Item> {
        if let Some(feed) = self.sensors.get(self.greeted) {
            self.greeted += 1;
            return Some((Timestamp::ZERO, Input::Sensor(feed.info.clone())));
        }
        let due = |(index, feed): (usize, &Feed)| {
            [
                (feed.probe_sent_ns(), index, true),
                (feed.arrives_ns(), index, false),
            ]
        };
        let (at_ns, index, is_probe) = self.sensors.iter().enumerate().flat_map(due).min()?;
        if at_ns > self.end_ns {
            return None;
        }
        let world = Arc::clone(&self.world);
        let feed = &mut self.sensors[index];
        let input = if is_probe {
            Input::ClockSample(feed.probe(&world, index))
        } else {
            self.truth.clone_from(&feed.truth);
            Input::Observation(feed.observation())
        };
        Some((server(at_ns), input))
    }
}

impl Feed {
    /// When the next probe leaves; scenario time, as everywhere below.
    fn probe_sent_ns(&self) -> i64 {
        let first = self.probes.min(FIRST_PROBES) * FIRST_PROBE_NS;
        first + (self.probes - FIRST_PROBES).max(0) * PROBE_NS - FIRST_PROBES * FIRST_PROBE_NS
    }

    fn arrives_ns(&self) -> i64 {
        self.frame.at_ns + self.frame.arrival_delay_ns.max(0) + WAY_NS
    }

    fn probe(&mut self, world: &World, index: usize) -> ClockSample {
        let sent_ns = self.probe_sent_ns();
        self.probes += 1;
        let (clock, received_ns) = (world.sensor_clock(index), sent_ns + WAY_NS);
        ClockSample {
            sensor: self.info.id,
            sent: server(sent_ns),
            returned: server(received_ns + ANSWER_NS + WAY_NS),
            agent_received: clock.shows(received_ns),
            agent_sent: clock.shows(received_ns + ANSWER_NS),
        }
    }

    fn observation(&mut self) -> Observation {
        let received = server(self.arrives_ns());
        let frame = std::mem::replace(&mut self.frame, next_frame(&mut self.sensor));
        self.truth = self.sensor.truth().to_vec();
        let body = |body: &SimBody| observed_body(&self.info, body.tracking_id, &body.joints);
        Observation {
            sensor: self.info.id,
            sequence: frame.number,
            captured: frame.captured,
            received,
            bodies: frame.bodies.iter().map(body).collect(),
        }
    }
}

/// A body as a server takes it in: positions have been f32 on the wire, no confidence is no joint. `joints` are in the
/// order of the sensor's joint set.
pub fn observed_body(info: &SensorInfo, tracking_id: u64, joints: &[Option<RawJoint>]) -> Body {
    let skeleton = info.joint_set.to_canonical(joints);
    Body {
        tracking_id,
        skeleton: skeleton.filter_map(|_, raw| {
            let rounded = raw.position.vector().map(|v| f64::from(v as f32));
            (raw.confidence != Confidence::NONE).then(|| {
                JointState::measured(
                    Position::from_vector(rounded),
                    NOMINAL_SIGMA_M,
                    raw.confidence,
                    info.id,
                )
            })
        }),
        orientations: None,
        hands_closed: [None; 2],
    }
}

/// The next frame that is not lost on its way.
fn next_frame(sensor: &mut SimSensor) -> SimFrame {
    loop {
        let frame = sensor.next_frame();
        if !frame.dropped {
            return frame;
        }
    }
}

fn server(scenario_ns: i64) -> Timestamp {
    Timestamp::from_ns(scenario_ns.saturating_add(START_NS))
}

#[cfg(test)]
mod tests {
    use posefuse_simulator::Scenario;

    use super::*;

    #[test]
    fn inputs_come_in_the_order_of_their_time_and_clocks_are_known_before_frames() {
        let world = Arc::new(
            World::new(&Scenario {
                sensors: 2,
                ..Scenario::default()
            })
            .unwrap(),
        );
        let room = SimulatedRoom::new(&world, 3.0).unwrap();
        let (mut last, mut probes, mut frames) = (Timestamp::ZERO, [0; 2], [0; 2]);
        for (time, input) in room {
            assert!(time >= last);
            last = time;
            match input {
                Input::ClockSample(sample) => {
                    assert!(
                        sample.sent < sample.returned && sample.agent_received < sample.agent_sent
                    );
                    probes[sample.sensor.index()] += 1;
                }
                Input::Observation(observation) => {
                    assert!(probes[observation.sensor.index()] >= 10);
                    frames[observation.sensor.index()] += 1;
                }
                _ => {}
            }
        }
        assert!(
            frames.iter().all(|count| (80..=90).contains(count)),
            "{frames:?}"
        );
        assert_eq!(probes, [14, 14], "ten before the start, then one a second");
    }
}
