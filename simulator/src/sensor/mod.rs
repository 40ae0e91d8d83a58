//! Simulated sensors: what a depth sensor and its body tracker would say of the people in a [`World`].
//!
//! Positions are in the sensor's optical frame (x right, y down, z forward), metres, in the order of Kinect v2.
//! Every number comes from the scenario's seed, the sensor's number and the frame's number: a sensor simulated
//! alone says exactly what it says among others, and one that starts late what it would have said anyway.

mod clock;
mod errors;
mod layout;
mod noise;
mod occlusion;
mod sightings;
mod swap;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use posefuse_skeleton::{
    AgentTime, Confidence, Joint, JointMap, Position, RawJoint, Room, Sensor, Transform,
};

pub use clock::SimClock;
pub use errors::SensorErrors;
pub(crate) use layout::room_from_sensor;

use crate::random::{Purpose, Stream};
use crate::world::World;
use noise::{Biases, Drift, Spikes, noisy};
use occlusion::{Flesh, visible_share};
use swap::Facing;

/// What a sensor delivers.
#[derive(Clone, Debug, PartialEq)]
pub struct SimFrame {
    /// Counts up by one from the sensor's first frame, 0.
    pub number: u64,
    /// True time of capture, nanoseconds since the scenario's start.
    pub at_ns: i64,
    /// The same by the agent's faulty clock.
    pub captured: AgentTime,
    /// How long after `at_ns` the agent gets the frame, nanoseconds.
    pub arrival_delay_ns: i64,
    /// The people the tracker holds. None if the frame was dropped.
    pub bodies: Vec<SimBody>,
    /// Whether the frame got lost on its way to the agent.
    pub dropped: bool,
}

/// A person as the sensor's tracker reports them.
#[derive(Clone, Debug, PartialEq)]
pub struct SimBody {
    /// The tracker's own number for the person; a new one each time they come back into view.
    pub tracking_id: u64,
    /// 25 joints in the order of Kinect v2; `None` where the tracker has none.
    pub joints: Vec<Option<RawJoint>>,
}

/// Confidence of a joint that the tracker had to guess.
const GUESSED: f32 = 0.5;

/// A joint is hidden when fewer of its rays than this get through.
const HIDDEN_BELOW: f64 = 0.5;

/// Joints a tracker needs to see to find a person, and to hold on to them.
const JOINTS_TO_FIND: usize = 14;
const JOINTS_TO_HOLD: usize = 7;

/// One sensor of a world, frame after frame.
pub struct SimSensor {
    world: Arc<World>,
    index: usize,
    sensor_from_room: Transform<Sensor, Room>,
    phase_ns: f64,
    next: u64,
    biases: Biases,
    people: Vec<Tracked>,
    spikes: Spikes,
    next_tracking_id: u64,
    before: Vec<SimBody>,
}

/// What the sensor remembers of one person from frame to frame.
struct Tracked {
    drift: Drift,
    facing: Facing,
    tracking_id: Option<u64>,
}

impl SimSensor {
    /// Sensor `index` of `world`, before its first frame.
    ///
    /// # Panics
    /// If `index` is not below [`World::sensor_count`].
    pub fn new(world: Arc<World>, index: usize) -> Self {
        let scenario = world.scenario();
        let people = world.performance().people();
        let mut stream = Stream::new(scenario.seed, Purpose::Layout, &[index as u64, 1]);
        let tracked = |_| Tracked {
            drift: Drift::default(),
            facing: Facing::default(),
            tracking_id: None,
        };
        Self {
            index,
            sensor_from_room: world.room_from_sensor(index).inverse(),
            phase_ns: stream.uniform() * 1e9 / scenario.rate_hz,
            next: 0,
            biases: Biases::new(scenario.seed, index, people, &scenario.errors),
            people: (0..people).map(tracked).collect(),
            spikes: Spikes::default(),
            next_tracking_id: 1,
            before: Vec::new(),
            world,
        }
    }

    /// The world it is in.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// True capture time of the next frame, nanoseconds since the scenario's start.
    pub fn next_at_ns(&self) -> i64 {
        let period = 1e9 / self.world.scenario().rate_hz;
        (self.phase_ns + self.next as f64 * period).round() as i64
    }

    /// Goes on to the first frame captured at or after `seconds`. The frames between are simulated, so that what
    /// follows does not depend on when one began to look.
    pub fn skip_to(&mut self, seconds: f64) {
        while (self.next_at_ns() as f64) < seconds * 1e9 {
            self.next_frame();
        }
    }

    /// The next frame.
    pub fn next_frame(&mut self) -> SimFrame {
        let (number, at_ns) = (self.next, self.next_at_ns());
        self.next += 1;
        let seen = self.look(number, at_ns as f64 * 1e-9);
        let errors = &self.world.scenario().errors;
        let stale = self.stream(Purpose::Stale, number).chance(errors.stale);
        let bodies = if stale { self.before.clone() } else { seen };
        self.before.clone_from(&bodies);
        let dropped = self.stream(Purpose::Drop, number).chance(errors.drops);
        let mut arrival = self.stream(Purpose::Arrival, number);
        let jitter_ns = errors.clock_jitter_ms * arrival.normal() * 1e6;
        let delay_ms = errors.delay_ms + errors.delay_jitter_ms * arrival.normal().abs();
        let clock = self.world.sensor_clock(self.index);
        SimFrame {
            number,
            at_ns,
            captured: clock.shows(at_ns).plus_ns(jitter_ns.round() as i64),
            arrival_delay_ns: (delay_ms * 1e6).round() as i64,
            bodies: if dropped { Vec::new() } else { bodies },
            dropped,
        }
    }

    fn stream(&self, purpose: Purpose, frame: u64) -> Stream {
        let seed = self.world.scenario().seed;
        Stream::new(seed, purpose, &[self.index as u64, frame])
    }

    /// The bodies of frame `number`, taken at `seconds`.
    fn look(&mut self, number: u64, seconds: f64) -> Vec<SimBody> {
        let world = Arc::clone(&self.world);
        let errors = &world.scenario().errors;
        let truth: Vec<JointMap<Position<Sensor>>> = world
            .truth(seconds)
            .iter()
            .map(|person| person.joints.map(|_, p| self.sensor_from_room.apply(*p)))
            .collect();
        let flesh: Vec<Flesh> = truth.iter().map(Flesh::new).collect();
        self.spikes
            .step(self.index, number, truth.len(), world.scenario());
        let mut bodies = Vec::new();
        for (person, joints) in truth.iter().enumerate() {
            let address = [self.index as u64, number, person as u64];
            let tracked = &mut self.people[person];
            tracked.drift.step(world.scenario(), address);
            tracked
                .facing
                .step(world.scenario(), address, joints, &self.sensor_from_room);
            let sight = Sight::of(joints, &flesh, person, errors);
            let enough = if tracked.tracking_id.is_some() {
                JOINTS_TO_HOLD
            } else {
                JOINTS_TO_FIND
            };
            if !errors.field_of_view && !errors.occlusion
                || sight.clear() >= enough.min(joints.len())
            {
                let next = &mut self.next_tracking_id;
                let tracking_id = *tracked.tracking_id.get_or_insert_with(|| {
                    *next += 1;
                    *next - 1
                });
                let mut raw = noisy(
                    world.scenario(),
                    address,
                    joints,
                    &sight,
                    &self.biases,
                    &tracked.drift,
                );
                tracked.facing.swap(&mut raw);
                self.spikes.apply(person, &mut raw);
                bodies.push(SimBody {
                    tracking_id,
                    joints: Joint::ALL.into_iter().map(|joint| raw[joint]).collect(),
                });
            } else {
                tracked.tracking_id = None;
            }
        }
        bodies
    }
}

/// How well each joint of a person is seen.
struct Sight(JointMap<Seen>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    Clearly,
    Hidden,
    OutOfView,
}

impl Sight {
    fn of(
        joints: &JointMap<Position<Sensor>>,
        flesh: &[Flesh],
        person: usize,
        errors: &SensorErrors,
    ) -> Self {
        Self(joints.map(|joint, position| {
            let at = position.vector();
            if errors.field_of_view && !layout::in_view(at) {
                Seen::OutOfView
            } else if errors.occlusion && visible_share(flesh, person, joint, at) < HIDDEN_BELOW {
                Seen::Hidden
            } else {
                Seen::Clearly
            }
        }))
    }

    fn clear(&self) -> usize {
        self.0
            .iter()
            .filter(|(_, seen)| **seen == Seen::Clearly)
            .count()
    }
}

fn confidence(seen: Seen, overconfident: bool) -> Confidence {
    match seen {
        Seen::Hidden if !overconfident => Confidence::saturating(GUESSED),
        _ => Confidence::FULL,
    }
}
