//! People who move: procedural ones made from a seed, or recorded clips.
//!
//! A [`Performance`] says where the joints of each person are at any time. Room axes: x forward, y left, z up,
//! metres, floor at z = 0. Positions are a pure function of time.

mod action;
mod choreography;
mod clip;
mod curve;
mod kinematics;
mod person;
mod route;
mod script;
mod shape;
mod situation;
mod situations;
mod steps;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_skeleton::{JointMap, Position, Room};

pub use action::{Action, Side};
pub use clip::{Clip, ClipError};
pub use script::{Script, TimedAction};
pub use shape::BodyShape;
pub use situation::Situation;

pub(crate) use person::sitting_still;

use person::Person;

/// About how long a procedural performance goes on before it begins again, seconds.
const ROUND_S: f64 = 240.0;

/// What a procedural performance is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cast {
    /// Everything follows from it.
    pub seed: u64,
    /// How many people.
    pub people: usize,
    /// Side of the square they walk in, around the origin, metres.
    pub area_m: f64,
    /// Whether pairs of them hug now and then.
    pub hugs: bool,
    /// What they do most.
    pub situation: Situation,
    /// How long somebody who leaves stays away at most, seconds.
    pub away_s: f64,
}

/// Several people in motion.
#[derive(Clone, Debug)]
pub struct Performance {
    actors: Vec<Actor>,
}

#[derive(Clone, Debug)]
enum Actor {
    Procedural(Box<Person>),
    Recorded {
        clip: Arc<Clip>,
        moved: Vector3<f64>,
    },
}

impl Performance {
    /// People who walk, turn, reach, crouch, sit, wave, cross each other and, on request, hug.
    pub fn procedural(cast: Cast) -> Self {
        let plans = choreography::choreograph(&cast, ROUND_S);
        let person = |(index, plan): (usize, &script::Plan)| {
            let shape = BodyShape::seeded(cast.seed, index);
            let idle = person::idle_stream(cast.seed, index);
            Actor::Procedural(Box::new(Person::new(shape, plan, idle)))
        };
        Self {
            actors: plans.iter().enumerate().map(person).collect(),
        }
    }

    /// One person per clip, moved together (their distances kept) so that the middle of their ways is the origin.
    ///
    /// A clip plays to its end, then backwards to its beginning, and so on: there is no jump.
    pub fn from_clips(clips: impl IntoIterator<Item = Arc<Clip>>) -> Self {
        let clips: Vec<Arc<Clip>> = clips.into_iter().collect();
        let (low, high) = clips.iter().map(|clip| clip.extent()).fold(
            ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]),
            |(low, high), (l, h)| {
                (
                    [low[0].min(l[0]), low[1].min(l[1])],
                    [high[0].max(h[0]), high[1].max(h[1])],
                )
            },
        );
        let moved = Vector3::new(-0.5 * (low[0] + high[0]), -0.5 * (low[1] + high[1]), 0.0);
        Self {
            actors: clips
                .into_iter()
                .map(|clip| Actor::Recorded { clip, moved })
                .collect(),
        }
    }

    /// How many people.
    pub fn people(&self) -> usize {
        self.actors.len()
    }

    /// The joints of person `person` at `seconds` (0 or later). Nobody (no joint) if there is no such person.
    ///
    /// All 25 joints are there for procedural people; a clip has those that its file gives.
    pub fn pose(&self, person: usize, seconds: f64) -> JointMap<Position<Room>> {
        match self.actors.get(person) {
            None => JointMap::empty(),
            Some(Actor::Procedural(person)) => person.pose(seconds),
            Some(Actor::Recorded { clip, moved }) => clip
                .pose(clip.there_and_back(seconds))
                .map(|_, position| position.moved(*moved)),
        }
    }

    /// Whether person `person` is in the room at `seconds`: whoever left is not, until they come back.
    pub fn present(&self, person: usize, seconds: f64) -> bool {
        match self.actors.get(person) {
            None => false,
            Some(Actor::Procedural(person)) => person.present(seconds),
            Some(Actor::Recorded { .. }) => true,
        }
    }

    /// What a procedural person does over one round; `None` for a clip.
    pub fn script(&self, person: usize) -> Option<&Script> {
        self.procedural_person(person).map(Person::script)
    }

    /// The bones of a procedural person; `None` for a clip.
    pub fn shape(&self, person: usize) -> Option<&BodyShape> {
        self.procedural_person(person).map(Person::shape)
    }

    /// After how many seconds a procedural performance begins again; `None` for clips.
    pub fn round_s(&self) -> Option<f64> {
        self.procedural_person(0).map(Person::round)
    }

    /// Whether the left and right foot of a procedural person stand on the floor; `None` for a clip.
    pub fn feet_standing(&self, person: usize, seconds: f64) -> Option<[bool; 2]> {
        self.procedural_person(person)
            .map(|person| person.standing(seconds))
    }

    fn procedural_person(&self, person: usize) -> Option<&Person> {
        match self.actors.get(person)? {
            Actor::Procedural(person) => Some(person),
            Actor::Recorded { .. } => None,
        }
    }
}
