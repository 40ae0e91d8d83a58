//! One pose: where the person stands, how they are turned, and their latents, from what is known of the joints.
//!
//! A Kalman update: the prior of the latents, and each measured joint with its own noise, a weak one with more. Place and
//! turn about the vertical are unknown beforehand; the turn enters linearised, twice.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint};

use super::table::{LATENT, Latent, Rows, Square, TABLE};
use crate::repair::WindowJoint;
use crate::repair::history::sigma_of;

/// Latents, then place and turn.
const ALL: usize = LATENT + 4;
/// Standard deviation of a joint measured with trust, as far as the statistics hold for it, metres.
const TRUSTED_SIGMA_M: f64 = 0.02;
/// How well a measured hip or shoulder tells where the person faces, metres.
const FACING_SIGMA_M: f64 = 0.01;
/// Hips and shoulders that are less across, seen from above, do not tell it, mean bones squared.
const LEAST_ACROSS: f64 = 0.25;
/// Fewer joints do not say how a person is turned.
const LEAST_JOINTS: u32 = 4;
/// Rounds of putting the turn right.
const ROUNDS: usize = 2;
/// What is known beforehand of place (1/bone^2) and turn (1/rad^2): next to nothing.
const NOTHING: f64 = 1e-4;

/// What is believed of the latents.
#[derive(Clone, Debug)]
pub(super) struct Belief {
    pub(super) mean: Latent,
    pub(super) covariance: Square,
}

impl Belief {
    /// Of a person nothing is known of.
    pub(super) fn of_anybody() -> Self {
        Self {
            mean: Latent::zeros(),
            covariance: Square::from_diagonal(&TABLE.variance),
        }
    }
}

/// A pose that was made sense of.
#[derive(Clone, Debug)]
pub(super) struct Settled {
    pub(super) belief: Belief,
    /// Metres per unit of length.
    scale: f64,
    /// Room from person: the turn, and the place of its origin, metres.
    turn: Rotation3<f64>,
    origin: Vector3<f64>,
    /// Covariance of latents, place and turn.
    covariance: SMatrix<f64, ALL, ALL>,
}

impl Settled {
    /// Where joint number `index` is, room metres.
    pub(super) fn place(&self, index: usize) -> Vector3<f64> {
        self.origin + self.turn * shape(index, &self.belief.mean) * self.scale
    }

    /// Mean variance of that place over the axes, m^2; of what the latents describe only.
    pub(super) fn variance(&self, index: usize) -> f64 {
        let rows = rows(index, &shape(index, &self.belief.mean));
        let variance = (rows * self.covariance * rows.transpose()).trace() / 3.0;
        (variance + TABLE.rest[index]) * self.scale * self.scale
    }

    /// A direction in the room as the person sees it, and back.
    pub(super) fn to_person(&self, way: Vector3<f64>) -> Vector3<f64> {
        self.turn.inverse() * way
    }

    pub(super) fn to_room(&self, way: Vector3<f64>) -> Vector3<f64> {
        self.turn * way
    }
}

/// A joint in the person's frame.
fn shape(index: usize, latent: &Latent) -> Vector3<f64> {
    TABLE.mean[index] + TABLE.basis[index] * latent
}

/// How a joint at `shape` in the person's frame moves with latents, place and turn.
fn rows(index: usize, shape: &Vector3<f64>) -> SMatrix<f64, 3, ALL> {
    let mut rows = SMatrix::<f64, 3, ALL>::zeros();
    rows.fixed_columns_mut::<LATENT>(0)
        .copy_from(&TABLE.basis[index]);
    rows.fixed_columns_mut::<3>(LATENT)
        .copy_from(&Matrix3::identity());
    rows.fixed_columns_mut::<1>(ALL - 1)
        .copy_from(&Vector3::z().cross(shape));
    rows
}

/// Variance of a measured joint, m^2.
pub(super) fn noise(weight: f32) -> f64 {
    sigma_of(weight).powi(2) + TRUSTED_SIGMA_M * TRUSTED_SIGMA_M
}

/// Makes sense of the joints of `pose` that are measured and among `allowed` (bits); `None` where they are too few.
pub(super) fn settle(
    pose: &[WindowJoint; JOINT_COUNT],
    allowed: u32,
    prior: &Belief,
    scale: f64,
) -> Option<Settled> {
    let known = measured(pose) & allowed;
    if known.count_ones() < LEAST_JOINTS {
        return None;
    }
    let joints = || (0..JOINT_COUNT).filter(|index| known & 1 << index != 0);
    let precision =
        |index: usize| 1.0 / (noise(pose[index].weight) / (scale * scale) + TABLE.rest[index]);
    let prior_information = prior.covariance.cholesky()?.inverse();
    let mut information = SMatrix::<f64, ALL, ALL>::from_diagonal_element(NOTHING);
    let mut latents = prior_information;
    for index in joints() {
        latents += TABLE.squares[index] * precision(index);
    }
    information
        .fixed_view_mut::<LATENT, LATENT>(0, 0)
        .copy_from(&latents);
    let middle = {
        let sum = joints().fold(Vector3::zeros(), |sum, index| sum + pose[index].position);
        sum / f64::from(known.count_ones())
    };
    let seen = |index: usize| (pose[index].position - middle) / scale;
    let mut mean = prior.mean;
    let facing = Facing::of(pose, known, scale);
    let mut yaw = match &facing {
        Some(facing) => facing.yaw,
        None => turn(joints().map(|i| (shape(i, &mean), seen(i), precision(i)))),
    };
    for round in 0..ROUNDS {
        let back = Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw);
        let mut all = information;
        let mut pull = SVector::<f64, ALL>::zeros();
        let prior_pull = prior_information * prior.mean;
        pull.fixed_rows_mut::<LATENT>(0).copy_from(&prior_pull);
        for index in joints() {
            let shape = shape(index, &mean);
            add_place_and_turn(&mut all, index, &shape, precision(index));
            let off = (back * seen(index) - TABLE.mean[index]) * precision(index);
            let turned = Vector3::z().cross(&shape);
            let mut own = pull.fixed_rows_mut::<LATENT>(0);
            own.gemv_tr(1.0, &TABLE.basis[index], &off, 1.0);
            let mut place = pull.fixed_rows_mut::<3>(LATENT);
            place += off;
            pull[ALL - 1] += turned.dot(&off);
        }
        if let Some(facing) = &facing {
            all[(ALL - 1, ALL - 1)] += facing.precision;
            let off = (facing.yaw - yaw + PI).rem_euclid(2.0 * PI) - PI;
            pull[ALL - 1] += off * facing.precision;
        }
        let solved = all.cholesky()?;
        let found = solved.solve(&pull);
        mean = found.fixed_rows::<LATENT>(0).into_owned();
        yaw += found[ALL - 1];
        if round + 1 == ROUNDS {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw);
            let covariance = solved.inverse();
            let own = covariance.fixed_view::<LATENT, LATENT>(0, 0).into_owned();
            let place: Vector3<f64> = found.fixed_rows::<3>(LATENT).into_owned();
            return Some(Settled {
                belief: Belief {
                    mean,
                    covariance: own,
                },
                scale,
                turn,
                origin: middle + turn * place * scale,
                covariance,
            });
        }
    }
    None
}

/// The person's turn as the table means it: at right angles to hips and shoulders. Without it latents and turn could
/// stand in for each other.
struct Facing {
    /// About the vertical, rad.
    yaw: f64,
    /// 1/rad^2.
    precision: f64,
}

impl Facing {
    /// `None` unless all four joints are known.
    fn of(pose: &[WindowJoint; JOINT_COUNT], known: u32, scale: f64) -> Option<Self> {
        use Joint::{HipLeft, HipRight, ShoulderLeft, ShoulderRight};
        let (mut left, mut variance) = (Vector3::zeros(), 0.0);
        for (joint, sign) in [
            (HipLeft, 1.0),
            (HipRight, -1.0),
            (ShoulderLeft, 1.0),
            (ShoulderRight, -1.0),
        ] {
            if known & 1 << joint as usize == 0 {
                return None;
            }
            let seen = &pose[joint as usize];
            left += seen.position * (sign / scale);
            variance += (sigma_of(seen.weight).powi(2) + FACING_SIGMA_M.powi(2)) / (scale * scale);
        }
        let across = left.xy().norm_squared();
        (across > LEAST_ACROSS).then(|| Self {
            yaw: f64::atan2(-left.x, left.y),
            precision: across / variance,
        })
    }
}

/// Bits of the joints that are measured.
pub(super) fn measured(pose: &[WindowJoint; JOINT_COUNT]) -> u32 {
    let bits = pose.iter().enumerate();
    bits.fold(0, |bits, (index, joint)| {
        bits | u32::from(joint.weight > 0.0) << index
    })
}

/// What a joint at `shape` says of place and turn, and how they go with the latents.
fn add_place_and_turn(
    all: &mut SMatrix<f64, ALL, ALL>,
    index: usize,
    shape: &Vector3<f64>,
    precision: f64,
) {
    let basis: &Rows = &TABLE.basis[index];
    let turned = Vector3::z().cross(shape);
    for axis in 0..3 {
        let place = LATENT + axis;
        all[(place, place)] += precision;
        all[(place, ALL - 1)] += turned[axis] * precision;
        all[(ALL - 1, place)] += turned[axis] * precision;
        for column in 0..LATENT {
            let with_place = basis[(axis, column)] * precision;
            all[(column, place)] += with_place;
            all[(place, column)] += with_place;
        }
    }
    for column in 0..LATENT {
        let with_turn = basis.column(column).dot(&turned) * precision;
        all[(column, ALL - 1)] += with_turn;
        all[(ALL - 1, column)] += with_turn;
    }
    all[(ALL - 1, ALL - 1)] += turned.norm_squared() * precision;
}

/// The turn about the vertical that brings shapes onto what is seen best, rad: pairs with their weights.
fn turn(pairs: impl Iterator<Item = (Vector3<f64>, Vector3<f64>, f64)> + Clone) -> f64 {
    let (mut shapes, mut total) = (Vector3::zeros(), 0.0);
    for (shape, _, weight) in pairs.clone() {
        shapes += shape * weight;
        total += weight;
    }
    let middle = shapes / total;
    let (mut along, mut across) = (0.0, 0.0);
    for (shape, seen, weight) in pairs {
        let shape = shape - middle;
        along += weight * (shape.x * seen.x + shape.y * seen.y);
        across += weight * (shape.x * seen.y - shape.y * seen.x);
    }
    f64::atan2(across, along)
}
