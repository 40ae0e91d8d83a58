//! Where a segment is, and what its joints say of each other.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};
use posefuse_skeleton::{JOINT_COUNT, Joint};

use super::{MOST_JOINTS, Segment};
use crate::fuse::kalman::evidence::{Evidence, weight};

/// How fast a segment's direction wanders, rad^2/s, and the shortest time that this is reckoned for, seconds.
const WANDER: f64 = 0.75;
const SHORTEST_S: f64 = 0.005;
/// What is known of a segment's place before it is heard, 1/m^2.
const LEAST_INFORMATION: f64 = 1e-6;
/// Steps of the fit.
const ROUNDS: usize = 2;
/// What others say of a joint is left out where it is worse than this, m^2 per axis.
const WORST: f64 = 0.25;

/// What is new of one joint: place (room metres) and covariance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    pub(super) at: Vector3<f64>,
    pub(super) spread: Matrix3<f64>,
    pub(super) trusted: bool,
    /// Inverse of all that may part the mark from its spot, 1/m^2.
    certainty: Matrix3<f64>,
    /// By how well it fits, 0..=1.
    pub(super) weight: f64,
}

pub(super) type Marks = [Option<Mark>; MOST_JOINTS];

/// Where a segment is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Room metres.
    pub(super) place: Vector3<f64>,
    /// Covariance of place and turn.
    covariance: Matrix6<f64>,
}

impl Segment {
    /// Turns the segment to where its marks are, and weighs each mark by how well it fits. Least squares: a small
    /// change of place and turn at a time.
    pub(super) fn fit(&mut self, marks: &mut Marks) -> Option<Fit> {
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for (mark, spot) in marks.iter_mut().zip(&self.spots) {
            let (Some(mark), Some(spot)) = (mark, spot) else {
                continue;
            };
            let stray = Matrix3::from_diagonal_element(spot.variance());
            mark.certainty = (mark.spread + stray).try_inverse()?;
            let share = mark.certainty.trace();
            sum += (mark.at - self.turn * spot.at) * share;
            total += share;
        }
        let mut place: Vector3<f64> = sum / total;
        for round in 0.. {
            let (information, pull) = self.sum_up(marks, place, round > 0);
            let covariance = information.try_inverse()?;
            if round == ROUNDS {
                return Some(Fit { place, covariance });
            }
            let step = covariance * pull;
            place += step.fixed_rows::<3>(0);
            let turn = Rotation3::from_scaled_axis(step.fixed_rows::<3>(3).into_owned());
            self.turn = turn.matrix() * self.turn;
        }
        None
    }

    /// What the marks say of place and turn together, and which way they pull.
    fn sum_up(
        &self,
        marks: &mut Marks,
        place: Vector3<f64>,
        weigh: bool,
    ) -> (Matrix6<f64>, Vector6<f64>) {
        let (mut places, mut mixed) = (
            Matrix3::from_diagonal_element(LEAST_INFORMATION),
            Matrix3::zeros(),
        );
        let mut turns =
            Matrix3::from_diagonal_element(1.0 / (WANDER * self.silent_s.max(SHORTEST_S)));
        let (mut pull, mut twist) = (Vector3::zeros(), Vector3::zeros());
        for (mark, spot) in marks.iter_mut().zip(&self.spots) {
            let (Some(mark), Some(spot)) = (mark, spot) else {
                continue;
            };
            let arm = self.turn * spot.at;
            let off = mark.at - place - arm;
            if weigh {
                mark.weight = weight(&mark.certainty, off);
            }
            let certainty = mark.certainty * mark.weight;
            // A small turn w moves the joint by w x arm = -[arm] w.
            let lever = arm.cross_matrix();
            let levered = certainty * lever;
            places += certainty;
            mixed -= levered;
            turns += lever.tr_mul(&levered);
            let force = certainty * off;
            pull += force;
            twist += arm.cross(&force);
        }
        let mut information = Matrix6::zeros();
        information.fixed_view_mut::<3, 3>(0, 0).copy_from(&places);
        information.fixed_view_mut::<3, 3>(0, 3).copy_from(&mixed);
        information
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&mixed.transpose());
        information.fixed_view_mut::<3, 3>(3, 3).copy_from(&turns);
        let mut both = Vector6::zeros();
        both.fixed_rows_mut::<3>(0).copy_from(&pull);
        both.fixed_rows_mut::<3>(3).copy_from(&twist);
        (information, both)
    }
}

impl Fit {
    /// Adds to `evidence` what all marks but the joint's own say of the joint that belongs `arm` (room axes, metres)
    /// from the segment's place and strays from there by `variance` (m^2).
    pub(super) fn tell(
        &self,
        arm: Vector3<f64>,
        variance: f64,
        own: Option<Mark>,
        evidence: &mut Evidence,
    ) {
        let part = |row: usize, column: usize| self.covariance.fixed_view::<3, 3>(row, column);
        let lever = arm.cross_matrix();
        let mixed = part(0, 3) * lever;
        let all = part(0, 0) + mixed + mixed.transpose() + lever * part(3, 3) * lever.transpose();
        let fitted = self.place + arm;
        let without = |mark: Mark| {
            let own = mark.certainty * mark.weight;
            let (inverse, certainty) = (all.try_inverse()?, own);
            let spread = (inverse - certainty).try_inverse()?;
            Some((spread, spread * (inverse * fitted - certainty * mark.at)))
        };
        let others = own.map_or(Some((all, fitted)), without);
        let Some((spread, at)) = others else {
            return;
        };
        if !spread.diagonal().iter().all(|v| (0.0..WORST).contains(v)) {
            return;
        }
        let spread = spread + Matrix3::from_diagonal_element(variance);
        if let Some(information) = spread.try_inverse() {
            evidence.information += information;
            evidence.pull += information * (at - evidence.expected);
        }
    }
}

/// What is new of a segment's joints.
pub(super) fn marks(joints: &[Joint], evidence: &[Option<Evidence>; JOINT_COUNT]) -> Marks {
    let mut marks = [None; MOST_JOINTS];
    for (mark, joint) in marks.iter_mut().zip(joints) {
        *mark = evidence[*joint as usize].as_ref().and_then(|evidence| {
            let spread = evidence.information.try_inverse()?;
            Some(Mark {
                at: evidence.expected + spread * evidence.pull,
                spread,
                trusted: evidence.trusted,
                certainty: Matrix3::zeros(),
                weight: 1.0,
            })
        });
    }
    marks
}
