//! The normal equations of the bundle, joint by joint.
//!
//! Unknowns that only one joint has (each sensor's own offset of it, each joint set's definition of it) couple to the rest
//! through that joint alone: they are eliminated joint by joint (Schur complement), as the joint's place at each instant was
//! before. What remains are 8 unknowns per sensor and one ray bias per joint.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, SMatrix, Vector3};
use posefuse_skeleton::JOINT_COUNT;

/// Unknowns per sensor: turn (3), shift (3), time offset, clock drift.
pub(crate) const PER_SENSOR: usize = 8;
/// Most unknowns that one sight depends on.
pub(crate) const PER_SIGHT: usize = PER_SENSOR + 1 + 3 + 3;

/// Which unknown stands where in a joint's system: poses, ray bias, own offsets by sensor, definitions by joint set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub(crate) sensors: usize,
    pub(crate) definitions: usize,
}

impl Layout {
    /// Unknowns shared with other joints' systems, the ray bias not counted; that is their last.
    pub(crate) fn poses(self) -> usize {
        PER_SENSOR * self.sensors
    }

    pub(crate) fn own(self, sensor: usize) -> usize {
        self.poses() + 1 + 3 * sensor
    }

    pub(crate) fn definition(self, set: usize) -> usize {
        self.own(self.sensors) + 3 * set
    }

    fn size(self) -> usize {
        self.definition(self.definitions)
    }

    /// Unknowns of the whole bundle that are left after elimination: poses and ray biases.
    pub(crate) fn shared(self) -> usize {
        self.poses() + JOINT_COUNT
    }
}

/// What one sensor says of a joint at an instant, as a linear function of the unknowns.
pub(crate) struct Sight {
    /// Whose it is.
    pub(crate) sensor: usize,
    /// Inverse covariance times robust weight, world axes, 1/m^2.
    pub(crate) information: Matrix3<f64>,
    /// From the joint's estimated place to where the sensor puts it, metres.
    pub(crate) off: Vector3<f64>,
    /// Derivatives of that by the unknowns.
    pub(crate) derivatives: SMatrix<f64, 3, PER_SIGHT>,
    /// Where the unknowns stand in the joint's system; those from `used` on do not count.
    pub(crate) index: [usize; PER_SIGHT],
    /// How many unknowns there are.
    pub(crate) used: usize,
}

/// What two sensors share of a joint, by the unknowns of their sights.
type Block = SMatrix<f64, PER_SIGHT, PER_SIGHT>;

/// Everything that is known of one joint.
pub(crate) struct JointSystem {
    /// Of all unknowns; once the system is complete.
    normal: DMatrix<f64>,
    /// The same by stretch of time, where that was asked for.
    pub(crate) parts: Vec<DMatrix<f64>>,
    /// By stretch of time (one for all if they are not kept apart) and pair of sensors, the second not after the first.
    blocks: Vec<Vec<Block>>,
    /// By sensor: where its sights' unknowns stand, and how many there are.
    places: Vec<([usize; PER_SIGHT], usize)>,
    /// Downhill, by stretch of time.
    pub(crate) gradients: Vec<DVector<f64>>,
}

impl JointSystem {
    /// `parted`: whether to keep the normal matrix of each stretch.
    pub(crate) fn new(layout: Layout, stretches: usize, parted: bool) -> Self {
        let (size, sensors) = (layout.size(), layout.sensors);
        Self {
            normal: DMatrix::zeros(size, size),
            parts: Vec::new(),
            blocks: vec![
                vec![Block::zeros(); block(sensors, 0)];
                if parted { stretches } else { 1 }
            ],
            places: vec![([0; PER_SIGHT], 0); sensors],
            gradients: vec![DVector::zeros(size); stretches],
        }
    }

    /// Puts what pairs of sensors share into the normal matrix. To be called once, when all is added.
    pub(crate) fn complete(&mut self) {
        let mut parts: Vec<_> = self.blocks.iter().map(|blocks| self.part(blocks)).collect();
        for part in &parts {
            self.normal += part;
        }
        if parts.len() < self.gradients.len() {
            parts.clear();
        }
        self.parts = parts;
    }

    fn part(&self, blocks: &[Block]) -> DMatrix<f64> {
        let mut part = DMatrix::zeros(self.normal.nrows(), self.normal.ncols());
        for (one, (rows, height)) in self.places.iter().enumerate() {
            for (other, (columns, width)) in self.places.iter().enumerate().take(one + 1) {
                let shared = &blocks[block(one, other)];
                for (c, column) in columns.iter().enumerate().take(*width) {
                    for (r, row) in rows.iter().enumerate().take(*height) {
                        part[(*row, *column)] += shared[(r, c)];
                        if one != other {
                            part[(*column, *row)] += shared[(r, c)];
                        }
                    }
                }
            }
        }
        part
    }

    /// Adds the sights of one instant, in the order of the sensors; the joint's own place is eliminated.
    pub(crate) fn add(&mut self, stretch: usize, sights: &[Sight]) {
        let total: Matrix3<f64> = sights.iter().map(|s| s.information).sum();
        let Some(covariance) = total.try_inverse() else {
            return;
        };
        let gradient = &mut self.gradients[stretch];
        let blocks = if self.blocks.len() > 1 { stretch } else { 0 };
        let blocks = &mut self.blocks[blocks];
        for (i, one) in sights.iter().enumerate() {
            self.places[one.sensor] = (one.index, one.used);
            let turned = one.derivatives.transpose();
            let pull = turned * (one.information * one.off);
            for k in 0..one.used {
                gradient[one.index[k]] -= pull[k];
            }
            let spread = -one.information * covariance;
            for (k, other) in sights.iter().enumerate().take(i + 1) {
                let mut between = spread * other.information;
                if i == k {
                    between += one.information;
                }
                let half = between * other.derivatives;
                blocks[block(one.sensor, other.sensor)].gemm(1.0, &turned, &half, 1.0);
            }
        }
    }
}

/// Where the block of two sensors stands, the second not after the first.
fn block(one: usize, other: usize) -> usize {
    one * (one + 1) / 2 + other
}

/// What is believed before anything is seen: quadratic costs, as their normal matrix and downhill gradient.
pub(crate) struct Beliefs {
    /// On what is left after elimination.
    pub(crate) normal: DMatrix<f64>,
    pub(crate) gradient: DVector<f64>,
    /// Diagonal and gradient on what is eliminated, by joint.
    pub(crate) own: Vec<(DVector<f64>, DVector<f64>)>,
}

/// The equations with what belongs to one joint alone eliminated.
pub(crate) struct Reduced {
    pub(crate) layout: Layout,
    /// 1 over the number of samples that say as much as one independent one.
    pub(crate) share: f64,
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    pub(crate) joints: Vec<Eliminated>,
    held: Vec<bool>,
}

/// What belongs to one joint alone.
pub(crate) struct Eliminated {
    pub(crate) factor: Cholesky<f64, Dyn>,
    /// Eliminated by shared, with the data's share.
    pub(crate) coupling: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// A step of all unknowns.
pub(crate) struct Step {
    /// Poses, then ray biases.
    pub(crate) shared: DVector<f64>,
    /// By joint: own offsets by sensor, then definitions by set.
    pub(crate) own: Vec<DVector<f64>>,
}

impl Reduced {
    /// `repeats`: how many samples say as much as one independent one. `held`: unknowns that do not move. `None` where the
    /// equations are singular.
    pub(crate) fn new(
        systems: &[JointSystem],
        beliefs: &Beliefs,
        layout: Layout,
        repeats: f64,
        held: Vec<bool>,
    ) -> Option<Self> {
        let share = 1.0 / repeats;
        let outer = layout.poses() + 1;
        let inner = layout.size() - outer;
        let mut normal = beliefs.normal.clone();
        let mut gradient = beliefs.gradient.clone();
        let mut joints = Vec::new();
        for (joint, (system, (belief, pull))) in systems.iter().zip(&beliefs.own).enumerate() {
            let mut own = system.normal.view((outer, outer), (inner, inner)) * share;
            for i in 0..inner {
                own[(i, i)] += belief[i];
            }
            let total = system
                .gradients
                .iter()
                .fold(DVector::zeros(layout.size()), |sum: DVector<f64>, g| {
                    sum + g
                })
                * share;
            let coupling = system.normal.view((outer, 0), (inner, outer)) * share;
            let own_gradient = total.rows(outer, inner) + pull;
            let factor = own.cholesky()?;
            let shift = factor.solve(&coupling);
            let rest = system.normal.view((0, 0), (outer, outer)) * share - coupling.tr_mul(&shift);
            let downhill = total.rows(0, outer) - shift.tr_mul(&own_gradient);
            let place = |i: usize| {
                if i < outer - 1 {
                    i
                } else {
                    layout.poses() + joint
                }
            };
            for c in 0..outer {
                for r in 0..outer {
                    normal[(place(r), place(c))] += rest[(r, c)];
                }
                gradient[place(c)] += downhill[c];
            }
            joints.push(Eliminated {
                factor,
                coupling,
                gradient: own_gradient,
            });
        }
        for index in (0..normal.nrows()).filter(|index| held[*index]) {
            normal.row_mut(index).fill(0.0);
            normal.column_mut(index).fill(0.0);
            normal[(index, index)] = 1.0;
            gradient[index] = 0.0;
        }
        for index in 0..normal.nrows() {
            // Keeps a sensor that nothing holds where the tree put it.
            normal[(index, index)] += 1e-6;
        }
        Some(Self {
            layout,
            share,
            normal,
            gradient,
            joints,
            held,
        })
    }

    /// The step downhill.
    pub(crate) fn step(&self) -> Option<Step> {
        let shared = self.normal.clone().cholesky()?.solve(&self.gradient);
        let own = self.joints.iter().enumerate().map(|(joint, eliminated)| {
            let outer = self.outer(&shared, joint);
            let rest = &eliminated.gradient - &eliminated.coupling * outer;
            eliminated.factor.solve(&rest)
        });
        Some(Step {
            own: own.collect(),
            shared,
        })
    }

    /// The covariance of what is left after elimination: poses, then ray biases; 0 for what is held.
    pub(crate) fn covariance(&self) -> Option<DMatrix<f64>> {
        let mut covariance = self.normal.clone().cholesky()?.inverse();
        for index in (0..covariance.nrows()).filter(|index| self.held[*index]) {
            covariance.row_mut(index).fill(0.0);
            covariance.column_mut(index).fill(0.0);
        }
        Some(covariance)
    }

    /// How many samples say as much as one independent one: how much more the pull of single stretches of time varies than
    /// it would if all samples were independent (cluster-robust), averaged over all directions as far as they are known.
    pub(crate) fn repeats(&self, systems: &[JointSystem]) -> Option<f64> {
        let covariance = self.covariance()?;
        let size = self.layout.shared();
        let stretches = systems.first()?.gradients.len();
        let mut pulls = vec![DVector::<f64>::zeros(size); stretches];
        let mut expected = DMatrix::<f64>::zeros(size, size);
        let outer = self.layout.poses() + 1;
        for (joint, (system, eliminated)) in systems.iter().zip(&self.joints).enumerate() {
            let place = |i: usize| {
                if i < outer - 1 {
                    i
                } else {
                    self.layout.poses() + joint
                }
            };
            let shift = eliminated.factor.solve(&eliminated.coupling);
            let inner = shift.nrows();
            for (pull, gradient) in pulls.iter_mut().zip(&system.gradients) {
                let reduced = gradient.rows(0, outer) - shift.tr_mul(&gradient.rows(outer, inner));
                for i in 0..outer {
                    pull[place(i)] += reduced[i];
                }
            }
            let view =
                |r: usize, c: usize, nr: usize, nc: usize| system.normal.view((r, c), (nr, nc));
            let cross = view(outer, 0, inner, outer);
            let half = shift.tr_mul(&cross);
            let all = view(0, 0, outer, outer) - &half - half.transpose()
                + shift.tr_mul(&(view(outer, outer, inner, inner) * &shift));
            for c in 0..outer {
                for r in 0..outer {
                    expected[(place(r), place(c))] += all[(r, c)];
                }
            }
        }
        let seen: f64 = pulls.iter().map(|p| p.dot(&(&covariance * p))).sum();
        let independent: f64 = covariance.component_mul(&expected).sum();
        (independent > 0.0 && self.share > 0.0).then(|| seen / independent)
    }

    /// How large sensors' own offsets are, squared per axis: what the steps come to and what is not known of it.
    pub(crate) fn own_variance(&self, own: &[[Vector3<f64>; JOINT_COUNT]]) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (joint, eliminated) in self.joints.iter().enumerate() {
            let inverse = eliminated.factor.inverse();
            for (sensor, offsets) in own.iter().enumerate() {
                let unknown: f64 = (0..3)
                    .map(|axis| inverse[(3 * sensor + axis, 3 * sensor + axis)])
                    .sum();
                sum += offsets[joint].norm_squared() + unknown;
                count += 3.0;
            }
        }
        sum / f64::max(count, 1.0)
    }

    /// What one joint's system shares, out of all that is shared.
    fn outer(&self, shared: &DVector<f64>, joint: usize) -> DVector<f64> {
        let poses = self.layout.poses();
        let mut outer = shared.rows(0, poses + 1).into_owned();
        outer[poses] = shared[poses + joint];
        outer
    }
}
