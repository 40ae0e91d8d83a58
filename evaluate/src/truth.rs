//! What is known of where people truly are.

use std::sync::Arc;

use nalgebra::Matrix3;
use posefuse_simulator::{TruePerson, World};
use posefuse_skeleton::{Joint, JointMap, Timestamp};

use crate::room::SimulatedRoom;

/// Two recorded truths further apart than this say nothing of the time between, nanoseconds.
const LONGEST_GAP_NS: i64 = 250_000_000;
/// Time between two looks at which sensors see which joints, seconds.
const LOOK_EVERY_S: f64 = 1.0 / 30.0;

/// Where people truly are.
pub trait Truth: Sync {
    /// Everybody at `time`; `None` where nobody knows.
    fn people(&self, time: Timestamp) -> Option<Vec<TruePerson>>;

    /// Everybody displaced by the part of the error that no sensor can see, where that is known.
    fn reported(&self, time: Timestamp) -> Option<Vec<TruePerson>> {
        self.people(time)
    }

    /// How many sensors truly see each joint of each person, where that is known. A joint that none sees is absent.
    fn sighted(&self, _time: Timestamp) -> Option<&[Sighted]> {
        None
    }
}

/// Which joints of a person are truly seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighted {
    /// The person.
    pub person: u64,
    /// By how many sensors each joint is.
    pub joints: JointMap<u32>,
}

/// The truth of a simulated room.
pub struct SimulatedTruth {
    world: Arc<World>,
    looks: Vec<Vec<Sighted>>,
    bound_m: Vec<f64>,
}

impl SimulatedTruth {
    /// The truth of the first `seconds` of a world. Works out which sensor sees which joint, 30 times a second.
    pub fn new(world: &Arc<World>, seconds: f64) -> Self {
        let count = (seconds / LOOK_EVERY_S).ceil().max(0.0) as usize + 1;
        let (mut looks, mut bound_m) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for index in 0..count {
            let (look, bound) = look(world, index as f64 * LOOK_EVERY_S);
            looks.push(look);
            bound_m.push(bound);
        }
        Self {
            world: Arc::clone(world),
            looks,
            bound_m,
        }
    }

    /// The noise bound B of this room from `from_s` on: root mean square of the error that is left when every error
    /// is known but the white and the slow noise of those sensors that truly see the joint, and their measurements of
    /// one instant are combined by inverse covariance. Over all joints that at least one sensor sees; metres.
    ///
    /// A filter that remembers may be better: the bound forgets everything from frame to frame.
    pub fn noise_bound_m(&self, from_s: f64) -> Option<f64> {
        let first = (from_s / LOOK_EVERY_S).ceil().max(0.0) as usize;
        let values = self.bound_m.iter().skip(first).filter(|b| b.is_finite());
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), b| (sum + b * b, count + 1.0));
        (count > 0.0).then(|| f64::sqrt(sum / count))
    }

    fn seconds(time: Timestamp) -> f64 {
        SimulatedRoom::scenario_seconds(time).max(0.0)
    }
}

/// Who is seen by whom at one instant, and the root mean square of the bound over all joints that are.
fn look(world: &World, seconds: f64) -> (Vec<Sighted>, f64) {
    let truth = world.truth(seconds);
    let mut information: Vec<JointMap<(u32, Matrix3<f64>)>> = vec![JointMap::empty(); truth.len()];
    for sensor in 0..world.sensor_count() {
        for (person, seen) in world.sightings(sensor, seconds).iter().enumerate() {
            for (joint, covariance) in seen.iter() {
                let slot = information[person][joint].get_or_insert((0, Matrix3::zeros()));
                slot.0 += 1;
                // Without noise there is no bound either.
                let inverse = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
                slot.1 += inverse;
            }
        }
    }
    let (mut squares, mut count) = (0.0, 0.0);
    for (_, (_, information)) in information.iter().flat_map(JointMap::iter) {
        if let Some(covariance) = information.try_inverse() {
            squares += covariance.trace();
            count += 1.0;
        }
    }
    let sighted = truth
        .iter()
        .zip(&information)
        .map(|(person, seen)| Sighted {
            person: person.id,
            joints: seen.map(|_, (sensors, _)| *sensors),
        });
    (sighted.collect(), f64::sqrt(squares / count))
}

impl Truth for SimulatedTruth {
    fn people(&self, time: Timestamp) -> Option<Vec<TruePerson>> {
        Some(self.world.truth(Self::seconds(time)))
    }

    fn reported(&self, time: Timestamp) -> Option<Vec<TruePerson>> {
        Some(self.world.reported_truth(Self::seconds(time)))
    }

    fn sighted(&self, time: Timestamp) -> Option<&[Sighted]> {
        let index = (Self::seconds(time) / LOOK_EVERY_S).round() as usize;
        let last = self.looks.len().saturating_sub(1);
        self.looks.get(index.min(last)).map(Vec::as_slice)
    }
}

/// A truth that was recorded with a take: poses at instants, straight lines between.
#[derive(Clone, Debug, Default)]
pub struct RecordedTruth {
    instants: Vec<(Timestamp, Vec<TruePerson>)>,
}

impl RecordedTruth {
    /// From poses at instants, in any order. A joint at exactly (0, 0, 0) counts as missing.
    pub fn new(instants: impl IntoIterator<Item = (Timestamp, Vec<TruePerson>)>) -> Self {
        let there = |person: TruePerson| TruePerson {
            joints: person.joints.filter_map(|_, position| {
                (position.vector() != nalgebra::Vector3::zeros()).then_some(*position)
            }),
            ..person
        };
        let mut instants: Vec<_> = instants
            .into_iter()
            .map(|(time, people)| (time, people.into_iter().map(there).collect()))
            .collect();
        instants.sort_by_key(|(time, _)| *time);
        instants.dedup_by_key(|(time, _)| *time);
        Self { instants }
    }

    /// Whether nothing is known at all.
    pub fn is_empty(&self) -> bool {
        self.instants.is_empty()
    }
}

impl Truth for RecordedTruth {
    fn people(&self, time: Timestamp) -> Option<Vec<TruePerson>> {
        let after = self.instants.partition_point(|(at, _)| *at < time);
        let (next, people) = self.instants.get(after)?;
        if *next == time {
            return Some(people.clone());
        }
        let (before, earlier) = self.instants.get(after.checked_sub(1)?)?;
        let gap_ns = next.since_ns(*before);
        if gap_ns > LONGEST_GAP_NS {
            return None;
        }
        let share = time.since_ns(*before) as f64 / gap_ns as f64;
        let between = |person: &TruePerson| {
            let later = people.iter().find(|later| later.id == person.id)?;
            let joint = |joint: Joint, from: &_| {
                let to = later.joints[joint]?;
                Some(posefuse_skeleton::Position::lerp(*from, to, share))
            };
            Some(TruePerson {
                id: person.id,
                joints: person.joints.filter_map(joint),
            })
        };
        Some(earlier.iter().filter_map(between).collect())
    }
}

#[cfg(test)]
mod tests {
    use posefuse_simulator::{Layout, Scenario, SensorErrors};
    use posefuse_skeleton::Position;

    use super::*;

    #[test]
    fn between_two_instants_people_go_straight_and_over_a_gap_nobody_knows() {
        let person = |x: f64| TruePerson {
            id: 4,
            joints: [(Joint::Head, Position::new(x, 1.0, 1.6))]
                .into_iter()
                .collect(),
        };
        let at = Timestamp::from_seconds;
        let truth = RecordedTruth::new([
            (at(1.1), vec![person(1.0)]),
            (at(1.0), vec![person(0.0)]),
            (at(9.0), vec![person(0.0)]),
        ]);
        let found = truth.people(at(1.025)).unwrap();
        let head = found[0].joints[Joint::Head].unwrap();
        assert!(head.distance(Position::new(0.25, 1.0, 1.6)) < 1e-9);
        assert_eq!(truth.people(at(5.0)), None);
        assert_eq!(truth.people(at(0.9)), None);
        assert_eq!(truth.people(at(9.0)).unwrap().len(), 1);
    }

    /// The figures of the comparison that the project began with: 20.4, 13.2, 9.8, 8.5 and 6.9 mm with 1, 2, 3, 4 and 6
    /// sensors that all see the joint.
    #[test]
    fn the_bound_is_the_noise_of_those_who_see() {
        for (sensors, known_mm) in [(1, 20.4), (2, 13.2), (3, 9.8), (4, 8.5), (6, 6.9)] {
            let bound = |seed: u64| {
                let scenario = Scenario {
                    seed,
                    sensors,
                    layout: Layout::Ring,
                    errors: SensorErrors {
                        white_noise: 1.0,
                        correlated_lateral_mm: 6.0,
                        correlated_axial_mm: 10.0,
                        ..SensorErrors::none()
                    },
                    ..Scenario::default()
                };
                let world = Arc::new(World::new(&scenario).unwrap());
                SimulatedTruth::new(&world, 3.0).noise_bound_m(0.0).unwrap() * 1e3
            };
            let mean = (1..=4).map(bound).sum::<f64>() / 4.0;
            let ratio = mean / known_mm;
            assert!((0.8..1.25).contains(&ratio), "{sensors} sensors: {mean} mm");
        }
    }
}
