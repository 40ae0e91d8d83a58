//! The fit of the whole body to fused positions: damped least squares over all joint angles and the root.
//!
//! Levenberg (1944) and Marquardt (1963), with Gauss-Newton's Hessian. Residuals: positions, weighted by the inverse of
//! their covariance, those far off by less (Cauchy's weight); anatomical ranges where they are exceeded; what is usual;
//! and how far joints stray from the frame before. Lengths are the body's by construction.
//!
//! How the twist of a straight limb is kept needs no rule here: its bend says little then, so the frame before says more.

mod freedom;
mod normal;
mod prior;

use nalgebra::{Matrix3, Vector3};

use crate::bones::BONES;
use crate::config::Config;
use crate::posture::{Offsets, Placed, Posture};

use freedom::{Freedoms, MOST};
use normal::{Motion, Normal};
pub(crate) use prior::Before;
use prior::Priors;

/// Where a joint should be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    /// The bone whose origin it is.
    pub(crate) bone: usize,
    /// Room metres.
    pub(crate) at: Vector3<f64>,
    /// The inverse of the covariance, 1/m^2.
    pub(crate) weight: Matrix3<f64>,
    /// Whether it counts less where it is far off.
    pub(crate) robust: bool,
}

/// What a fit came to.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub(crate) posture: Posture,
    pub(crate) placed: Placed,
    /// Half the sum of all weighted squares.
    pub(crate) cost: f64,
}

/// Squared distances (in standard deviations, three axes) beyond this count less: Cauchy's weight.
const ROBUST: f64 = 12.0;
const FIRST_DAMPING: f64 = 1e-4;
const LEAST_DAMPING: f64 = 1e-9;
const MOST_DAMPING: f64 = 1e6;
/// Longest step of one freedom, radians or metres.
const LONGEST_STEP: f64 = 0.6;
/// A step shorter than this (radians, metres) is the last: what would follow is shorter by far.
const LAST_STEP: f64 = 1e-3;

/// A posture that was tried.
struct Trial {
    fitted: Fitted,
    /// The room axis of each freedom that turns.
    axes: [Vector3<f64>; MOST],
}

/// Fits one body. Working memory is kept from frame to frame.
#[derive(Clone, Debug)]
pub(crate) struct Fitter {
    offsets: Offsets,
    freedoms: Freedoms,
    priors: Priors,
    normal: Normal,
    motions: [Motion; MOST],
}

impl Fitter {
    pub(crate) fn new(offsets: &Offsets, config: &Config) -> Self {
        let freedoms = Freedoms::new(&config.extra);
        Self {
            offsets: *offsets,
            priors: Priors::new(&freedoms, config),
            freedoms,
            normal: Normal::new(),
            motions: [Motion::default(); MOST],
        }
    }

    /// The posture that lies best on the targets, from `start` on, after `last`; at most `iterations` steps.
    pub(crate) fn fit(
        &mut self,
        start: Posture,
        targets: &[Target],
        last: Option<Before>,
        iterations: usize,
    ) -> Fitted {
        let mut best = self.tried(start, targets, last);
        let mut damping = FIRST_DAMPING;
        let mut stale = true;
        for _ in 0..iterations {
            if stale {
                self.linearise(&best, targets, last);
                stale = false;
            }
            let Some(step) = self.normal.solve(&self.freedoms.list, damping) else {
                damping = (damping * 100.0).max(1e-3);
                continue;
            };
            let longest = step.iter().fold(0.0f64, |most, step| most.max(step.abs()));
            if !longest.is_finite() {
                break;
            }
            let step = step.map(|step| step * (LONGEST_STEP / longest).min(1.0));
            let moved = self.freedoms.moved(&best.fitted.posture, &step);
            let trial = self.tried(moved, targets, last);
            if trial.fitted.cost < best.fitted.cost {
                best = trial;
                stale = true;
                damping = (damping * 0.2).max(LEAST_DAMPING);
            } else {
                damping *= 20.0;
            }
            if longest < LAST_STEP || damping > MOST_DAMPING {
                break;
            }
        }
        best.fitted
    }

    /// What a posture costs in itself, without what was before.
    pub(crate) fn cost(&self, fitted: &Fitted, targets: &[Target]) -> f64 {
        self.tried(fitted.posture.clone(), targets, None)
            .fitted
            .cost
    }

    /// Where this posture places the bones, and what it costs.
    fn tried(&self, posture: Posture, targets: &[Target], last: Option<Before>) -> Trial {
        let mut placed = Placed::new();
        let mut axes = [Vector3::zeros(); MOST];
        let first = &self.freedoms.first;
        placed.place(&self.offsets, &posture, |bone, index, axis| {
            if first[bone] != freedom::NONE {
                axes[first[bone] + index] = axis;
            }
        });
        let mut cost = self.priors.cost(&posture, last);
        for target in targets {
            let squared = squared(target, &placed);
            cost += 0.5
                * if target.robust {
                    ROBUST * (squared / ROBUST).ln_1p()
                } else {
                    squared
                };
        }
        let fitted = Fitted {
            posture,
            placed,
            cost,
        };
        Trial { fitted, axes }
    }

    /// The normal equations at this posture.
    fn linearise(&mut self, trial: &Trial, targets: &[Target], last: Option<Before>) {
        let Self {
            normal,
            motions,
            freedoms,
            ..
        } = self;
        let at = &trial.fitted;
        let root = at.posture.root;
        for (index, freedom) in freedoms.list.iter().enumerate() {
            motions[index] = if freedom.shifts {
                Motion {
                    turn: Vector3::zeros(),
                    shift: Vector3::ith(freedom.index, 1.0),
                }
            } else {
                let point = at.placed.origins[freedom.bone] - root;
                Motion {
                    turn: trial.axes[index],
                    shift: point.cross(&trial.axes[index]),
                }
            };
        }
        normal.clear();
        for target in targets {
            let residual = at.placed.origins[target.bone] - target.at;
            let weight = if target.robust {
                target.weight / (1.0 + squared(target, &at.placed) / ROBUST)
            } else {
                target.weight
            };
            let point = at.placed.origins[target.bone] - root;
            normal.add_point(BONES[target.bone].parent, &point, &residual, &weight);
        }
        normal.assemble(&freedoms.list, motions);
        self.priors.add(normal, &at.posture, last);
    }
}

/// How far off a target is, in standard deviations, squared.
fn squared(target: &Target, placed: &Placed) -> f64 {
    let residual = placed.origins[target.bone] - target.at;
    residual.dot(&(target.weight * residual))
}
