//! The bodies of the people: learned in the first reading of a take, moved in the second.

use std::collections::BTreeMap;

use posefuse_kinematics::{
    Config, HandFilter, HandState, HandsConfig, Learner, Rig, RigPose, Solver,
};
use posefuse_skeleton::{Room, SensorSet, Skeleton, Timestamp, Track, TrackId};

use crate::Who;
use crate::source::Person;

/// In fewer frames than this no pose of a rig may come about at any instant of an export.
const LEAST_TRUNKS: usize = 3;

/// Learns how everybody is built.
#[derive(Default)]
pub(crate) struct Learners(BTreeMap<Who, Learning>);

#[derive(Default)]
struct Learning {
    learner: Learner,
    /// In how many frames of the span that is asked for the trunk was seen, counted up to [`LEAST_TRUNKS`].
    trunks: usize,
}

impl Learners {
    /// Takes in a frame of anywhere in the take; `asked`: it is of the span that is asked for.
    pub(crate) fn add(&mut self, who: &Who, skeleton: &Skeleton<Room>, asked: bool) {
        if !self.0.contains_key(who) {
            self.0.insert(who.clone(), Learning::default());
        }
        if let Some(learning) = self.0.get_mut(who) {
            learning.learner.add(skeleton);
            if asked && learning.trunks < LEAST_TRUNKS {
                learning.trunks += usize::from(Solver::can_begin(skeleton));
            }
        }
    }

    /// What moves a person's rig; `None` for who was never shown, and whose trunk was not: nothing tells where they are.
    pub(crate) fn mover(&self, who: &Who, config: &Config) -> Option<Mover> {
        let learning = self.0.get(who)?;
        if learning.trunks < LEAST_TRUNKS {
            return None;
        }
        let body = learning.learner.body();
        let solver = Solver::new(&body, config.clone());
        Some(Mover {
            solver,
            since: None,
        })
    }
}

/// A person's rig and what moves it.
pub(crate) struct Mover {
    solver: Solver,
    since: Option<Timestamp>,
}

impl Mover {
    /// The bones of the person: the same in every frame.
    pub(crate) fn rig(&self) -> &Rig {
        self.solver.rig()
    }

    /// The pose at `time`, which is later than the last one's; `None` until a trunk has been seen.
    pub(crate) fn pose(&mut self, time: Timestamp, person: &Person) -> Option<RigPose> {
        let track = Track {
            id: TrackId(0),
            since: *self.since.get_or_insert(time),
            sensors: SensorSet::EMPTY,
            skeleton: person.skeleton.clone(),
            hands: person.hands,
        };
        Some(self.solver.step(&track, time)?.pose)
    }
}

/// Whether a person's hands are open or closed, frame after frame, for tables: with or without a rig.
pub(crate) struct Hands([HandFilter; 2]);

impl Hands {
    pub(crate) fn new(config: &HandsConfig) -> Self {
        Self([0, 1].map(|_| HandFilter::new(config.clone())))
    }

    /// The left and the right hand at `time`; `None` while nothing was said of it.
    pub(crate) fn step(&mut self, time: Timestamp, person: &Person) -> [Option<HandState>; 2] {
        for (hand, votes) in self.0.iter_mut().zip(&person.hands) {
            hand.take(votes.as_ref(), time);
        }
        [0, 1].map(|side| self.0[side].state())
    }
}
