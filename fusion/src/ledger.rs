//! What each sensor contributes, joint by joint, over the last seconds: how much of the result is its word, how often
//! the others overrule it, how far it lies from them.

use posefuse_skeleton::JOINT_COUNT;
use serde::{Deserialize, Serialize};

use crate::fuse::kalman::Part;

/// What was is forgotten with this time constant, seconds.
const MEMORY_S: f64 = 5.0;
/// Fewer joints (frames times joints, forgotten ones counting less) say nothing.
const LEAST: f64 = 0.5;

/// One sensor's part in what was fused over the last seconds, older frames counting less (time constant 5 s).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contribution {
    /// Share of all sensors' weights in all joints, 0..=1.
    pub weight: f64,
    /// Share of the joints it was sure of that consensus all but ignored, 0..=1.
    pub rejected_share: f64,
    /// Mean distance of the joints it was sure of from what the other sensors and the past say, metres; `None` where
    /// it was sure of none.
    pub residual_m: Option<f64>,
    /// The same weight for each joint, in canonical order.
    pub joint_weights: [f32; JOINT_COUNT],
    /// The same share of rejections for each joint.
    pub joint_rejected: [f32; JOINT_COUNT],
    /// The same distance for each joint.
    pub joint_residual_m: [Option<f32>; JOINT_COUNT],
}

/// What one sensor's parts have come to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ledger {
    joints: [Entry; JOINT_COUNT],
}

/// Sums over frames, older ones counting less.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Entry {
    share: f64,
    sure: f64,
    rejected: f64,
    apart_m: f64,
}

impl Ledger {
    /// Lets `elapsed_s` pass.
    pub(crate) fn forget(&mut self, elapsed_s: f64) {
        let kept = (-elapsed_s.max(0.0) / MEMORY_S).exp();
        for entry in &mut self.joints {
            for sum in [
                &mut entry.share,
                &mut entry.sure,
                &mut entry.rejected,
                &mut entry.apart_m,
            ] {
                *sum *= kept;
            }
        }
    }

    /// Adds the part it had in one joint of one frame.
    pub(crate) fn add(&mut self, part: &Part) {
        let entry = &mut self.joints[part.joint];
        entry.share += part.share;
        if let (Some(rejected), Some(apart_m)) = (part.rejected, part.apart_m) {
            entry.sure += 1.0;
            entry.rejected += f64::from(u8::from(rejected));
            entry.apart_m += apart_m;
        }
    }

    /// The sums as they are shown, beside those of all sensors (`all`, this one's included); `None` while nothing was
    /// fused.
    pub(crate) fn contribution<'a>(
        &self,
        all: impl Iterator<Item = &'a Self>,
    ) -> Option<Contribution> {
        let mut shares = [0.0; JOINT_COUNT];
        for ledger in all {
            for (sum, entry) in shares.iter_mut().zip(&ledger.joints) {
                *sum += entry.share;
            }
        }
        let total: f64 = shares.iter().sum();
        if total < LEAST {
            return None;
        }
        let sum = |of: fn(&Entry) -> f64| self.joints.iter().map(of).sum::<f64>();
        let (sure, rejected) = (sum(|e| e.sure), sum(|e| e.rejected));
        let ratio = |part: f64, of: f64| if of > 0.0 { part / of } else { 0.0 };
        let mean = |entry: &Entry| (entry.sure > 0.0).then(|| (entry.apart_m / entry.sure) as f32);
        Some(Contribution {
            weight: ratio(sum(|e| e.share), total),
            rejected_share: ratio(rejected, sure),
            residual_m: (sure > 0.0).then(|| sum(|e| e.apart_m) / sure),
            joint_weights: std::array::from_fn(|i| ratio(self.joints[i].share, shares[i]) as f32),
            joint_rejected: self.joints.map(|e| ratio(e.rejected, e.sure) as f32),
            joint_residual_m: self.joints.map(|e| mean(&e)),
        })
    }
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::SensorId;

    use super::*;

    fn part(joint: usize, share: f64, rejected: bool) -> Part {
        Part {
            sensor: SensorId::new(0).unwrap(),
            joint,
            share,
            rejected: Some(rejected),
            apart_m: Some(if rejected { 0.2 } else { 0.01 }),
        }
    }

    #[test]
    fn weights_of_all_sensors_make_one_and_rejections_are_forgotten() {
        let (mut good, mut bad) = (Ledger::default(), Ledger::default());
        for frame in 0..300 {
            for ledger in [&mut good, &mut bad] {
                ledger.forget(1.0 / 30.0);
            }
            good.add(&part(3, 0.9, false));
            bad.add(&part(3, 0.1, frame < 150));
        }
        let both = || [&good, &bad].into_iter();
        let (good, bad) = (
            good.contribution(both()).unwrap(),
            bad.contribution(both()).unwrap(),
        );
        assert!((good.weight + bad.weight - 1.0).abs() < 1e-9);
        assert!((good.joint_weights[3] - 0.9).abs() < 1e-6);
        assert_eq!(good.rejected_share, 0.0);
        assert!((0.2..0.4).contains(&bad.rejected_share), "{bad:?}");
        assert!(bad.residual_m > good.residual_m);
        assert_eq!(good.joint_residual_m[4], None);
        assert!(Ledger::default().contribution([].into_iter()).is_none());
    }
}
