//! How good the body tracker is: rendered depth of simulated people through all of it, against the truth; and several sensors with
//! it, fused, beside each of them alone ([`together`]).
//!
//! A person is to be found in an image if at least [`LEAST_PIXELS`] of theirs are measured (of an image 320 wide). Joints outside of the image do not
//! count; a joint is visible if its own surface is seen ([`DepthView::sees`]).

mod hands;
mod rows;
mod tally;
pub mod together;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_bodytrack::{BodyTracker, Step, TrackedBody, TrackerConfig, TrackerError};
use posefuse_simulator::depth::{DepthCamera, DepthView, hands_closed};
use posefuse_simulator::motion::Clip;
use posefuse_simulator::{Scenario, Situation, World, WorldError};
use posefuse_skeleton::{Joint, Position, Sensor};
use serde::Serialize;
use thiserror::Error;

use crate::parallel::in_parallel;
use tally::{Pose, RIGHT_M, sides_are_right, torso, towards_sensor};

pub use hands::{HandKind, Votes};
pub use rows::{
    hands as hand_rows, kinds as kind_rows, reliability as reliability_rows, speed as speed_rows,
};
pub use tally::{Distances, Kind, Reliability, Said};

/// See above.
pub const LEAST_PIXELS: usize = 500;
/// A body is a person's if their trunks are nearer than this, metres.
const SAME_M: f64 = 0.6;
/// Images a second.
const RATE_HZ: f64 = 30.0;
/// Cosines of front and back.
const FRONT: f64 = 0.5;
/// Distances at which a new kind begins, metres.
const FAR_M: [f64; 2] = [2.5, 3.5];

/// What is tried.
pub struct Trials {
    /// Rooms with the simulator's own people: how many in each.
    pub people: Vec<usize>,
    /// What these do.
    pub situations: Vec<Situation>,
    /// Each room with each of these.
    pub seeds: Vec<u64>,
    /// Recorded people, each alone in a room.
    pub clips: Vec<Arc<Clip>>,
    /// How long each is watched, seconds.
    pub seconds: f64,
    /// How much of that does not count, while the tracker learns the room, seconds.
    pub skip_s: f64,
    /// The sensor.
    pub camera: DepthCamera,
    /// The tracker.
    pub tracker: TrackerConfig,
    /// How many rooms are worked on at once.
    pub threads: usize,
}

/// Why nothing was tried.
#[derive(Debug, Error)]
pub enum TrialError {
    /// There is no such room.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The tracker cannot work.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
    /// More sensors than a room may have.
    #[error(transparent)]
    Sensors(#[from] posefuse_skeleton::SensorIdError),
}

/// The result.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BodytrackReport {
    /// What runs the network.
    pub runtime: String,
    /// By kind: `all`, `facing front`, `1 person`, ...
    pub kinds: BTreeMap<String, Kind>,
    /// Bodies where nobody is, in all images.
    pub of_nobody: u64,
    /// Images that count.
    pub images: u64,
    /// How often a person's id changed.
    pub id_changes: u64,
    /// Seconds of people followed.
    pub followed_s: f64,
    /// Of all joints in the image.
    pub reliability: Reliability,
    /// Of all votes on hands: of being closed.
    pub hands: Reliability,
    /// By people in the room: ms per image and step, all of them.
    #[serde(skip)]
    pub times: BTreeMap<usize, Vec<[f64; Step::ALL.len()]>>,
}

/// A room that is watched by one of its sensors.
struct Room {
    world: World,
    sensor: usize,
    people: usize,
}

impl Trials {
    /// Tries everything. `done` hears how many rooms are.
    ///
    /// # Errors
    /// There is no such room, or the tracker cannot work.
    pub fn run(&self, done: &(dyn Fn(usize) + Sync)) -> Result<BodytrackReport, TrialError> {
        let rooms = self.rooms()?;
        let count = std::sync::atomic::AtomicUsize::new(0);
        let work = |at: usize| {
            let report = self.watch(&rooms[at]);
            done(1 + count.fetch_add(1, std::sync::atomic::Ordering::Relaxed));
            report
        };
        let mut together = BodytrackReport::default();
        for report in in_parallel(rooms.len(), self.threads, &work) {
            together.merge(report?);
        }
        Ok(together)
    }

    /// How many rooms there are.
    pub fn count(&self) -> usize {
        self.people.len() * self.situations.len() * self.seeds.len() + self.clips.len()
    }

    fn rooms(&self) -> Result<Vec<Room>, TrialError> {
        let mut rooms = Vec::new();
        for &people in &self.people {
            for &situation in &self.situations {
                for &seed in &self.seeds {
                    let scenario = Scenario {
                        seed,
                        people,
                        situation,
                        ..Scenario::default()
                    };
                    rooms.push(Room {
                        world: World::new(&scenario)?,
                        sensor: seed as usize % scenario.sensors,
                        people,
                    });
                }
            }
        }
        for (number, clip) in self.clips.iter().enumerate() {
            let scenario = Scenario {
                // Builds and rooms that no other trial has.
                seed: 70_000 + number as u64,
                ..Scenario::default()
            };
            rooms.push(Room {
                world: World::with_clips(&scenario, [clip.clone()])?,
                sensor: number % scenario.sensors,
                people: 1,
            });
        }
        Ok(rooms)
    }

    fn watch(&self, room: &Room) -> Result<BodytrackReport, TrialError> {
        let mut tracker = BodyTracker::new(self.tracker.clone(), self.camera.intrinsics)?;
        let mut report = BodytrackReport {
            runtime: tracker.runtime().to_string(),
            ..BodytrackReport::default()
        };
        let mut ids = BTreeMap::new();
        for image in 0..(self.seconds * RATE_HZ) as usize {
            let seconds = image as f64 / RATE_HZ;
            let view = room
                .world
                .depth_with_owners(room.sensor, seconds, &self.camera);
            let bodies = tracker.track(&view.image, (seconds * 1e9) as i64)?;
            if seconds < self.skip_s {
                continue;
            }
            let steps = Step::ALL.map(|step| tracker.steps().took(step).as_secs_f64() * 1e3);
            report.times.entry(room.people).or_default().push(steps);
            report.judge(room, seconds, &self.camera, &view, &bodies, &mut ids);
        }
        Ok(report)
    }
}

impl BodytrackReport {
    fn judge(
        &mut self,
        room: &Room,
        seconds: f64,
        camera: &DepthCamera,
        view: &DepthView,
        bodies: &[TrackedBody],
        ids: &mut BTreeMap<u64, u64>,
    ) {
        self.images += 1;
        let room_from_sensor = room.world.room_from_sensor(room.sensor);
        let sensor_from_room = room_from_sensor.inverse();
        let up = sensor_from_room.rotate(Vector3::z());
        let mut taken = BTreeSet::new();
        for person in room.world.truth(seconds) {
            let truth: Pose = person.joints.map(|_, at| sensor_from_room.apply(*at));
            let number = person.id as u8;
            let owned = view.owners.iter().zip(&view.image.millimetres);
            let pixels = owned
                .filter(|(owner, mm)| **owner == number && **mm > 0)
                .count();
            let body = nearest(bodies, &truth, &taken);
            taken.extend(body.map(|body| body.id));
            let wide = f64::from(camera.intrinsics.width) / 320.0;
            if (pixels as f64) < LEAST_PIXELS as f64 * wide * wide {
                continue;
            }
            let mut kind = Kind {
                people: 1,
                found: u64::from(body.is_some()),
                ..Kind::default()
            };
            if let Some(body) = body {
                self.followed_s += 1.0 / RATE_HZ;
                let before = ids.insert(person.id, body.id);
                self.id_changes += u64::from(before.is_some_and(|before| before != body.id));
                kind.sides_right = u64::from(sides_are_right(body, &truth));
                let sees = |joint: Joint, at: &Position<Sensor>| {
                    view.sees(&camera.intrinsics, number, joint, at)
                };
                self.joints(&mut kind, body, &truth, sees);
                let (seed, index) = (room.world.scenario().seed, person.id as usize - 1);
                let closed = hands_closed(seed, index, seconds);
                hands::count(&mut kind, &mut self.hands, body, closed, |joint| {
                    sees(joint, &truth[joint]?)
                });
            }
            for name in kinds(room.people, &truth, &up) {
                self.kinds.entry(name).or_default().merge(&kind);
            }
        }
        let free = bodies.iter().filter(|body| !taken.contains(&body.id));
        self.of_nobody += free.count() as u64;
    }

    fn joints(
        &mut self,
        kind: &mut Kind,
        body: &TrackedBody,
        truth: &Pose,
        sees: impl Fn(Joint, &Position<Sensor>) -> Option<bool>,
    ) {
        for (joint, at) in truth.iter() {
            let (Some((found, confidence)), Some(seen)) = (body.joints[joint], sees(joint, at))
            else {
                continue;
            };
            let distance_m = found.distance(*at);
            let distances = if seen {
                &mut kind.visible
            } else {
                &mut kind.hidden
            };
            distances.add(distance_m);
            self.reliability
                .add(f64::from(confidence.get()), distance_m < RIGHT_M);
        }
    }

    fn merge(&mut self, other: Self) {
        self.runtime = other.runtime;
        for (name, kind) in &other.kinds {
            self.kinds.entry(name.clone()).or_default().merge(kind);
        }
        self.of_nobody += other.of_nobody;
        self.images += other.images;
        self.id_changes += other.id_changes;
        self.followed_s += other.followed_s;
        self.reliability.merge(&other.reliability);
        self.hands.merge(&other.hands);
        for (people, times) in other.times {
            self.times.entry(people).or_default().extend(times);
        }
    }
}

/// The body whose trunk is nearest to the person's.
fn nearest<'a>(
    bodies: &'a [TrackedBody],
    truth: &Pose,
    taken: &BTreeSet<u64>,
) -> Option<&'a TrackedBody> {
    let middle = torso(|joint| truth[joint])?;
    let far = |body: &TrackedBody| {
        let found = torso(|joint| Some(body.joints[joint]?.0));
        found.map_or(f64::INFINITY, |found| (found - middle).norm())
    };
    let free = bodies.iter().filter(|body| !taken.contains(&body.id));
    free.map(|body| (far(body), body))
        .filter(|(far, _)| *far < SAME_M)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, body)| body)
}

/// The names of the kinds that a person belongs to.
fn kinds(people: usize, truth: &Pose, up: &Vector3<f64>) -> Vec<String> {
    let mut names = vec!["all".to_owned()];
    if let Some(towards) = towards_sensor(truth, up) {
        names.push(
            match towards {
                towards if towards > FRONT => "facing front",
                towards if towards < -FRONT => "facing back",
                _ => "facing side",
            }
            .to_owned(),
        );
    }
    if let Some(middle) = torso(|joint| truth[joint]) {
        names.push(match middle.norm() {
            far if far < FAR_M[0] => format!("nearer than {} m", FAR_M[0]),
            far if far < FAR_M[1] => format!("{} to {} m", FAR_M[0], FAR_M[1]),
            _ => format!("over {} m", FAR_M[1]),
        });
    }
    names.push(match people {
        1 => "1 person".to_owned(),
        n => format!("{n} people"),
    });
    names
}
