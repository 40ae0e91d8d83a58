//! What a take holds of people: fused, as each sensor saw them, or as they truly moved.
//!
//! Everything in the room's axes, metres, at capture time on the server's clock.

use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_session::{ClockSample, Input, TakeReader, Topic, Truth};
use posefuse_skeleton::{
    Body, Calibration, Confidence, HandVotes, Joint, JointState, Observation, Position, Provenance,
    Room, RoomFrame, SensorId, SensorPose, SensorSet, Skeleton, Timestamp,
};
use serde::{Deserialize, Serialize};

use crate::choice::choices;
use crate::{Result, Who};

/// Sensors say less of what they guess: as fusing has it unless told otherwise.
const TRUSTED: f32 = 0.75;

choices! {
    /// Whose word on the people is exported.
    Source, "source" {
        /// The fused people.
        Fused = "fused",
        /// Every body of every sensor, before fusion, put into the room by the calibration.
        Sensors = "sensors",
        /// The true poses of simulated people.
        Truth = "truth",
    }
}

/// The people of one frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Seen {
    /// When the light was caught.
    pub(crate) time: Timestamp,
    pub(crate) people: Vec<(Who, Person)>,
}

/// What is seen of one person.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Person {
    pub(crate) skeleton: Skeleton<Room>,
    /// What is said of the left and the right hand.
    pub(crate) hands: [Option<HandVotes>; 2],
}

impl Source {
    /// How many messages [`Source::read`] goes through.
    pub(crate) fn messages(self, take: &TakeReader) -> u64 {
        take.count(match self {
            Self::Fused => Topic::Frames,
            Self::Sensors => Topic::Inputs,
            Self::Truth => Topic::Truth,
        })
    }

    /// By how much later than the newest frame so far an older one may come, nanoseconds: sensors' frames come in the
    /// order in which the server got them.
    pub(crate) fn disorder_ns(self) -> i64 {
        match self {
            Self::Fused | Self::Truth => 0,
            Self::Sensors => 500_000_000,
        }
    }

    /// The frames, one for each message that is read: `None` for those that tell of nobody.
    pub(crate) fn read(
        self,
        take: &TakeReader,
    ) -> Result<Box<dyn Iterator<Item = Result<Option<Seen>>> + Send>> {
        Ok(match self {
            Self::Fused => Box::new(take.frames().map(|frame| Ok(Some(fused(frame?))))),
            Self::Truth => Box::new(take.truth().map(|truth| Ok(Some(true_people(truth?))))),
            Self::Sensors => {
                let mut sensors = Sensors::default();
                let (_, preamble) = take.beginning()?;
                for input in preamble {
                    sensors.take_in(input);
                }
                Box::new(take.inputs().map(move |input| Ok(sensors.take_in(input?))))
            }
        })
    }
}

fn fused(frame: RoomFrame) -> Seen {
    let person = |track: posefuse_skeleton::Track| {
        let (skeleton, hands) = (track.skeleton, track.hands);
        (Who::Person(track.id), Person { skeleton, hands })
    };
    Seen {
        time: frame.time,
        people: frame.tracks.into_iter().map(person).collect(),
    }
}

fn true_people(truth: Truth) -> Seen {
    let certain = |position: &Position<Room>| JointState {
        position: *position,
        covariance: nalgebra::Matrix3::zeros(),
        confidence: Confidence::FULL,
        provenance: Provenance::Measured(SensorSet::EMPTY),
    };
    let person = |person: &posefuse_session::TruePerson| {
        let joints = Joint::ALL
            .into_iter()
            .zip(person.joints.iter().map(certain));
        let person_seen = Person {
            skeleton: joints.collect(),
            hands: [None; 2],
        };
        (Who::True(person.id), person_seen)
    };
    Seen {
        time: truth.time,
        people: truth.people.iter().map(person).collect(),
    }
}

/// What is known of the sensors while their frames are read.
#[derive(Default)]
struct Sensors {
    names: BTreeMap<SensorId, String>,
    clocks: BTreeMap<SensorId, ClockOffset>,
    calibration: Arc<Calibration>,
    /// The number of each body by sensor and tracking id, and how many the sensor had so far.
    bodies: BTreeMap<(SensorId, u64), u64>,
    counts: BTreeMap<SensorId, u64>,
}

impl Sensors {
    fn take_in(&mut self, input: Input) -> Option<Seen> {
        match input {
            Input::Sensor(info) => {
                self.names.insert(info.id, info.name);
                None
            }
            Input::Calibration(calibration) => {
                self.calibration = calibration;
                None
            }
            Input::ClockSample(sample) => {
                self.clocks
                    .entry(sample.sensor)
                    .or_default()
                    .probed(&sample);
                None
            }
            Input::Observation(observation) => self.observed(observation),
            _ => None,
        }
    }

    /// The bodies of a sensor whose place is known.
    fn observed(&mut self, observation: Observation) -> Option<Seen> {
        let sensor = observation.sensor;
        let clock = self.clocks.entry(sensor).or_default();
        clock.received(&observation);
        let captured = clock.server_time(&observation);
        let name = self.names.get(&sensor)?.clone();
        let poses = &self.calibration.sensors;
        let pose: &SensorPose = poses.get(&name)?;
        // Only differences of delays are known: the engine takes the largest as 0, too.
        let latest = poses.values().map(|pose| pose.time_offset_ns).max();
        let offset_ns = pose.time_offset_ns - latest.unwrap_or(0);
        let room_from_sensor = pose.room_from_sensor;
        let mut people = Vec::with_capacity(observation.bodies.len());
        for Body {
            tracking_id,
            skeleton,
            hands_closed,
            ..
        } in &observation.bodies
        {
            let count = self.counts.entry(sensor).or_default();
            let number = *self
                .bodies
                .entry((sensor, *tracking_id))
                .or_insert_with(|| {
                    *count += 1;
                    *count
                });
            let sensor = name.clone();
            let who = Who::Body { sensor, number };
            let vote = |closed: Confidence| HandVotes { closed, sensors: 1 };
            let person = Person {
                skeleton: skeleton
                    .transformed(&room_from_sensor)
                    .map(|_, state| trusted(*state)),
                hands: hands_closed.map(|closed| closed.map(vote)),
            };
            people.push((who, person));
        }
        Some(Seen {
            time: captured.plus_ns(offset_ns),
            people,
        })
    }
}

/// A tracker's low confidence says that it guessed.
fn trusted(state: JointState<Room>) -> JointState<Room> {
    match state.provenance {
        Provenance::Measured(sensors) if state.confidence.get() < TRUSTED => JointState {
            provenance: Provenance::Predicted(sensors),
            ..state
        },
        _ => state,
    }
}

/// How far the server's clock is ahead of an agent's: by the clock probe that came back quickest, and until there is one
/// by the frame that came quickest. An agent that starts again has a clock that starts again, too.
#[derive(Default)]
struct ClockOffset {
    /// Round trip and offset, nanoseconds.
    probe: Option<(i64, i64)>,
    least_delay_ns: Option<i64>,
    /// When the last frame was caught, by the agent's clock.
    captured_ns: Option<i64>,
}

impl ClockOffset {
    /// How much slower than the quickest a later probe may be and still be believed, nanoseconds: clocks drift, so a
    /// later probe is worth more.
    const SLOWER_NS: i64 = 500_000;
    /// Stamps are rounded and clocks drift: two probes may be this much further apart than their round trips allow, and
    /// still be of one clock, nanoseconds.
    const SLACK_NS: i64 = 1_000_000;
    /// Frames of an agent come in order; a clock that is this much behind the last frame is another one, nanoseconds.
    const BACK_NS: i64 = 1_000_000_000;

    fn probed(&mut self, sample: &ClockSample) {
        let there = sample.agent_received.ns().saturating_sub(sample.sent.ns());
        let back = sample.returned.ns().saturating_sub(sample.agent_sent.ns());
        let round_trip = there.saturating_add(back);
        let offset = back.saturating_sub(there) / 2;
        if round_trip < -Self::SLACK_NS {
            // It contradicts itself.
            return;
        }
        let Some((quickest, known)) = self.probe else {
            self.probe = Some((round_trip, offset));
            return;
        };
        // A probe's offset is off by half its round trip at most.
        let apart = offset.saturating_sub(known).saturating_abs();
        if apart > round_trip.saturating_add(quickest) / 2 + Self::SLACK_NS {
            *self = Self {
                probe: Some((round_trip, offset)),
                ..Self::default()
            };
        } else if round_trip < quickest.saturating_add(Self::SLOWER_NS) {
            self.probe = Some((quickest.min(round_trip), offset));
        }
    }

    fn received(&mut self, observation: &Observation) {
        let captured = observation.captured.ns();
        let back = |last: i64| captured < last.saturating_sub(Self::BACK_NS);
        if self.captured_ns.is_some_and(back) {
            *self = Self::default();
        }
        self.captured_ns = Some(captured);
        let delay = observation.received.ns().saturating_sub(captured);
        self.least_delay_ns = Some(self.least_delay_ns.map_or(delay, |least| least.min(delay)));
    }

    fn server_time(&self, observation: &Observation) -> Timestamp {
        let offset = self.probe.map(|(_, offset)| offset).or(self.least_delay_ns);
        let captured = observation
            .captured
            .ns()
            .saturating_add(offset.unwrap_or(0));
        // Nothing comes before it was caught; what seems to is of a clock that started again.
        Timestamp::from_ns(captured).min(observation.received)
    }
}
