//! Rigid alignment of weighted point pairs (Kabsch 1976, with Umeyama's 1991 guard against reflections).

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use posefuse_skeleton::{Frame, Position, Transform};
use thiserror::Error;

/// The same point in two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPair<To: Frame, From: Frame> {
    /// Where it is in `To`, metres.
    pub to: Position<To>,
    /// Where it is in `From`, metres.
    pub from: Position<From>,
    /// How much it counts, not negative.
    pub weight: f64,
}

/// The rigid motion that fits best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidFit<To: Frame, From: Frame> {
    /// Takes points of `From` to `To`.
    pub to_from_from: Transform<To, From>,
    /// Weighted root mean square distance that is left, metres.
    pub rms_m: f64,
    /// Smallest over largest singular value of the centred cloud: 0 is flat, 1 a ball.
    pub singular_ratio: f64,
}

/// The pairs do not determine a motion.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum Degenerate {
    /// Fewer than three pairs with weight.
    #[error("a rigid motion needs three point pairs or more, found {0}")]
    TooFew(usize),
    /// All points lie on one line or in one place.
    #[error(
        "all points lie on one line or in one place (second over first singular value {0:.1e}): the turn about it is free"
    )]
    Line(f64),
    /// A coordinate or weight is NaN, infinite or a negative weight.
    #[error("a coordinate or weight is not a finite number, or a weight is negative")]
    NotFinite,
}

/// Second over first singular value below which points count as lying on a line.
const LINE: f64 = 1e-6;

/// The proper rotation and translation that bring `from` to `to` with the least weighted sum of squares.
///
/// Never a reflection. Exact on exact data, also when all points lie in one plane.
pub fn kabsch<To: Frame, From: Frame>(
    pairs: &[PointPair<To, From>],
) -> Result<RigidFit<To, From>, Degenerate> {
    let mut sums = Sums::default();
    for pair in pairs {
        let finite = pair.to.is_finite() && pair.from.is_finite() && pair.weight.is_finite();
        if !finite || pair.weight < 0.0 {
            return Err(Degenerate::NotFinite);
        }
        sums.add(pair.to.vector(), pair.from.vector(), pair.weight);
    }
    if sums.count < 3 {
        return Err(Degenerate::TooFew(sums.count));
    }
    let (to_centre, from_centre) = (sums.to / sums.weight, sums.from / sums.weight);
    let mut cross = Matrix3::zeros();
    let mut cloud = Matrix3::zeros();
    for pair in pairs {
        let to = pair.to.vector() - to_centre;
        let from = pair.from.vector() - from_centre;
        let share = pair.weight / sums.weight;
        cross += to * from.transpose() * share;
        cloud += from * from.transpose() * share;
    }
    let spread = singular_values(&cloud);
    if spread[0] <= f64::MIN_POSITIVE || spread[1] < LINE * spread[0] {
        return Err(Degenerate::Line(
            spread[1] / spread[0].max(f64::MIN_POSITIVE),
        ));
    }
    let rotation = nearest_rotation(&cross);
    let to_from_from = Transform::from_parts(to_centre - rotation * from_centre, rotation);
    let squares: f64 = pairs
        .iter()
        .map(|p| p.weight * (to_from_from.apply(p.from).vector() - p.to.vector()).norm_squared())
        .sum();
    Ok(RigidFit {
        to_from_from,
        rms_m: (squares / sums.weight).sqrt(),
        singular_ratio: spread[2] / spread[0],
    })
}

/// Singular values of a centred cloud, largest first, from its mean of outer products (m^2); metres.
pub(crate) fn singular_values(cloud: &Matrix3<f64>) -> [f64; 3] {
    let mut values: [f64; 3] = cloud.symmetric_eigenvalues().into();
    values.sort_by(|a, b| b.total_cmp(a));
    values.map(|value| value.max(0.0).sqrt())
}

/// The proper rotation R that makes trace(R^T `cross`) largest.
fn nearest_rotation(cross: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let svd = cross.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return UnitQuaternion::identity();
    };
    // The guard must turn the weakest direction, and nalgebra orders singular values from large to small.
    let sign = (u.determinant() * v_t.determinant()).signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))
}

#[derive(Default)]
struct Sums {
    count: usize,
    weight: f64,
    to: Vector3<f64>,
    from: Vector3<f64>,
}

impl Sums {
    fn add(&mut self, to: Vector3<f64>, from: Vector3<f64>, weight: f64) {
        if weight > 0.0 {
            self.count += 1;
            self.weight += weight;
            self.to += to * weight;
            self.from += from * weight;
        }
    }
}
