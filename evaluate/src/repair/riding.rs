//! Reference methods that every other has to beat: a joint does against the person's own frame what `hold`, `damped` and
//! `linear` do in the room. The frame is upright, at the pelvis, and faces where hips and shoulders do.

use std::ops::Range;

use nalgebra::{Rotation3, Vector3};
use posefuse_fusion::{Fill, ModelError, Needs, OcclusionModel, Window, WindowJoint};
use posefuse_skeleton::{JOINT_COUNT, Joint, JointMap};

/// How far back and ahead they look, poses.
const REACH: usize = 90;
/// The velocity of a hidden joint dies away with this time constant, seconds.
const FADES_S: f64 = 0.2;
/// It is told from so many poses.
const VELOCITY_OVER: usize = 2;

/// What a joint does against the person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Riding {
    /// It stays where it was.
    Hold,
    /// It goes on as it last moved, slower and slower.
    Damped,
    /// It goes straight to where it is seen again.
    Linear,
}

impl Riding {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Hold, Self::Damped, Self::Linear];

    /// What it is, in one line.
    pub fn about(self) -> &'static str {
        match self {
            Self::Hold => "a joint stays where it was against the person; for comparison only",
            Self::Damped => "it goes on against the person, slower and slower; for comparison only",
            Self::Linear => "it goes straight against the person; for comparison only",
        }
    }

    fn fill_one(self, window: &Window, now: usize) -> JointMap<Fill> {
        let frame = Frame::of(&window.poses[now]);
        let gone = |joint: &Joint| window.poses[now][*joint as usize].weight < 1.0;
        let fill = |joint: Joint| {
            let own = |pose: usize| Frame::of(&window.poses[pose]).own(&window.poses[pose], joint);
            let known = |pose: &usize| window.poses[*pose][joint as usize].weight >= 1.0;
            let last = (0..now).rev().find(known)?;
            let place = match self {
                Self::Hold => own(last),
                Self::Damped => {
                    let first = last.saturating_sub(VELOCITY_OVER);
                    let over_s = window.step_s * (last - first).max(1) as f64;
                    let age_s = window.step_s * (now - last) as f64;
                    let way_s = FADES_S * (1.0 - (-age_s / FADES_S).exp());
                    own(last) + (own(last) - own(first)) * (way_s / over_s)
                }
                Self::Linear => match (now + 1..window.poses.len()).find(known) {
                    Some(next) => {
                        let share = (now - last) as f64 / (next - last) as f64;
                        own(last).lerp(&own(next), share)
                    }
                    None => own(last),
                },
            };
            let fill = Fill {
                position: frame.room(place),
                sigma_m: 0.1,
                rotation: None,
            };
            Some((joint, fill))
        };
        Joint::ALL
            .into_iter()
            .filter(gone)
            .filter_map(fill)
            .collect()
    }
}

/// Upright, at the pelvis; x where the person faces.
struct Frame {
    origin: Vector3<f64>,
    turn: Rotation3<f64>,
}

impl Frame {
    fn of(pose: &[WindowJoint; JOINT_COUNT]) -> Self {
        use Joint::*;
        let at = |joint: Joint| pose[joint as usize].position;
        let left = at(HipLeft) - at(HipRight) + at(ShoulderLeft) - at(ShoulderRight);
        Self {
            origin: at(SpineBase),
            turn: Rotation3::from_axis_angle(&Vector3::z_axis(), (-left.x).atan2(left.y)),
        }
    }

    fn own(&self, pose: &[WindowJoint; JOINT_COUNT], joint: Joint) -> Vector3<f64> {
        self.turn.inverse() * (pose[joint as usize].position - self.origin)
    }

    fn room(&self, own: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.turn * own
    }
}

impl OcclusionModel for Riding {
    fn name(&self) -> &str {
        match self {
            Self::Hold => "ride",
            Self::Damped => "ride-damped",
            Self::Linear => "ride-linear",
        }
    }

    fn needs(&self) -> Needs {
        Needs {
            before: REACH,
            after: if *self == Self::Linear { REACH } else { 0 },
            rate_hz: super::motion::RATE_HZ,
        }
    }

    fn fill(
        &mut self,
        window: &Window,
        wanted: Range<usize>,
    ) -> Result<Vec<JointMap<Fill>>, ModelError> {
        Ok(wanted.map(|now| self.fill_one(window, now)).collect())
    }
}
