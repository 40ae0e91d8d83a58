//! The normal equations of the fit, made and solved along the tree of bones.
//!
//! A point that a bone carries at `p` moves by `w x p + v` when that bone turns by `w` about the reference point and moves by
//! `v`. So a residual with weight `W` contributes a 6x6 block to that bone, and the blocks of all that a bone carries
//! add up: the composite of Featherstone, *Rigid Body Dynamics Algorithms* (2008), chapter 6, with weights instead of
//! masses. Entries between freedoms of which neither carries the other are zero, and the factorisation from the leaves
//! down (`L^T D L`, chapter 8) keeps them so: cost grows with the depth of the tree, not with the cube of its size.

use nalgebra::{Matrix3, Vector3};

use super::freedom::{Freedom, MOST, NONE};
use crate::bones::{BONE_COUNT, BONES, HIPS};

/// A turn about an axis through a point, or a shift: angular part, linear part at the reference point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    pub(super) turn: Vector3<f64>,
    pub(super) shift: Vector3<f64>,
}

/// What all residuals of the points that a bone carries say, about the reference point.
#[derive(Clone, Copy, Debug)]
struct Composite {
    turn_turn: Matrix3<f64>,
    turn_shift: Matrix3<f64>,
    shift_shift: Matrix3<f64>,
    torque: Vector3<f64>,
    force: Vector3<f64>,
}

impl Composite {
    const fn zero() -> Self {
        let matrix = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        Self {
            turn_turn: matrix,
            turn_shift: matrix,
            shift_shift: matrix,
            torque: Vector3::new(0.0, 0.0, 0.0),
            force: Vector3::new(0.0, 0.0, 0.0),
        }
    }

    fn add(&mut self, other: &Self) {
        self.turn_turn += other.turn_turn;
        self.turn_shift += other.turn_shift;
        self.shift_shift += other.shift_shift;
        self.torque += other.torque;
        self.force += other.force;
    }
}

/// `H x = -g`, sparse along the tree.
#[derive(Clone, Debug)]
pub(super) struct Normal {
    composites: [Composite; BONE_COUNT],
    /// `rows[i][j]` for `j` a carrier of `i`, and `i` itself; the rest is never read.
    rows: Box<[[f64; MOST]; MOST]>,
    factor: Box<[[f64; MOST]; MOST]>,
    pub(super) gradient: [f64; MOST],
}

impl Normal {
    pub(super) fn new() -> Self {
        Self {
            composites: [Composite::zero(); BONE_COUNT],
            rows: Box::new([[0.0; MOST]; MOST]),
            factor: Box::new([[0.0; MOST]; MOST]),
            gradient: [0.0; MOST],
        }
    }

    /// Forgets all residuals.
    pub(super) fn clear(&mut self) {
        self.composites = [Composite::zero(); BONE_COUNT];
    }

    /// A point that `bone` carries, at `point` from the reference point; it is off by `residual`, which weighs `weight`.
    pub(super) fn add_point(
        &mut self,
        bone: usize,
        point: &Vector3<f64>,
        residual: &Vector3<f64>,
        weight: &Matrix3<f64>,
    ) {
        let composite = &mut self.composites[bone];
        let cross = point.cross_matrix();
        let force = weight * residual;
        let turn_shift = cross * weight;
        composite.turn_turn -= turn_shift * cross;
        composite.turn_shift += turn_shift;
        composite.shift_shift += weight;
        composite.torque += point.cross(&force);
        composite.force += force;
    }

    /// Adds up what bones carry, and makes the entries between freedoms that move as `motions` say.
    pub(super) fn assemble(&mut self, freedoms: &[Freedom], motions: &[Motion; MOST]) {
        for bone in (0..BONE_COUNT).rev().filter(|bone| *bone != HIPS) {
            let composite = self.composites[bone];
            self.composites[BONES[bone].parent].add(&composite);
        }
        for (i, freedom) in freedoms.iter().enumerate() {
            let (composite, motion) = (&self.composites[freedom.bone], &motions[i]);
            let torque = composite.turn_turn * motion.turn + composite.turn_shift * motion.shift;
            let force =
                composite.turn_shift.tr_mul(&motion.turn) + composite.shift_shift * motion.shift;
            self.gradient[i] =
                motion.turn.dot(&composite.torque) + motion.shift.dot(&composite.force);
            let mut j = i;
            while j != NONE {
                self.rows[i][j] = motions[j].turn.dot(&torque) + motions[j].shift.dot(&force);
                j = freedoms[j].carrier;
            }
        }
    }

    /// A residual of freedom `i` alone: `weight * residual^2 / 2`, whose derivative by the freedom is 1.
    pub(super) fn add_single(&mut self, i: usize, residual: f64, weight: f64) {
        self.gradient[i] += weight * residual;
        self.rows[i][i] += weight;
    }

    /// A residual of three successive freedoms from `first` on, with this derivative.
    pub(super) fn add_ball(
        &mut self,
        first: usize,
        derivative: &Vector3<f64>,
        residual: f64,
        weight: f64,
    ) {
        for a in 0..3 {
            self.gradient[first + a] += weight * residual * derivative[a];
            for b in 0..=a {
                self.rows[first + a][first + b] += weight * derivative[a] * derivative[b];
            }
        }
    }

    /// The step from here, each diagonal entry made larger by `damping` of itself. `None` where that is still singular.
    pub(super) fn solve(&mut self, freedoms: &[Freedom], damping: f64) -> Option<[f64; MOST]> {
        let count = freedoms.len();
        for i in 0..count {
            self.factor[i][..=i].copy_from_slice(&self.rows[i][..=i]);
            self.factor[i][i] += damping * self.rows[i][i] + 1e-9;
        }
        for k in (0..count).rev() {
            let pivot = self.factor[k][k];
            if !(pivot.is_finite() && pivot > 0.0) {
                return None;
            }
            let mut i = freedoms[k].carrier;
            while i != NONE {
                let share = self.factor[k][i] / pivot;
                let mut j = i;
                while j != NONE {
                    self.factor[i][j] -= share * self.factor[k][j];
                    j = freedoms[j].carrier;
                }
                self.factor[k][i] = share;
                i = freedoms[i].carrier;
            }
        }
        let mut step = [0.0; MOST];
        for (step, gradient) in step.iter_mut().zip(&self.gradient[..count]) {
            *step = -gradient;
        }
        for i in (0..count).rev() {
            let mut j = freedoms[i].carrier;
            while j != NONE {
                step[j] -= self.factor[i][j] * step[i];
                j = freedoms[j].carrier;
            }
        }
        for (i, step) in step.iter_mut().enumerate().take(count) {
            *step /= self.factor[i][i];
        }
        for i in 0..count {
            let mut j = freedoms[i].carrier;
            while j != NONE {
                step[i] -= self.factor[i][j] * step[j];
                j = freedoms[j].carrier;
            }
        }
        Some(step)
    }
}
