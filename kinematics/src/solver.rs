//! One person, frame by frame.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{HandVotes, Joint, JointMap, JointState, Position, Room, Timestamp, Track};

use crate::angles::{Angle, angles};
use crate::body::Body;
use crate::bones::{BONE_OF_JOINT, BONES, HEAD, LEGS};
use crate::config::{Config, LookAt, Start};
use crate::direct;
use crate::feet::{Feet, Held, POINTS};
use crate::fit::{Fitted, Fitter, Target};
use crate::grip::Grips;
use crate::hands::HandFilter;
use crate::look::Look;
use crate::posture::{Offsets, Placed, Posture, offsets};
use crate::range::{clamp, ranges};
use crate::rig::Rig;
use crate::solved::{Solved, residual};

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
/// More sensors than this see no hand at once that differ in what they see.
const MOST_VOTES: usize = 8;
/// How firmly a foot lies where it was fused, metres of standard deviation: what keeping it begins and ends with.
const LOOSE_M: f64 = 0.015;

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
            feet: Feet::default(),
            look: Look::default(),
            hands: [hand.clone(), hand],
            grips: Grips::default(),
        }
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
                match votes {
                    Some(votes) => {
                        let many = usize::from(votes.sensors).min(MOST_VOTES);
                        hand.vote(&[votes.closed; MOST_VOTES][..many], at);
                    }
                    None => hand.vote(&[], at),
                }
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
        }
        let places = POINTS.map(|bone| {
            let joint = BONES[bone].joint?;
            Some(seen[joint]?.position.vector())
        });
        let passed = elapsed.unwrap_or(ELAPSED_S.0);
        self.vote(&track.hands, at);
        let flat = self.flat_heights();
        self.feet
            .step(&places, &flat, at, passed, &self.config.feet);
        let before = last.as_ref().zip(elapsed);
        let Some(fitted) = self.fitted(&seen, last.as_ref(), before) else {
            self.last = last.map(|posture| (at, posture));
            return None;
        };
        Some(self.finish(fitted, &seen, at, passed))
    }

    /// The posture of this frame, before what is added to it.
    fn fitted(
        &mut self,
        seen: &JointMap<JointState<Room>>,
        last: Option<&Posture>,
        before: Option<(&Posture, f64)>,
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
            Some((posture, _)) if self.config.fit.start == Start::Previous => {
                let fitted = self.fitter.fit(posture.clone(), &targets, before, usual);
                let lost = targets
                    .iter()
                    .any(|target| (fitted.placed.origins[target.bone] - target.at).norm() > LOST_M);
                let other = lost.then(|| by_bones(self)).flatten();
                let other = other.map(|start| self.fitter.fit(start, &targets, before, usual));
                match other {
                    Some(other) if other.cost < fitted.cost => other,
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

    /// Where joints should be: where they were fused, and feet that stand where they are kept.
    fn targets(&self, seen: &JointMap<JointState<Room>>) -> Vec<Target> {
        let floor = Matrix3::from_diagonal_element((self.config.fit.floor_mm * 1e-3).powi(2));
        let mut targets: Vec<Target> = Vec::with_capacity(Joint::ALL.len() + POINTS.len());
        for (joint, state) in seen.iter() {
            if let Some(weight) = (state.covariance + floor).try_inverse() {
                targets.push(Target {
                    bone: BONE_OF_JOINT[joint as usize],
                    at: state.position.vector(),
                    weight,
                    robust: self.config.fit.robust,
                });
            }
        }
        if !self.config.feet.enabled {
            return targets;
        }
        for (index, bone) in POINTS.into_iter().enumerate() {
            if let Some(held) = self.feet.held(index) {
                targets.retain(|target| target.bone != bone);
                targets.push(self.kept(bone, &held));
            }
        }
        targets
    }

    /// Where a point of a foot should be that is being kept: between where it was fused and where it is kept, and the
    /// firmer the nearer to the latter.
    fn kept(&self, bone: usize, held: &Held) -> Target {
        let firm = self.config.feet.firmness_mm * 1e-3;
        let sigma = LOOSE_M * (firm / LOOSE_M).powf(held.share);
        Target {
            bone,
            at: held.at,
            // Upwards it is kept loosely: firmly, it would tell the knee of a straight leg where to go.
            weight: Matrix3::from_diagonal(
                &Vector3::new(sigma, sigma, LOOSE_M).map(|s| 1.0 / (s * s)),
            ),
            robust: false,
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

    /// Toes stay level on the floor as far as the ball of the foot stands there.
    fn bend_toes(&self, posture: &mut Posture, placed: &Placed) {
        for (side, leg) in LEGS.iter().enumerate() {
            let share = self.feet.held(2 * side + 1).map_or(0.0, |held| held.share);
            let ahead: Vector3<f64> = placed.axes[leg.foot].column(0).into();
            let down = (-ahead.z).atan2(ahead.xy().norm());
            let range = &ranges(leg.toes)[0];
            let level = (-down).clamp(range.low.to_radians(), range.high.to_radians());
            posture.angles[leg.toes][0] = if self.config.extra.toes {
                level * share
            } else {
                0.0
            };
        }
    }

    /// Heights of heel and ball of the feet in flat standing, metres.
    fn flat_heights(&self) -> [f64; POINTS.len()] {
        let ankle = self.body.ankle_height;
        let ball = |side: usize| {
            let leg = &self.body.legs[side];
            ankle - leg.foot * leg.foot_pitch_rad.sin()
        };
        [ankle, ball(0), ankle, ball(1)]
    }
}

/// Whether the numbers of a fused joint can be worked with.
fn is_usable(state: &JointState<Room>) -> bool {
    let variances = state.covariance.diagonal();
    state.position.is_finite()
        && state.covariance.iter().all(|v| v.is_finite())
        && variances.iter().all(|v| *v >= 0.0)
}
