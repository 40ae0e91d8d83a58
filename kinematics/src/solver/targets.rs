//! What the fit is to reach, and what feet on the floor add to it.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{Joint, JointMap, JointState, Room};

use super::Solver;
use crate::bones::{BONE_OF_JOINT, LEGS};
use crate::feet::{Held, POINTS};
use crate::fit::Target;
use crate::posture::{Placed, Posture};
use crate::range::ranges;

/// How firmly a foot lies where it was fused, metres of standard deviation: what keeping it begins and ends with.
const LOOSE_M: f64 = 0.015;

impl Solver {
    /// Where joints should be: where they were fused, and feet that stand where they are kept.
    pub(super) fn targets(&mut self, seen: &JointMap<JointState<Room>>) -> Vec<Target> {
        let floor = Matrix3::from_diagonal_element((self.config.fit.floor_mm * 1e-3).powi(2));
        let mut targets: Vec<Target> = Vec::with_capacity(Joint::ALL.len() + POINTS.len());
        for joint in Joint::ALL {
            let state = &seen[joint];
            let now = state.as_ref().map(|state| state.covariance + floor);
            let weight = self.weights.of(joint as usize, now);
            if let (Some(state), Some(weight)) = (state, weight) {
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

    /// Toes stay level on the floor as far as the ball of the foot stands there.
    pub(super) fn bend_toes(&self, posture: &mut Posture, placed: &Placed) {
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
    pub(super) fn flat_heights(&self) -> [f64; POINTS.len()] {
        let ankle = self.body.ankle_height;
        let ball = |side: usize| {
            let leg = &self.body.legs[side];
            ankle - leg.foot * leg.foot_pitch_rad.sin()
        };
        [ankle, ball(0), ankle, ball(1)]
    }
}
