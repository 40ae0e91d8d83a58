//! Back in time: what later measurements say of an earlier instant (the smoother of Rauch, Tung and Striebel, in the
//! form of Bryson and Frazier, which inverts nothing).
//!
//! One walk over a joint's steps, from the newest to the oldest, serves a look-ahead of one frame and a whole take.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::motion::Motion;
use super::state::{Belief, Blocks, Correction, symmetric};

/// One joint's part of one frame: how it came here from the frame before, what it was told, what it believes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Step {
    /// `None` where the belief began.
    pub(super) motion: Option<Motion>,
    pub(super) correction: Option<Correction>,
    pub(super) belief: Belief,
}

/// What all later steps say of the step that is looked at.
pub(super) struct Hindsight {
    /// To be multiplied by the step's covariance; `None` while nothing is known.
    told: Option<([Vector3<f64>; 3], Blocks)>,
}

impl Hindsight {
    pub(super) fn none() -> Self {
        Self { told: None }
    }

    /// The step's place and its covariance, all that came later considered.
    pub(super) fn place(&self, step: &Step) -> (Vector3<f64>, Matrix3<f64>) {
        let Belief { mean, cov } = &step.belief;
        let Some((pull, certainty)) = &self.told else {
            return (mean[0], cov.pp);
        };
        let rows = [&cov.pp, &cov.pv, &cov.pa];
        let moved = mean[0] + rows[0] * pull[0] + rows[1] * pull[1] + rows[2] * pull[2];
        let c = certainty;
        let (vp, ap, av) = (c.pv.transpose(), c.pa.transpose(), c.va.transpose());
        let through = [
            rows[0] * c.pp + rows[1] * vp + rows[2] * ap,
            rows[0] * c.pv + rows[1] * c.vv + rows[2] * av,
            rows[0] * c.pa + rows[1] * c.va + rows[2] * c.aa,
        ];
        let less = through[0] * rows[0].transpose()
            + through[1] * rows[1].transpose()
            + through[2] * rows[2].transpose();
        let left = symmetric(&(cov.pp - less));
        // What came later makes no place less certain.
        let sound =
            (0..3).all(|i| left[(i, i)] > 0.0 && left[(i, i)] <= cov.pp[(i, i)] * (1.0 + 1e-9));
        (moved, if sound { left } else { cov.pp })
    }

    /// Goes from `step` to the one before it.
    pub(super) fn back(&mut self, step: &Step) {
        let (pull, certainty) = match (self.told.take(), &step.correction) {
            (None, None) => return,
            (Some(told), None) => told,
            (told, Some(correction)) => {
                let (pull, certainty) = told.unwrap_or(([Vector3::zeros(); 3], Blocks::zero()));
                through(correction, &pull, &certainty)
            }
        };
        self.told = step
            .motion
            .as_ref()
            .map(|motion| (motion.apply_back(&pull), motion.carry_back(&certainty)));
    }
}

/// What was known after a correction, said of before it.
fn through(
    correction: &Correction,
    pull: &[Vector3<f64>; 3],
    n: &Blocks,
) -> ([Vector3<f64>; 3], Blocks) {
    let Correction {
        h,
        gain,
        certainty,
        surprise,
    } = correction;
    let explained: Vector3<f64> = (0..3).map(|i| gain[i].tr_mul(&pull[i])).sum();
    let rest = surprise - explained;
    let with = [
        n.pp * gain[0] + n.pv * gain[1] + n.pa * gain[2],
        n.pv.tr_mul(&gain[0]) + n.vv * gain[1] + n.va * gain[2],
        n.pa.tr_mul(&gain[0]) + n.va.tr_mul(&gain[1]) + n.aa * gain[2],
    ];
    let centre: Matrix3<f64> = certainty
        + (0..3)
            .map(|i| gain[i].tr_mul(&with[i]))
            .sum::<Matrix3<f64>>();
    let block = |was: &Matrix3<f64>, i: usize, j: usize| {
        was - with[j].transpose() * h[i] - with[i] * h[j] + centre * (h[i] * h[j])
    };
    // The sum above takes these for symmetric: what rounding adds to them would grow with every step back.
    let before = Blocks {
        pp: symmetric(&block(&n.pp, 0, 0)),
        pv: block(&n.pv, 0, 1),
        pa: block(&n.pa, 0, 2),
        vv: symmetric(&block(&n.vv, 1, 1)),
        va: block(&n.va, 1, 2),
        aa: symmetric(&block(&n.aa, 2, 2)),
    };
    (std::array::from_fn(|i| pull[i] + rest * h[i]), before)
}
