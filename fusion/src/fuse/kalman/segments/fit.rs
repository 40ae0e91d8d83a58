//! Where a segment is, and what its joints say of each other.

use nalgebra::{Matrix3, Rotation3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint};

use super::{MOST_JOINTS, Segment};
use crate::fuse::kalman::evidence::{Evidence, weight};

/// How fast a segment's direction wanders, rad^2/s, and the shortest time that this is reckoned for, seconds.
const WANDER: f64 = 1.5;
const SHORTEST_S: f64 = 0.005;
/// What is known of a segment's place before it is heard, 1/m^2.
const LEAST_INFORMATION: f64 = 1e-6;
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
    covariance: Both,
}

/// A symmetric matrix over a segment's place and its turn, in blocks.
#[derive(Clone, Copy, Debug)]
struct Both {
    places: Matrix3<f64>,
    /// Rows for the place, columns for the turn.
    mixed: Matrix3<f64>,
    turns: Matrix3<f64>,
}

impl Both {
    fn try_inverse(&self) -> Option<Self> {
        let inner = self.places.try_inverse()?;
        let through = inner * self.mixed;
        let turns = (self.turns - self.mixed.tr_mul(&through)).try_inverse()?;
        let mixed = -(through * turns);
        Some(Self {
            places: inner - mixed * through.transpose(),
            mixed,
            turns,
        })
    }
}

impl Segment {
    /// Turns the segment to where its marks are, and weighs each mark by how well it fits. Least squares, one step: from
    /// frame to frame nobody turns far.
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
        let (information, pull, twist) = self.sum_up(marks, place);
        let covariance = information.try_inverse()?;
        place += covariance.places * pull + covariance.mixed * twist;
        let angle = covariance.mixed.tr_mul(&pull) + covariance.turns * twist;
        self.turn = Rotation3::from_scaled_axis(angle).matrix() * self.turn;
        let (information, ..) = self.sum_up(marks, place);
        let covariance = information.try_inverse()?;
        Some(Fit { place, covariance })
    }

    /// What the marks say of place and turn together, each weighed by how well it fits, and which way they pull.
    fn sum_up(&self, marks: &mut Marks, place: Vector3<f64>) -> (Both, Vector3<f64>, Vector3<f64>) {
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
            mark.weight = weight(&mark.certainty, off);
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
        let information = Both {
            places,
            mixed,
            turns,
        };
        (information, pull, twist)
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
        let lever = arm.cross_matrix();
        let Both { places, turns, .. } = &self.covariance;
        let mixed = self.covariance.mixed * lever;
        let all = places + mixed + mixed.transpose() + lever * turns * lever.transpose();
        let fitted = self.place + arm;
        let without = |mark: Mark| {
            let (inverse, certainty) = (all.try_inverse()?, mark.certainty * mark.weight);
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
