//! Simulated sensors: what a depth sensor and its body tracker would say of the people in a [`World`].
//!
//! Positions are in the sensor's optical frame (x right, y down, z forward), metres, in the order of Kinect v2.
//! Every number comes from the scenario's seed, the sensor's number and the frame's number: a sensor simulated
//! alone says exactly what it says among others, and one that starts late what it would have said anyway.

mod clock;
mod errors;
mod ghosts;
mod layout;
mod noise;
mod occlusion;
mod sight;
mod sightings;
mod spell;
mod swap;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use posefuse_skeleton::{
    AgentTime, JOINT_COUNT, Joint, JointMap, Position, RawJoint, Room, Sensor, Transform,
};

pub use clock::SimClock;
pub use errors::SensorErrors;
pub(crate) use layout::room_from_sensor;

use crate::random::{Purpose, Stream};
use crate::world::World;
use ghosts::{Furniture, Mirror};
use noise::{Address, Biases, Drift, Spikes, noisy};
use occlusion::Flesh;
use sight::{Seen, Sight, confidence};
use spell::Spells;
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

/// What is true of a body that a sensor reported; for evaluation, it never goes with the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodyTruth {
    /// The body's [`SimBody::tracking_id`].
    pub tracking_id: u64,
    /// The person's id as in [`crate::TruePerson`]; `None` for furniture and what was seen in a mirror.
    pub person: Option<u64>,
    /// Whether left and right of the arms (and shoulders), and of the legs (and hips), were exchanged.
    pub swapped: [bool; 2],
}

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
    /// People first, then what is seen of them in the mirror, then the furniture.
    tracked: Vec<Tracked>,
    furniture: Furniture,
    mirror: Mirror,
    spikes: Spikes,
    next_tracking_id: u64,
    before: Vec<SimBody>,
    truth: Vec<BodyTruth>,
}

/// What the sensor remembers of one person, or ghost, from frame to frame.
#[derive(Default)]
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
        let sensor_from_room = world.room_from_sensor(index).inverse();
        let subjects = 2 * people + 1;
        Self {
            index,
            furniture: Furniture::new(scenario, index, &sensor_from_room),
            mirror: Mirror::new(scenario, &sensor_from_room),
            sensor_from_room,
            phase_ns: stream.uniform() * 1e9 / scenario.rate_hz,
            next: 0,
            biases: Biases::new(scenario.seed, index, subjects, &scenario.errors),
            tracked: (0..subjects).map(|_| Tracked::default()).collect(),
            spikes: Spikes::default(),
            next_tracking_id: 1,
            before: Vec::new(),
            truth: Vec::new(),
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

    /// What is true of the bodies of the frame given last, in their order; also of those that got lost on the way.
    pub fn truth(&self) -> &[BodyTruth] {
        &self.truth
    }

    /// The next frame.
    pub fn next_frame(&mut self) -> SimFrame {
        let (number, at_ns) = (self.next, self.next_at_ns());
        self.next += 1;
        let seconds = at_ns as f64 * 1e-9;
        let (seen, truth) = self.look(number, seconds);
        let errors = &self.world.scenario().errors;
        let stale = self.stream(Purpose::Stale, number).chance(errors.stale);
        let bodies = if stale { self.before.clone() } else { seen };
        if !stale {
            self.truth = truth;
        }
        self.before.clone_from(&bodies);
        let gap = self.spells(Purpose::Gap, errors.gaps_per_min, errors.gap_ms);
        let dropped =
            self.stream(Purpose::Drop, number).chance(errors.drops) || gap.at(seconds).is_some();
        let mut arrival = self.stream(Purpose::Arrival, number);
        let jitter_ns = errors.clock_jitter_ms * arrival.normal() * 1e6;
        let delay_ms = errors.delay_ms + errors.delay_jitter_ms * arrival.normal().abs();
        let clock = self.world.sensor_clock(self.index);
        SimFrame {
            number,
            at_ns,
            captured: clock.shows(at_ns).plus_ns(jitter_ns.round() as i64),
            arrival_delay_ns: ((delay_ms + self.held_up_ms(number, seconds)) * 1e6).round() as i64,
            bodies: if dropped { Vec::new() } else { bodies },
            dropped,
        }
    }

    /// How much later than usual frame `number`, captured at `seconds`, gets through.
    fn held_up_ms(&self, number: u64, seconds: f64) -> f64 {
        let scenario = self.world.scenario();
        let errors = &scenario.errors;
        let burst = self.spells(Purpose::Burst, errors.bursts_per_min, errors.burst_ms);
        let until = burst.at(seconds).map_or(0.0, |(_, end)| end - seconds);
        let reordered = self
            .stream(Purpose::Reorder, number)
            .chance(errors.reordered);
        let overtaken = if reordered {
            1.5 / scenario.rate_hz
        } else {
            0.0
        };
        (until + overtaken) * 1e3
    }

    fn spells(&self, purpose: Purpose, per_min: f64, length_ms: f64) -> Spells {
        Spells {
            seed: self.world.scenario().seed,
            purpose,
            sensor: self.index as u64,
            per_min,
            length_s: [length_ms * 1e-3; 2],
        }
    }

    fn stream(&self, purpose: Purpose, frame: u64) -> Stream {
        let seed = self.world.scenario().seed;
        Stream::new(seed, purpose, &[self.index as u64, frame])
    }

    /// Where everybody is who could be seen at `seconds`, sensor frame, in the order of `tracked`; `None` for who is
    /// not there.
    fn subjects(&self, seconds: f64) -> Vec<Option<JointMap<Position<Sensor>>>> {
        let errors = &self.world.scenario().errors;
        let people = self.world.performance().people();
        let mut subjects = vec![None; self.tracked.len()];
        for person in self.world.truth(seconds) {
            let index = person.id as usize - 1;
            let here = |_, p: &Position<Room>| self.sensor_from_room.apply(*p);
            if errors.mirror {
                let image = self.mirror.image(&person.joints);
                subjects[people + index] = (!image.is_empty()).then(|| image.map(here));
            }
            subjects[index] = Some(person.joints.map(here));
        }
        if let (Some((_, joints)), Some(last)) = (self.furniture.at(seconds), subjects.last_mut()) {
            *last = Some(joints.clone());
        }
        subjects
    }

    /// The bodies of frame `number`, taken at `seconds`, and what is true of them.
    fn look(&mut self, number: u64, seconds: f64) -> (Vec<SimBody>, Vec<BodyTruth>) {
        let world = Arc::clone(&self.world);
        let people = world.performance().people();
        let subjects = self.subjects(seconds);
        let furniture = subjects.len() - 1;
        let flesh = |(index, joints): (usize, &Option<JointMap<Position<Sensor>>>)| {
            let hides = joints.as_ref().filter(|_| index != furniture);
            Flesh::new(hides.unwrap_or(&JointMap::empty()))
        };
        let desk = Flesh::desk(world.scenario(), self.index, &self.sensor_from_room);
        let flesh: Vec<Flesh> = subjects.iter().enumerate().map(flesh).chain(desk).collect();
        self.spikes
            .step(self.index, number, people, world.scenario());
        let (mut bodies, mut truth) = (Vec::new(), Vec::new());
        for (subject, joints) in subjects.iter().enumerate() {
            let address = [self.index as u64, number, subject as u64];
            match joints {
                None => self.tracked[subject] = Tracked::default(),
                Some(joints) => {
                    let Some(body) = self.report(address, joints, &flesh) else {
                        continue;
                    };
                    truth.push(BodyTruth {
                        tracking_id: body.tracking_id,
                        person: (subject < people).then_some(subject as u64 + 1),
                        swapped: self.tracked[subject].facing.swapped(),
                    });
                    bodies.push(body);
                }
            }
        }
        (bodies, truth)
    }

    /// What the tracker makes of the joints of subject `address[2]`, if it finds or holds them.
    fn report(
        &mut self,
        address: Address,
        joints: &JointMap<Position<Sensor>>,
        flesh: &[Flesh],
    ) -> Option<SimBody> {
        let scenario = self.world.scenario();
        let subject = address[2] as usize;
        let tracked = &mut self.tracked[subject];
        tracked.drift.step(scenario, address);
        tracked
            .facing
            .step(scenario, address, joints, &self.sensor_from_room);
        let errors = &scenario.errors;
        let sight = Sight::of(joints, flesh, subject, errors);
        // A clip may lack joints; what a mirror shows of somebody is a part of them.
        let ghost = subject >= self.world.performance().people();
        let of_all = if ghost { JOINT_COUNT } else { joints.len() };
        let enough = if tracked.tracking_id.is_some() {
            JOINTS_TO_HOLD
        } else {
            JOINTS_TO_FIND
        };
        let found =
            !errors.field_of_view && !errors.occlusion || sight.clear() >= enough.min(of_all);
        if !found {
            tracked.tracking_id = None;
            return None;
        }
        let next = &mut self.next_tracking_id;
        let tracking_id = *tracked.tracking_id.get_or_insert_with(|| {
            *next += 1;
            *next - 1
        });
        let drift = &tracked.drift;
        let mut raw = noisy(scenario, address, joints, &sight, &self.biases, drift);
        tracked.facing.swap(&mut raw);
        self.spikes.apply(subject, &mut raw);
        Some(SimBody {
            tracking_id,
            joints: Joint::ALL.into_iter().map(|joint| raw[joint]).collect(),
        })
    }
}
