//! One person, frame by frame.

mod targets;

use posefuse_skeleton::{
    HandVotes, Joint, JointMap, JointState, Position, Room, Skeleton, Timestamp, Track,
};

use crate::angles::{Angle, angles};
use crate::body::Body;
use crate::bones::{BONES, HEAD};
use crate::config::{Config, LookAt, Start};
use crate::direct;
use crate::feet::{Feet, POINTS};
use crate::fit::{Before, Fitted, Fitter};
use crate::grip::Grips;
use crate::hands::HandFilter;
use crate::look::Look;
use crate::posture::{Offsets, Placed, Posture, offsets};
use crate::range::clamp;
use crate::rig::Rig;
use crate::solved::{Solved, residual};
use crate::speeds::expected;
use crate::steady::Weights;

/// Makes poses of one person's rig from that person's tracks.
///
/// ```
/// use posefuse_kinematics::{Body, Config, Solver};
/// use posefuse_skeleton::{
///     Confidence, Joint, JointState, Position, SensorId, SensorSet, Timestamp, Track, TrackId,
/// };
///
/// let body = Body::of_height(1.75);
/// let rig = body.rig();
/// let sensor = SensorId::new(0)?;
/// // Somebody in a T-pose at the origin, facing X.
/// let height = body.rest_height();
/// let skeleton = rig
///     .place(&rig.rest_pose(Position::new(0.0, 0.0, height)))
///     .into_iter()
///     .zip(&rig.bones)
///     .filter_map(|((at, _), bone)| {
///         Some((bone.joint?, JointState::measured(at, 0.01, Confidence::FULL, sensor)))
///     })
///     .collect();
/// let track = Track { id: TrackId(1), since: Timestamp::ZERO, sensors: SensorSet::only(sensor), skeleton, hands: [None; 2] };
///
/// let mut solver = Solver::new(&body, Config::default());
/// let solved = solver.step(&track, Timestamp::ZERO).expect("a trunk was seen");
/// let head = solved.joints[Joint::Head].expect("all joints are there").point();
/// assert!((head.z - 1.65).abs() < 0.02, "{head}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solver {
    body: Body,
    rig: Rig,
    offsets: Offsets,
    config: Config,
    fitter: Fitter,
    /// As fitted: where the next fit begins.
    last: Option<(Timestamp, Posture)>,
    /// As given out.
    made: Option<Posture>,
    weights: Weights,
    /// The one before `last`, and the seconds between.
    previous: Option<(Posture, f64)>,
    feet: Feet,
    look: Look,
    hands: [HandFilter; 2],
    grips: Grips,
}

/// After longer than this without a frame, what was before says nothing of how a person moves, seconds.
const LONGEST_GAP_S: f64 = 1.0;
/// Elapsed time is taken to lie within these, seconds.
const ELAPSED_S: (f64, f64) = (1.0 / 240.0, 0.2);
/// A first frame has further to go.
const FIRST_ITERATIONS: usize = 30;
/// A joint this far from where it was fused, metres, may be one that the fit cannot reach from the frame before.
const LOST_M: f64 = 0.08;
/// Another beginning is better where what it leads to costs less than this share of what the usual one does: bodies that change
/// their mind jump.
const BETTER: f64 = 0.7;

impl Solver {
    /// For a person with this body. `config` should be [valid](Config::validate).
    pub fn new(body: &Body, config: Config) -> Self {
        let rig = body.rig();
        let offsets = offsets(&rig);
        let hand = HandFilter::new(config.hands.clone());
        Self {
            body: *body,
            fitter: Fitter::new(&offsets, &config),
            offsets,
            rig,
            config,
            last: None,
            made: None,
            weights: Weights::default(),
            previous: None,
            feet: Feet::default(),
            look: Look::default(),
            hands: [hand.clone(), hand],
            grips: Grips::default(),
        }
    }

    /// Whether a person of whom nothing is known yet has a pose with this skeleton: whether it shows which way the trunk is.
    pub fn can_begin(skeleton: &Skeleton<Room>) -> bool {
        let usable =
            |_, state: &JointState<Room>| is_usable(state).then(|| state.position.vector());
        direct::shows_trunk(&skeleton.filter_map(usable))
    }

    /// The rig that the poses are of: the same until [`Solver::set_body`].
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// The person's measures.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Gives the person other measures; the pose goes on from where it is.
    pub fn set_body(&mut self, body: &Body) {
        self.body = *body;
        self.rig = body.rig();
        self.offsets = offsets(&self.rig);
        self.fitter = Fitter::new(&self.offsets, &self.config);
    }

    /// The joints' angles in the pose that came last, degrees; none before the first.
    pub fn angles(&self) -> Vec<Angle> {
        self.made.as_ref().map_or_else(Vec::new, angles)
    }

    /// Takes in what sensors say of the hands at `at`.
    fn vote(&mut self, hands: &[Option<HandVotes>; 2], at: Timestamp) {
        if self.config.hands.enabled {
            for (hand, votes) in self.hands.iter_mut().zip(hands) {
                hand.take(votes.as_ref(), at);
            }
        }
    }

    /// The body at the instant `at` of this track. Joints that are missing stay as they were against the body.
    ///
    /// `None` until a trunk has been seen. Times should go up; a frame that is not later than the one before counts as
    /// one shortly after it.
    pub fn step(&mut self, track: &Track, at: Timestamp) -> Option<Solved> {
        let seen = track
            .skeleton
            .filter_map(|_, state| is_usable(state).then_some(*state));
        let (last, elapsed) = match self.last.take() {
            Some((time, posture)) => {
                let elapsed = at.since_seconds(time);
                let elapsed = (elapsed <= LONGEST_GAP_S).then_some(elapsed);
                (
                    Some(posture),
                    elapsed.map(|e| e.clamp(ELAPSED_S.0, ELAPSED_S.1)),
                )
            }
            None => (None, None),
        };
        if elapsed.is_none() {
            self.feet = Feet::default();
            self.previous = None;
        }
        self.weights.step(elapsed, self.config.fit.steady_s);
        let places = POINTS.map(|bone| {
            let joint = BONES[bone].joint?;
            Some(seen[joint]?.position.vector())
        });
        let passed = elapsed.unwrap_or(ELAPSED_S.0);
        self.vote(&track.hands, at);
        let flat = self.flat_heights();
        self.feet
            .step(&places, &flat, at, passed, &self.config.feet);
        let expected = match (&self.previous, &last, elapsed) {
            (Some((previous, before)), Some(last), Some(elapsed)) => {
                Some(expected(previous, last, *before, elapsed))
            }
            _ => None,
        };
        let before = last.as_ref().zip(elapsed).map(|(last, elapsed)| Before {
            last,
            elapsed,
            expected: expected.as_ref(),
        });
        let Some(fitted) = self.fitted(&seen, last.as_ref(), before) else {
            self.last = last.map(|posture| (at, posture));
            return None;
        };
        self.previous = last.zip(elapsed);
        Some(self.finish(fitted, &seen, at, passed))
    }

    /// The posture of this frame, before what is added to it.
    fn fitted(
        &mut self,
        seen: &JointMap<JointState<Room>>,
        last: Option<&Posture>,
        before: Option<Before>,
    ) -> Option<Fitted> {
        let points = seen.map(|_, state| state.position.vector());
        let by_bones = |solver: &Self| {
            direct::posture(
                &solver.offsets,
                &points,
                last,
                &solver.config.hold,
                &solver.config.extra,
            )
        };
        if !self.config.fit.enabled {
            let mut posture = by_bones(self)?;
            if self.config.limits.enabled {
                clamp(&mut posture);
            }
            return Some(Fitted {
                placed: Placed::of(&self.offsets, &posture),
                posture,
                cost: 0.0,
            });
        }
        let targets = self.targets(seen);
        let usual = self.config.fit.iterations;
        let fitted = match before {
            Some(Before { last, .. }) if self.config.fit.start == Start::Previous => {
                let fitted = self.fitter.fit(last.clone(), &targets, before, usual);
                let lost = targets
                    .iter()
                    .any(|target| (fitted.placed.origins[target.bone] - target.at).norm() > LOST_M);
                let other = lost.then(|| by_bones(self)).flatten();
                // What was before does not count: where the fit went astray, it would keep it there.
                let other = other.map(|start| self.fitter.fit(start, &targets, None, usual));
                match other {
                    Some(other) if other.cost < BETTER * self.fitter.cost(&fitted, &targets) => {
                        other
                    }
                    _ => fitted,
                }
            }
            Some(_) => self.fitter.fit(by_bones(self)?, &targets, before, usual),
            None => {
                let iterations = usual.max(FIRST_ITERATIONS);
                self.fitter.fit(by_bones(self)?, &targets, None, iterations)
            }
        };
        if fitted.posture.is_finite() {
            Some(fitted)
        } else {
            let posture = last?.clone();
            Some(Fitted {
                placed: Placed::of(&self.offsets, &posture),
                posture,
                cost: 0.0,
            })
        }
    }

    /// Adds toes, gaze and closed hands, and makes the answer.
    fn finish(
        &mut self,
        fitted: Fitted,
        seen: &JointMap<JointState<Room>>,
        at: Timestamp,
        elapsed: f64,
    ) -> Solved {
        let Fitted {
            mut posture,
            placed,
            ..
        } = fitted;
        self.bend_toes(&mut posture, &placed);
        let mut pose = posture.to_pose();
        let mut joints = direct::joints(&placed);
        if self.config.look.at != LookAt::Off {
            let turn = self.look.step(&placed, &self.config.look, elapsed);
            pose.rotations[HEAD] *= turn;
            if self.config.look.nod_deg > 0.0 {
                let end = &self.offsets[crate::bones::HEAD_END];
                let head = placed.origins[HEAD] + placed.axes[HEAD] * (turn * end);
                joints[Joint::Head] = Some(Position::from_vector(head));
            }
        }
        self.last = Some((at, posture.clone()));
        let hands = [0, 1].map(|side| self.hands[side].state());
        self.grips.step(&hands, &self.config.hands, elapsed);
        if self.config.extra.fingers {
            let body = (&self.offsets, &placed);
            let (hands, grips) = (&self.config.hands, &self.grips);
            grips.bend(hands, body, &mut posture, &mut pose, &mut joints);
        }
        self.made = Some(posture);
        Solved {
            residual_m: residual(&joints, seen),
            pose,
            joints,
            contacts: self.feet.contacts(),
            hands,
        }
    }
}

/// Whether the numbers of a fused joint can be worked with.
fn is_usable(state: &JointState<Room>) -> bool {
    let variances = state.covariance.diagonal();
    state.position.is_finite()
        && state.covariance.iter().all(|v| v.is_finite())
        && variances.iter().all(|v| *v >= 0.0)
}
