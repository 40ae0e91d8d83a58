//! Everybody in the room, live: bodies learned while people move, one pose per person and frame.
//!
//! Nobody knows at first how a person is built, and a rig whose bones change in every frame is of no use to a tool. So a
//! person has no figure for a third of a second, then a rig that is looked at again after 1, 2, 4, 8 and 16 seconds in view,
//! changed where a bone is off by more than 5 mm, and left alone ever after. Who is gone is forgotten after a while: track
//! ids are never used again.

use std::collections::BTreeMap;
use std::sync::Arc;

use posefuse_skeleton::{JointMap, Position, Room, RoomFrame, Timestamp, Track, TrackId};

use crate::body::{Body, Learner};
use crate::config::Config;
use crate::feet::Contact;
use crate::hands::HandState;
use crate::rig::{Rig, RigPose};
use crate::solver::Solver;

/// Frames in which a person must have been seen before they have a figure: fewer tell no lengths.
const FIRST_FRAMES: u32 = 10;
/// When lengths are looked at again, seconds in view.
const LOOKS_S: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
/// A rig is changed where a bone's end would move by more than this against its beginning, metres.
const CHANGE_M: f64 = 0.005;
/// Longer steps than this do not count as in view, seconds.
const LONGEST_STEP_S: f64 = 0.2;
/// Who was not seen for this long is forgotten, seconds.
const GONE_S: f64 = 10.0;
/// Most people that are remembered beyond those in the frame.
const MOST_GONE: usize = 64;
/// A clock that goes back by more than this is another one, seconds.
const OTHER_CLOCK_S: f64 = 1.0;

/// One person at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Who it is.
    pub id: TrackId,
    /// Their bones: the same allocation until `revision` changes.
    pub rig: Arc<Rig>,
    /// Counts up from 0 when the rig's lengths have changed.
    pub revision: u32,
    /// The pose of that rig.
    pub pose: RigPose,
    /// All canonical joints as the pose has them, room metres.
    pub joints: JointMap<Position<Room>>,
    /// The left and the right hand; `None` while nobody said anything of it.
    pub hands: [Option<HandState>; 2],
    /// What of the left and the right foot stands on the floor.
    pub contacts: [Contact; 2],
    /// How far the pose's joints are from the fused ones, root mean square, metres; `None` where none was fused.
    pub residual_m: Option<f64>,
}

/// Makes figures of everybody in a room, frame by frame.
///
/// ```
/// use posefuse_kinematics::{Body, Config, Crowd};
/// use posefuse_skeleton::{RoomFrame, Timestamp, TrackId};
///
/// let mut crowd = Crowd::new(Config::default());
/// // A person whose measures are known from a walk or a T-pose needs none of the first seconds.
/// crowd.set_body(TrackId(1), &Body::of_height(1.82));
/// let empty = RoomFrame { number: 0, time: Timestamp::ZERO, look_ahead_ns: 0, tracks: Vec::new() };
/// assert!(crowd.step(&empty).is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Crowd {
    config: Config,
    members: BTreeMap<TrackId, Member>,
    last: Option<Timestamp>,
}

impl Crowd {
    /// An empty room. `config` should be [valid](Config::validate).
    pub fn new(config: Config) -> Self {
        Self {
            config,
            members: BTreeMap::new(),
            last: None,
        }
    }

    /// The people of this frame, in the order of its tracks. Whoever was seen too little, or without a trunk, has no figure
    /// yet.
    ///
    /// Frames should come in order of time; where the clock goes back by more than a second everybody is forgotten.
    pub fn step(&mut self, frame: &RoomFrame) -> Vec<Figure> {
        let back_s = self.last.map_or(0.0, |last| last.since_seconds(frame.time));
        if back_s > OTHER_CLOCK_S {
            self.members.clear();
        }
        self.last = Some(frame.time);
        let mut figures = Vec::with_capacity(frame.tracks.len());
        for track in &frame.tracks {
            let member = self.members.entry(track.id).or_default();
            figures.extend(member.step(track, frame.time, &self.config));
        }
        self.forget(frame);
        figures
    }

    /// Says how a person is built, who may be yet to come: learning ends, and their rig follows with the next frame.
    pub fn set_body(&mut self, id: TrackId, body: &Body) {
        let member = self.members.entry(id).or_default();
        member.learning = None;
        member.wear(body, &self.config);
    }

    /// The measures of a person who has a figure.
    pub fn body(&self, id: TrackId) -> Option<&Body> {
        let worn = self.members.get(&id)?.worn.as_ref()?;
        Some(worn.solver.body())
    }

    /// Whoever is gone for long, and of the others the longest gone, where there are too many.
    fn forget(&mut self, frame: &RoomFrame) {
        let gone_s = |member: &Member| member.seen.map(|seen| frame.time.since_seconds(seen));
        self.members
            .retain(|_, member| gone_s(member).is_none_or(|gone| gone < GONE_S));
        let many = self.members.len().saturating_sub(frame.tracks.len());
        if many <= MOST_GONE {
            return;
        }
        let mut gone: Vec<(Option<Timestamp>, TrackId)> = self
            .members
            .iter()
            .filter(|(_, member)| member.seen != Some(frame.time))
            .map(|(id, member)| (member.seen, *id))
            .collect();
        gone.sort_unstable();
        for (_, id) in gone.iter().take(many - MOST_GONE) {
            self.members.remove(id);
        }
    }
}

/// A person.
#[derive(Clone, Debug)]
struct Member {
    /// `None` once the lengths are settled.
    learning: Option<Box<Learning>>,
    worn: Option<Worn>,
    /// When last; `None` for who is yet to come.
    seen: Option<Timestamp>,
}

/// What a person's lengths are learned from.
#[derive(Clone, Debug, Default)]
struct Learning {
    learner: Learner,
    frames: u32,
    in_view_s: f64,
    /// How many of [`LOOKS_S`] are done.
    looks: usize,
}

/// A rig, and what moves it.
#[derive(Clone, Debug)]
struct Worn {
    rig: Arc<Rig>,
    revision: u32,
    solver: Solver,
}

impl Default for Member {
    fn default() -> Self {
        Self {
            learning: Some(Box::default()),
            worn: None,
            seen: None,
        }
    }
}

impl Member {
    fn step(&mut self, track: &Track, at: Timestamp, config: &Config) -> Option<Figure> {
        let elapsed = self.seen.map_or(0.0, |seen| at.since_seconds(seen));
        self.seen = Some(at);
        self.learn(track, elapsed, config);
        let worn = self.worn.as_mut()?;
        let solved = worn.solver.step(track, at)?;
        Some(Figure {
            id: track.id,
            rig: Arc::clone(&worn.rig),
            revision: worn.revision,
            pose: solved.pose,
            joints: solved.joints,
            hands: solved.hands,
            contacts: solved.contacts,
            residual_m: solved.residual_m,
        })
    }

    /// Takes in a frame, and gives the person another rig when it is time to.
    fn learn(&mut self, track: &Track, elapsed: f64, config: &Config) {
        let Some(learning) = &mut self.learning else {
            return;
        };
        learning.learner.add(&track.skeleton);
        learning.frames = learning.frames.saturating_add(1);
        if (0.0..=LONGEST_STEP_S).contains(&elapsed) {
            learning.in_view_s += elapsed;
        }
        let due = LOOKS_S
            .get(learning.looks)
            .is_some_and(|look_s| learning.in_view_s >= *look_s);
        let first = self.worn.is_none() && learning.frames >= FIRST_FRAMES;
        if !due && !first {
            return;
        }
        learning.looks += usize::from(due);
        let body = learning.learner.body();
        let settled = learning.looks == LOOKS_S.len();
        self.wear(&body, config);
        if settled {
            self.learning = None;
        }
    }

    /// Gives the person a rig of this body, if it differs enough from the one they have.
    fn wear(&mut self, body: &Body, config: &Config) {
        match &mut self.worn {
            None => {
                let solver = Solver::new(body, config.clone());
                self.worn = Some(Worn {
                    rig: Arc::new(solver.rig().clone()),
                    revision: 0,
                    solver,
                });
            }
            Some(worn) if differs(&worn.rig, &body.rig()) => {
                worn.solver.set_body(body);
                worn.rig = Arc::new(worn.solver.rig().clone());
                worn.revision += 1;
            }
            Some(_) => {}
        }
    }
}

/// Whether a bone of the one is off by more than [`CHANGE_M`] in the other.
fn differs(one: &Rig, other: &Rig) -> bool {
    let bones = one.bones.iter().zip(&other.bones);
    // The root's offset is the height of the hips: a sum of lengths that are looked at by themselves.
    let carried = bones.filter(|(one, _)| one.parent.is_some());
    carried
        .map(|(one, other)| (one.offset - other.offset).norm())
        .any(|off| off > CHANGE_M)
}
