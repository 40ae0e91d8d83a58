//! Least-squares polynomial fit through arbitrary places, expressed as one weight per sample.
//!
//! The value (or derivative) of the fitted polynomial at a place is linear in the samples, so the
//! fit is solved once for the weights and then applied to any number of components. Places are
//! mapped to -1..=1 and the polynomial basis is orthonormalised over them by the Arnoldi process
//! (Brubeck, Nakatsukasa & Trefethen, "Vandermonde with Arnoldi", SIAM Review 63, 2021), each
//! vector twice against all before it. This never forms powers of time, whose condition number
//! grows exponentially with the order. Derivatives follow by differentiating the same recurrence.

/// Smallest norm of a new basis vector before the places count as too few distinct ones.
const RANK_TOLERANCE: f64 = 1e-13;

/// Scratch space of the solver; [`Fit::solve`] allocates nothing.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    /// Places mapped to -1..=1, one per sample.
    nodes: Vec<f64>,
    /// Basis polynomials at the nodes, one row per degree.
    basis: Vec<f64>,
    /// Basis polynomials at the evaluated place, one row per degree, one column per derivative.
    at: Vec<f64>,
    weights: Vec<f64>,
}

impl Fit {
    /// Space for fits of up to `window` samples, degree `order` and derivative `derivative`.
    pub(crate) fn new(window: usize, order: usize, derivative: usize) -> Self {
        Self {
            nodes: Vec::with_capacity(window),
            basis: vec![0.0; window * (order + 1)],
            at: vec![0.0; (order + 1) * (derivative + 1)],
            weights: Vec::with_capacity(window),
        }
    }

    /// Room of each buffer, to show that solving does not enlarge them.
    #[cfg(test)]
    pub(crate) fn capacities(&self) -> [usize; 4] {
        [&self.nodes, &self.basis, &self.at, &self.weights].map(Vec::capacity)
    }

    /// Fits a polynomial of degree `order` through `places` (strictly increasing, any unit `u`),
    /// evaluates its `derivative` at `place`, and gives the weights (unit `1/u^derivative`) with
    /// the degree that the places could bear, which is lower than `order` where there are too few
    /// of them or some coincide numerically. `None` if even the derivative could not be borne.
    pub(crate) fn solve(
        &mut self,
        places: impl Iterator<Item = f64>,
        place: f64,
        order: usize,
        derivative: usize,
    ) -> Option<(&[f64], usize)> {
        self.nodes.clear();
        self.nodes.extend(places);
        let (first, last) = (*self.nodes.first()?, *self.nodes.last()?);
        let middle = 0.5 * (first + last);
        let half = if last > first {
            0.5 * (last - first)
        } else {
            1.0
        };
        for node in &mut self.nodes {
            *node = (*node - middle) / half;
        }
        let order = order.min(self.nodes.len() - 1);
        let reached = self.orthonormalise((place - middle) / half, order, derivative);
        if derivative > reached {
            return None;
        }
        self.combine(reached, derivative, power(half, derivative));
        Some((&self.weights, reached))
    }

    /// Fills `basis` and `at` degree by degree; returns the highest degree reached.
    fn orthonormalise(&mut self, place: f64, order: usize, derivative: usize) -> usize {
        let n = self.nodes.len();
        let columns = derivative + 1;
        let constant = 1.0 / (n as f64).sqrt();
        self.basis[..n].fill(constant);
        self.at[..columns].fill(0.0);
        self.at[0] = constant;

        for degree in 0..order {
            let (old, new) = self.basis.split_at_mut((degree + 1) * n);
            let (old_at, new_at) = self.at.split_at_mut((degree + 1) * columns);
            let (new, new_at) = (&mut new[..n], &mut new_at[..columns]);

            multiply_by_x(&old[degree * n..], &self.nodes, new);
            differentiate_product(&old_at[degree * columns..], place, new_at);
            for _ in 0..2 {
                for (q, q_at) in old.chunks_exact(n).zip(old_at.chunks_exact(columns)) {
                    let along = dot(q, new);
                    subtract(new, along, q);
                    subtract(new_at, along, q_at);
                }
            }
            let norm = dot(new, new).sqrt();
            if norm <= RANK_TOLERANCE {
                return degree;
            }
            new.iter_mut().for_each(|v| *v /= norm);
            new_at.iter_mut().for_each(|v| *v /= norm);
        }
        order
    }

    /// Sums the basis into one weight per sample and divides by `scale`.
    fn combine(&mut self, order: usize, derivative: usize, scale: f64) {
        let n = self.nodes.len();
        let columns = derivative + 1;
        self.weights.clear();
        self.weights.resize(n, 0.0);
        for degree in 0..=order {
            let height = self.at[degree * columns + derivative] / scale;
            let q = &self.basis[degree * n..(degree + 1) * n];
            subtract(&mut self.weights, -height, q);
        }
    }
}

/// `base` to the power `exponent` by repeated multiplication, the same bits on every machine.
pub(crate) fn power(base: f64, exponent: usize) -> f64 {
    (0..exponent).fold(1.0, |product, _| product * base)
}

fn multiply_by_x(q: &[f64], x: &[f64], out: &mut [f64]) {
    for ((out, q), x) in out.iter_mut().zip(q).zip(x) {
        *out = x * q;
    }
}

/// Derivatives of `x q(x)` at `place` from those of `q`: `(x q)^(m) = x q^(m) + m q^(m-1)`.
fn differentiate_product(q_at: &[f64], place: f64, out: &mut [f64]) {
    out[0] = place * q_at[0];
    for m in 1..out.len() {
        out[m] = place * q_at[m] + m as f64 * q_at[m - 1];
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn subtract(from: &mut [f64], factor: f64, q: &[f64]) {
    for (from, q) in from.iter_mut().zip(q) {
        *from -= factor * q;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_that_coincide_numerically_lower_the_degree() {
        let mut fit = Fit::new(3, 2, 0);
        let places = [0.0, 1.0, 1e18];
        let (weights, order) = fit.solve(places.into_iter(), 0.0, 2, 0).unwrap();
        assert_eq!(order, 1);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_derivative_that_cannot_be_borne_gives_nothing() {
        let mut fit = Fit::new(4, 2, 2);
        assert!(fit.solve([5.0, 6.0].into_iter(), 6.0, 2, 2).is_none());
        assert!(fit.solve([5.0, 6.0, 8.0].into_iter(), 6.0, 2, 2).is_some());
        assert!(fit.solve([].into_iter(), 0.0, 2, 0).is_none());
    }

    #[test]
    fn an_interpolating_fit_leaves_its_node_alone() {
        let mut fit = Fit::new(255, 254, 0);
        let places = (0..255).map(f64::from);
        let (weights, order) = fit.solve(places, 254.0, 254, 0).unwrap();
        assert_eq!(order, 254);
        for (i, w) in weights.iter().enumerate() {
            let expected = f64::from(u8::from(i == 254));
            assert!((w - expected).abs() < 1e-9, "weight {i} is {w}");
        }
    }
}
