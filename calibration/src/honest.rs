//! How much less is known than the normal equations say.
//!
//! They take samples to be independent, or to repeat each other equally often whatever they say of. In truth a tracker's
//! errors live for some 0.4 s, those of hidden joints are shared down the chain of bones, and the few seconds in which
//! somebody crosses a corner decide much. So the pull of whole stretches of time is compared with what it would be
//! (cluster-robust, after Liang and Zeger 1986), for poses and for clocks apart. As the unknowns were fitted to the same
//! stretches, what is left of the pull is smaller than the errors were, the more so the fewer there are: what the fit took
//! is counted back in (after Bell and McCaffrey 2002).

use nalgebra::{DMatrix, DVector};

use crate::normal::{JointSystem, PER_SENSOR, Reduced};

/// How long a tracker's errors live, seconds.
const ERRORS_LIVE_S: f64 = 0.4;
/// Range of the factors of variance.
const FACTORS: [f64; 2] = [0.25, 100.0];

/// The covariance of poses and ray biases. `systems` keep their parts, one for each stretch of `stretch_s`; `bend`: how
/// much less the robust cost bends than its weights say. `None` where the equations are singular.
pub(crate) fn covariance(
    reduced: &Reduced,
    systems: &[JointSystem],
    stretch_s: f64,
    bend: f64,
) -> Option<DMatrix<f64>> {
    let mut covariance = reduced.covariance()?;
    let stretches = systems.first()?.parts.len();
    let parts: Vec<Part> = (0..stretches)
        .map(|stretch| Part::new(reduced, systems, stretch, &covariance))
        .collect();
    let poses = reduced.layout.poses();
    let known = |index: &usize| covariance[(*index, *index)] > 0.0;
    let of_kind = |clock: bool| -> Vec<usize> {
        let unknowns = 0..poses;
        unknowns
            .filter(known)
            .filter(|index| (index % PER_SENSOR >= 6) == clock)
            .collect()
    };
    // Neighbouring stretches share what lives across their border, which the sum over single ones leaves out.
    let border = 1.0 / (1.0 - (ERRORS_LIVE_S / stretch_s).min(0.5));
    let mut scales = DVector::from_element(covariance.nrows(), 1.0);
    for clock in [false, true] {
        let kind = of_kind(clock);
        if let Some(factor) = factor(&kind, &covariance, &parts) {
            let [least, most] = FACTORS;
            let factor = (factor * border / (bend * bend)).clamp(least, most);
            for index in kind {
                scales[index] = factor.sqrt();
            }
        }
    }
    for c in 0..covariance.ncols() {
        for r in 0..covariance.nrows() {
            covariance[(r, c)] *= scales[r] * scales[c];
        }
    }
    Some(covariance)
}

/// What one stretch does to the unknowns.
struct Part {
    /// How it moved them.
    moved: DVector<f64>,
    /// The covariance of that, were the model right.
    expected: DMatrix<f64>,
}

impl Part {
    fn new(
        reduced: &Reduced,
        systems: &[JointSystem],
        stretch: usize,
        covariance: &DMatrix<f64>,
    ) -> Self {
        let layout = reduced.layout;
        let size = layout.shared();
        let outer = layout.poses() + 1;
        let mut pull = DVector::<f64>::zeros(size);
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut taken = DMatrix::<f64>::zeros(size, size);
        for (joint, (system, eliminated)) in systems.iter().zip(&reduced.joints).enumerate() {
            let place = |i: usize| if i + 1 < outer { i } else { i + joint };
            let shift = eliminated.factor.solve(&eliminated.coupling);
            let inner = shift.nrows();
            let (gradient, part) = (&system.gradients[stretch], &system.parts[stretch]);
            let own = gradient.rows(0, outer) - shift.tr_mul(&gradient.rows(outer, inner));
            // Of the unknowns that all joints share, by their own way and by the way that joints' own unknowns follow.
            let to_inner = part.view((0, outer), (outer, inner))
                - shift.tr_mul(&part.view((outer, outer), (inner, inner)));
            let half = shift.tr_mul(&part.view((outer, 0), (inner, outer)));
            let all = part.view((0, 0), (outer, outer)) - &half - &to_inner * &shift;
            let by_inner = &to_inner * eliminated.factor.solve(&to_inner.transpose());
            for c in 0..outer {
                for r in 0..outer {
                    normal[(place(r), place(c))] += all[(r, c)];
                    taken[(place(r), place(c))] += by_inner[(r, c)];
                }
                pull[place(c)] += own[c];
            }
        }
        // With the data's share: as they count in the covariance.
        let share = reduced.share;
        let left =
            normal.clone() * share - (&normal * covariance * &normal + taken) * (share * share);
        Self {
            moved: covariance * pull * share,
            expected: covariance * left * covariance,
        }
    }
}

/// How much more these unknowns were moved than expected, as a factor of variance, averaged over all directions as far as
/// they are known.
fn factor(kind: &[usize], covariance: &DMatrix<f64>, parts: &[Part]) -> Option<f64> {
    if kind.is_empty() {
        return None;
    }
    let of = |matrix: &DMatrix<f64>| matrix.select_rows(kind).select_columns(kind);
    let information = of(covariance).cholesky()?.inverse();
    let (mut seen, mut expected, mut squares) = (0.0, 0.0, 0.0);
    for part in parts {
        let moved = part.moved.select_rows(kind);
        seen += moved.dot(&(&information * &moved));
        let own = information
            .component_mul(&of(&part.expected))
            .sum()
            .max(0.0);
        expected += own;
        squares += own * own;
    }
    // What few numbers say of a variance is uncertain in itself (Student's distribution).
    let freedom = expected * expected / squares * kind.len() as f64;
    (freedom > 2.5).then(|| seen / expected * freedom / (freedom - 2.0))
}
