//! How far fused people are from where the simulated ones truly are.

use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_evaluate::{SimulatedRoom, compare};
use posefuse_session::{TruePerson, Truth};
use posefuse_simulator::World;
use posefuse_skeleton::{Joint, Position, RoomFrame, TrackId};
use serde::Serialize;

/// Gathers the errors of a whole take.
pub(super) struct Errors {
    world: Arc<World>,
    joints_m: Vec<f32>,
    by_joint: BTreeMap<&'static str, (f64, u64)>,
    people: u64,
    missed: u64,
    tracks: u64,
    extra: u64,
    /// The track that last followed each person.
    followed_by: BTreeMap<u64, TrackId>,
    identity_changes: u64,
}

/// The errors of a whole take.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ErrorView {
    /// Mean per-joint position error.
    pub(crate) mpjpe_mm: f64,
    pub(crate) median_mm: f64,
    pub(crate) p95_mm: f64,
    /// Share of people, over all frames, that no track follows; and of tracks that follow nobody.
    pub(crate) missed_share: f64,
    pub(crate) extra_share: f64,
    /// How often a person's track was another one than before.
    pub(crate) identity_changes: u64,
    /// Mean error of each joint.
    pub(crate) by_joint_mm: BTreeMap<&'static str, f64>,
}

impl Errors {
    /// Against this world.
    pub(super) fn new(world: &Arc<World>) -> Self {
        Self {
            world: Arc::clone(world),
            joints_m: Vec::new(),
            by_joint: BTreeMap::new(),
            people: 0,
            missed: 0,
            tracks: 0,
            extra: 0,
            followed_by: BTreeMap::new(),
            identity_changes: 0,
        }
    }

    /// Compares a frame, and gives the truth of its instant for the take.
    pub(super) fn add(&mut self, frame: &RoomFrame) -> Truth {
        let truth = self
            .world
            .truth(SimulatedRoom::scenario_seconds(frame.time));
        let comparison = compare(frame, &truth);
        self.people += truth.len() as u64;
        self.missed += comparison.missed.len() as u64;
        self.tracks += frame.tracks.len() as u64;
        self.extra += comparison.extra.len() as u64;
        for pair in &comparison.pairs {
            let before = self.followed_by.insert(pair.person, pair.track);
            self.identity_changes += u64::from(before.is_some_and(|before| before != pair.track));
            for (joint, error) in pair.errors.iter() {
                self.joints_m.push(*error as f32);
                let (sum, count) = self.by_joint.entry(joint.name()).or_default();
                *sum += error;
                *count += 1;
            }
        }
        let person = |person: &posefuse_simulator::TruePerson| TruePerson {
            id: person.id,
            joints: Joint::ALL
                .map(|joint| person.joints[joint].unwrap_or(Position::new(0.0, 0.0, 0.0))),
        };
        Truth {
            time: frame.time,
            people: truth.iter().map(person).collect(),
        }
    }

    /// What has been gathered.
    pub(super) fn view(mut self) -> ErrorView {
        self.joints_m.sort_by(f32::total_cmp);
        let at = |share: f64| {
            let index = (self.joints_m.len().saturating_sub(1) as f64 * share).round() as usize;
            self.joints_m
                .get(index)
                .map_or(f64::NAN, |error| f64::from(*error) * 1e3)
        };
        let mean = |sum: f64, count: u64| sum * 1e3 / count as f64;
        let (sum, count) = self
            .by_joint
            .values()
            .fold((0.0, 0), |(s, c), (sum, count)| (s + sum, c + count));
        let share = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
        ErrorView {
            mpjpe_mm: mean(sum, count),
            median_mm: at(0.5),
            p95_mm: at(0.95),
            missed_share: share(self.missed, self.people),
            extra_share: share(self.extra, self.tracks),
            identity_changes: self.identity_changes,
            by_joint_mm: self
                .by_joint
                .iter()
                .map(|(joint, (sum, count))| (*joint, mean(*sum, *count)))
                .collect(),
        }
    }
}
