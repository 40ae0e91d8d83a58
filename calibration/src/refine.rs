//! All sensors at once: robust Gauss-Newton over the pose and time offset of each, so that rings close.
//!
//! Residuals are the differences of the same joint placed by two sensors, over all pairs that saw it; for equal
//! weights that equals eliminating the unknown joint itself. The first sensor is held: its frame is the world here.
//!
//! A depth sensor sees the skin, so its tracker reports a joint some way towards the sensor. That *ray bias* is the
//! main systematic error between views: in simulated rings of four with 15 mm of it, estimating it along takes the error
//! over the volume from 23 mm to 4. One length per joint, the same for all sensors, is added along the ray.

use nalgebra::{DMatrix, DVector, Isometry3, Translation3, UnitQuaternion, Vector3};
use posefuse_skeleton::JOINT_COUNT;

use crate::graph::Placed;
use crate::matching::{common, match_bodies, other_side, vote};
use crate::pair::{REACH_M, robust_weight, sigma_of};
use crate::tracks::{Pose, SensorTracks};

/// Most rounds, and the largest step (m, rad) below which it is settled.
const MAX_ROUNDS: usize = 30;
const SETTLED: f64 = 1e-6;
/// Robust scale in standard deviations: at first, and from this round on.
const SCALES: [f64; 2] = [6.0, 3.0];
const TIGHT_FROM: usize = 4;
/// Unknowns per sensor: turn (3), shift (3), time offset (1).
const PER_SENSOR: usize = 7;
/// What is believed of a time offset before anything is seen, seconds.
const OFFSET_SIGMA_S: f64 = 0.1;
/// What is believed of the ray bias before anything is seen, metres: common to all joints (a body's half thickness at
/// most), and between joints. Wide against the 15 +- 6 mm that trackers of skin and joints differ by.
const BIAS_COMMON_M: f64 = 0.03;
const BIAS_JOINT_M: f64 = 0.006;
/// A tracker's errors live some 0.4 s, so that samples 0.1 s apart count for a quarter.
const INDEPENDENT_SHARE: f64 = 0.25;

/// What is estimated besides the poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice {
    /// Whether time offsets are estimated.
    pub(crate) time_offsets: bool,
    /// Whether the ray bias is estimated.
    pub(crate) ray_bias: bool,
}

/// What refinement found.
#[derive(Clone, Debug)]
pub(crate) struct Refined {
    /// One per sensor, in the first sensor's frame.
    pub(crate) placed: Vec<Placed>,
    /// Joint pairs that each sensor took part in.
    pub(crate) samples: Vec<u64>,
    /// Mean ray bias over the joints, metres away from the sensor.
    pub(crate) bias_m: f64,
}

/// One joint seen by two sensors at one instant.
struct Residual {
    /// The sensors.
    sensors: [usize; 2],
    /// The joint in each one's own labels.
    joints: [usize; 2],
    /// Where each places it, bias removed, metres.
    at: [Vector3<f64>; 2],
    /// Its velocity as each sees it, m/s.
    velocity: [Vector3<f64>; 2],
    /// Unit vector along each sensor's ray.
    ray: [Vector3<f64>; 2],
    /// Information, 1/m^2.
    weight: f64,
}

/// Improves `placed` at these instants.
pub(crate) fn refine(
    sensors: &[SensorTracks],
    times: &[f64],
    mut placed: Vec<Placed>,
    choice: Choice,
) -> Refined {
    let mut bias = [0.0; JOINT_COUNT];
    let mut samples = vec![0; sensors.len()];
    for round in 0..MAX_ROUNDS {
        let seen: Vec<_> = sensors
            .iter()
            .zip(&placed)
            .map(|(sensor, placed)| sensor.sample(times, placed.offset_s))
            .collect();
        let scale = SCALES[usize::from(round >= TIGHT_FROM)];
        let residuals = residuals(&seen, &placed, &bias, scale);
        samples.fill(0);
        for residual in &residuals {
            residual.sensors.iter().for_each(|s| samples[*s] += 1);
        }
        let Some(step) = newton_step(&residuals, &placed, &bias, choice) else {
            break;
        };
        let size = apply(&step, &mut placed, &mut bias);
        if round > TIGHT_FROM && size < SETTLED {
            break;
        }
    }
    Refined {
        placed,
        samples,
        bias_m: bias.iter().sum::<f64>() / JOINT_COUNT as f64,
    }
}

fn residuals(
    seen: &[Vec<Vec<Pose>>],
    placed: &[Placed],
    bias: &[f64; JOINT_COUNT],
    scale: f64,
) -> Vec<Residual> {
    let mut all = Vec::new();
    for a in 0..seen.len() {
        for b in a + 1..seen.len() {
            let first = all.len();
            pair_residuals([a, b], seen, placed, bias, &mut all);
            let pair = &mut all[first..];
            let mut distances: Vec<f64> = pair.iter().map(Residual::distance).collect();
            let sigma = sigma_of(&mut distances);
            for residual in pair {
                let square = residual.distance().powi(2);
                residual.weight *= robust_weight(square, scale * sigma) / (sigma * sigma);
            }
        }
    }
    all
}

fn pair_residuals(
    sensors: [usize; 2],
    seen: &[Vec<Vec<Pose>>],
    placed: &[Placed],
    bias: &[f64; JOINT_COUNT],
    into: &mut Vec<Residual>,
) {
    let world_from = sensors.map(|s| placed[s].world_from_sensor);
    let a_from_b = world_from[0].inverse() * world_from[1];
    let [seen_a, seen_b] = sensors.map(|s| &seen[s]);
    let votes = vote(seen_a, seen_b, &a_from_b, REACH_M);
    for (bodies_a, bodies_b) in seen_a.iter().zip(seen_b) {
        for found in match_bodies(bodies_a, bodies_b, &a_from_b, REACH_M, Some(&votes)) {
            let (pose_a, pose_b) = (&bodies_a[found.a], &bodies_b[found.b]);
            for (joint, p, q) in common(pose_a, pose_b, found.mirrored) {
                let joints = [joint, other_side(joint, found.mirrored)];
                let rays = [p.at.normalize(), q.at.normalize()];
                let points = [
                    p.at + rays[0] * bias[joints[0]],
                    q.at + rays[1] * bias[joints[1]],
                ];
                into.push(Residual {
                    sensors,
                    joints,
                    at: [0, 1].map(|i| world_from[i].transform_point(&points[i].into()).coords),
                    velocity: [0, 1].map(|i| world_from[i].rotation * [p, q][i].velocity),
                    ray: [0, 1].map(|i| world_from[i].rotation * rays[i]),
                    weight: p.weight * q.weight * INDEPENDENT_SHARE,
                });
            }
        }
    }
}

impl Residual {
    fn distance(&self) -> f64 {
        (self.at[0] - self.at[1]).norm()
    }

    /// Derivatives of `at[0] - at[1]` by the unknowns it depends on, each with the unknown's index.
    fn derivatives(&self, sensors: usize) -> [(usize, Vector3<f64>); 2 * (PER_SENSOR + 1)] {
        std::array::from_fn(|k| {
            let (side, unknown) = (k / (PER_SENSOR + 1), k % (PER_SENSOR + 1));
            let sign = if side == 0 { 1.0 } else { -1.0 };
            let index = PER_SENSOR * self.sensors[side] + unknown;
            let axis = |i: usize| Vector3::ith(i % 3, 1.0);
            match unknown {
                0..=2 => (index, axis(unknown).cross(&self.at[side]) * sign),
                3..=5 => (index, axis(unknown) * sign),
                6 => (index, -self.velocity[side] * sign),
                _ => (
                    PER_SENSOR * sensors + self.joints[side],
                    self.ray[side] * sign,
                ),
            }
        })
    }
}

/// Solves the normal equations; `None` where they are singular.
fn newton_step(
    residuals: &[Residual],
    placed: &[Placed],
    bias: &[f64; JOINT_COUNT],
    choice: Choice,
) -> Option<DVector<f64>> {
    let sensors = placed.len();
    let size = PER_SENSOR * sensors + JOINT_COUNT;
    let mut normal = DMatrix::zeros(size, size);
    let mut gradient = DVector::zeros(size);
    for residual in residuals {
        let apart = residual.at[0] - residual.at[1];
        let derivatives = residual.derivatives(sensors);
        for (i, di) in &derivatives {
            gradient[*i] -= residual.weight * di.dot(&apart);
            for (j, dj) in &derivatives {
                if j <= i {
                    normal[(*i, *j)] += residual.weight * di.dot(dj);
                }
            }
        }
    }
    normal.fill_upper_triangle_with_lower_triangle();
    add_beliefs(&mut normal, &mut gradient, placed, bias);
    let held = |index: usize| {
        let of_bias = index >= PER_SENSOR * sensors;
        index < PER_SENSOR
            || (!choice.ray_bias && of_bias)
            || (!choice.time_offsets && !of_bias && index % PER_SENSOR == 6)
    };
    for index in (0..size).filter(|index| held(*index)) {
        normal.row_mut(index).fill(0.0);
        normal.column_mut(index).fill(0.0);
        normal[(index, index)] = 1.0;
        gradient[index] = 0.0;
    }
    for index in 0..size {
        // Keeps a sensor that nothing holds where the tree put it.
        normal[(index, index)] += 1e-6;
    }
    Some(normal.cholesky()?.solve(&gradient))
}

/// What is known before anything is seen: time offsets are small, biases are alike.
fn add_beliefs(
    normal: &mut DMatrix<f64>,
    gradient: &mut DVector<f64>,
    placed: &[Placed],
    bias: &[f64; JOINT_COUNT],
) {
    for (sensor, placed) in placed.iter().enumerate() {
        let index = PER_SENSOR * sensor + 6;
        normal[(index, index)] += OFFSET_SIGMA_S.powi(-2);
        gradient[index] -= placed.offset_s * OFFSET_SIGMA_S.powi(-2);
    }
    // Inverse of BIAS_JOINT^2 I + BIAS_COMMON^2 11^T (Sherman-Morrison).
    let first = PER_SENSOR * placed.len();
    let own = BIAS_JOINT_M.powi(-2);
    let ratio = (BIAS_COMMON_M / BIAS_JOINT_M).powi(2);
    let shared = own * ratio / (1.0 + JOINT_COUNT as f64 * ratio);
    let total: f64 = bias.iter().sum();
    for i in 0..JOINT_COUNT {
        for j in 0..JOINT_COUNT {
            normal[(first + i, first + j)] += if i == j { own - shared } else { -shared };
        }
        gradient[first + i] -= own * bias[i] - shared * total;
    }
}

/// Takes the step; its largest part in metres or radians.
fn apply(step: &DVector<f64>, placed: &mut [Placed], bias: &mut [f64; JOINT_COUNT]) -> f64 {
    let mut largest: f64 = 0.0;
    for (sensor, placed) in placed.iter_mut().enumerate() {
        let part = |first: usize| -> Vector3<f64> {
            step.fixed_rows::<3>(PER_SENSOR * sensor + first)
                .into_owned()
        };
        let (turn, shift) = (part(0), part(3));
        let motion = Isometry3::from_parts(
            Translation3::from(shift),
            UnitQuaternion::from_scaled_axis(turn),
        );
        placed.world_from_sensor = motion * placed.world_from_sensor;
        placed.offset_s += step[PER_SENSOR * sensor + 6];
        largest = largest.max(turn.norm()).max(shift.norm());
    }
    let first = PER_SENSOR * placed.len();
    for (joint, bias) in bias.iter_mut().enumerate() {
        *bias += step[first + joint];
    }
    largest
}
