//! What is believed of the bundle's unknowns before anything is seen.

use nalgebra::{DMatrix, DVector};
use posefuse_skeleton::JOINT_COUNT;

use crate::bundle::{Setting, Unknowns};
use crate::normal::{Beliefs, Layout, PER_SENSOR};

/// Time offsets, seconds, and clock drifts: quartz clocks are off by some tens of ppm.
const OFFSET_S: f64 = 0.1;
const DRIFT: f64 = 50e-6;
/// Ray biases, metres: common to all joints (a body's half thickness at most), and between joints. Wide against the
/// 15 +- 6 mm that trackers of skin and joints differ by.
const RAY_COMMON_M: f64 = 0.03;
const RAY_JOINT_M: f64 = 0.006;
/// What a sensor adds of its own, per axis, metres: to begin with, and the range of what is learnt of it.
pub(crate) const OWN_M: f64 = 0.004;
pub(crate) const OWN_RANGE_M: [f64; 2] = [0.001, 0.03];
/// How far joint sets' ideas of a joint lie apart, per axis, metres.
const DEFINITION_M: f64 = 0.06;
/// What is held.
const HELD: f64 = 1e12;

/// The costs of what `unknowns` are now.
pub(crate) fn beliefs(
    layout: Layout,
    unknowns: &Unknowns,
    setting: &Setting,
    own_m: f64,
) -> Beliefs {
    let size = layout.shared();
    let mut normal = DMatrix::zeros(size, size);
    let mut gradient = DVector::zeros(size);
    for (sensor, placed) in unknowns.placed.iter().enumerate() {
        for (unknown, value, sigma) in [(6, placed.offset_s, OFFSET_S), (7, placed.drift, DRIFT)] {
            let index = PER_SENSOR * sensor + unknown;
            normal[(index, index)] += sigma.powi(-2);
            gradient[index] -= value * sigma.powi(-2);
        }
    }
    // Inverse of RAY_JOINT^2 I + RAY_COMMON^2 11^T (Sherman-Morrison).
    let first = layout.poses();
    let own = RAY_JOINT_M.powi(-2);
    let ratio = (RAY_COMMON_M / RAY_JOINT_M).powi(2);
    let shared = own * ratio / (1.0 + JOINT_COUNT as f64 * ratio);
    let total: f64 = unknowns.ray_bias.iter().sum();
    for i in 0..JOINT_COUNT {
        for j in 0..JOINT_COUNT {
            normal[(first + i, first + j)] += if i == j { own - shared } else { -shared };
        }
        gradient[first + i] -= own * unknowns.ray_bias[i] - shared * total;
    }
    Beliefs {
        normal,
        gradient,
        own: (0..JOINT_COUNT)
            .map(|joint| of_joint(joint, layout, unknowns, setting, own_m))
            .collect(),
    }
}

/// Information on a joint's own unknowns, and how it pulls.
fn of_joint(
    joint: usize,
    layout: Layout,
    unknowns: &Unknowns,
    setting: &Setting,
    own_m: f64,
) -> (DVector<f64>, DVector<f64>) {
    let size = 3 * (layout.sensors + layout.definitions);
    let mut belief = DVector::zeros(size);
    let mut pull = DVector::zeros(size);
    let mut put = |first: usize, value: &nalgebra::Vector3<f64>, information: f64, held: bool| {
        for axis in 0..3 {
            belief[first + axis] = if held { HELD } else { information };
            pull[first + axis] = if held {
                0.0
            } else {
                -value[axis] * information
            };
        }
    };
    for (sensor, offsets) in unknowns.own.iter().enumerate() {
        put(3 * sensor, &offsets[joint], own_m.powi(-2), false);
    }
    for (set, offsets) in unknowns.definitions.iter().enumerate() {
        let first = 3 * (layout.sensors + set);
        let held = setting.definition_held[set];
        put(first, &offsets[joint], DEFINITION_M.powi(-2), held);
    }
    (belief, pull)
}
