//! One person, frame by frame.

use posefuse_skeleton::{JointMap, Position, Room, Timestamp, Track};

use crate::body::Body;
use crate::config::Config;
use crate::direct;
use crate::posture::{Offsets, Placed, Posture, offsets};
use crate::rig::{Rig, RigPose};

/// The body of one person at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// The pose of [`Solver::rig`].
    pub pose: RigPose,
    /// All canonical joints as the pose has them, room metres.
    pub joints: JointMap<Position<Room>>,
    /// What of the left and the right foot stands on the floor.
    pub contacts: [Contact; 2],
    /// The left and the right hand, where somebody voted.
    pub hands: [Option<HandState>; 2],
}

/// What of a foot stands on the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// The heel (the ankle joint is at its flat height and still).
    pub heel: bool,
    /// The ball of the foot (the foot joint is).
    pub toes: bool,
}

/// Whether a hand is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandState {
    /// What is most likely; changes only on clear evidence.
    pub closed: bool,
    /// The probability of that being so, 0 (surely open) to 1 (surely closed).
    pub closed_probability: f64,
}

/// Makes poses of one person's rig from that person's tracks.
#[derive(Clone, Debug)]
pub struct Solver {
    body: Body,
    rig: Rig,
    offsets: Offsets,
    config: Config,
    last: Option<(Timestamp, Posture)>,
}

impl Solver {
    /// For a person with this body. `config` should be [valid](Config::validate).
    pub fn new(body: &Body, config: Config) -> Self {
        let rig = body.rig();
        Self {
            body: *body,
            offsets: offsets(&rig),
            rig,
            config,
            last: None,
        }
    }

    /// The rig that the poses are of: always the same.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// The person's measures.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The body at the instant `at` of this track. Joints that are missing stay as they were against the body.
    ///
    /// `None` until a trunk has been seen.
    pub fn step(&mut self, track: &Track, at: Timestamp) -> Option<Solved> {
        let targets = track.skeleton.filter_map(|_, state| {
            state
                .position
                .is_finite()
                .then_some(state.position.vector())
        });
        let last = self.last.as_ref().map(|(_, posture)| posture);
        let posture = direct::posture(&self.offsets, &targets, last, &self.config.hold)?;
        let placed = Placed::of(&self.offsets, &posture);
        let solved = Solved {
            pose: posture.to_pose(),
            joints: direct::joints(&placed),
            contacts: [Contact::default(); 2],
            hands: [None; 2],
        };
        self.last = Some((at, posture));
        Some(solved)
    }
}
