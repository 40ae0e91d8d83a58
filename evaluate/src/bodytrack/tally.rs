//! What tracked bodies are worth against the truth, counted.

use nalgebra::Vector3;
use posefuse_bodytrack::TrackedBody;
use posefuse_skeleton::{Joint, JointMap, Position, SIDE_PAIRS, Sensor};
use serde::Serialize;

use super::hands::HandKind;

/// A joint nearer to the truth than this is right, metres.
pub(super) const RIGHT_M: f64 = 0.10;
/// Steps of confidence.
const STEPS: usize = 20;

/// Distances of joints from the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distances {
    /// How many joints.
    pub joints: u64,
    /// Their sum, metres.
    pub sum_m: f64,
    /// How many are right: within `RIGHT_M`.
    pub right: u64,
}

impl Distances {
    pub(super) fn add(&mut self, distance_m: f64) {
        self.joints += 1;
        self.sum_m += distance_m;
        self.right += u64::from(distance_m < RIGHT_M);
    }

    fn merge(&mut self, other: &Self) {
        self.joints += other.joints;
        self.sum_m += other.sum_m;
        self.right += other.right;
    }

    /// Mean distance, mm.
    pub fn mean_mm(&self) -> Option<f64> {
        (self.joints > 0).then(|| 1e3 * self.sum_m / self.joints as f64)
    }

    /// The share that is right.
    pub fn right_share(&self) -> Option<f64> {
        (self.joints > 0).then(|| self.right as f64 / self.joints as f64)
    }
}

/// Bodies of one kind: facing one way, that far away, that many together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Kind {
    /// Joints whose surface the sensor sees.
    pub visible: Distances,
    /// Joints in the image whose surface it does not see.
    pub hidden: Distances,
    /// Images of people with enough to be seen of them.
    pub people: u64,
    /// Those of them that had a body.
    pub found: u64,
    /// Bodies with left and right the right way round.
    pub sides_right: u64,
    /// Their hands, open or closed.
    pub hands: HandKind,
}

impl Kind {
    /// All joints in the image.
    pub fn all(&self) -> Distances {
        let mut all = self.visible;
        all.merge(&self.hidden);
        all
    }

    /// The share of people with a body.
    pub fn found_share(&self) -> Option<f64> {
        (self.people > 0).then(|| self.found as f64 / self.people as f64)
    }

    /// The share of bodies with left and right the right way round.
    pub fn sides_share(&self) -> Option<f64> {
        (self.found > 0).then(|| self.sides_right as f64 / self.found as f64)
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.visible.merge(&other.visible);
        self.hidden.merge(&other.hidden);
        self.people += other.people;
        self.found += other.found;
        self.sides_right += other.sides_right;
        self.hands.merge(&other.hands);
    }
}

/// Joints by what the tracker said of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Said {
    /// How many.
    pub joints: u64,
    /// The sum of their confidences.
    pub confidence: f64,
    /// How many were right.
    pub right: u64,
}

/// How reliable confidences are: joints in equal steps of confidence from 0 to 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reliability(pub Vec<Said>);

impl Default for Reliability {
    fn default() -> Self {
        Self(vec![Said::default(); STEPS])
    }
}

impl Reliability {
    pub(super) fn add(&mut self, confidence: f64, right: bool) {
        let step = ((confidence * STEPS as f64) as usize).min(STEPS - 1);
        let said = &mut self.0[step];
        said.joints += 1;
        said.confidence += confidence;
        said.right += u64::from(right);
    }

    pub(super) fn merge(&mut self, other: &Self) {
        for (said, other) in self.0.iter_mut().zip(&other.0) {
            said.joints += other.joints;
            said.confidence += other.confidence;
            said.right += other.right;
        }
    }

    /// Mean gap between what was said and what was right, over all joints (expected calibration error).
    pub fn gap(&self) -> Option<f64> {
        let joints: u64 = self.0.iter().map(|said| said.joints).sum();
        let gaps = self
            .0
            .iter()
            .map(|said| (said.confidence - said.right as f64).abs());
        (joints > 0).then(|| gaps.sum::<f64>() / joints as f64)
    }

    /// Intercept and slope that would make the logits of the confidences right: 0 and 1 where nothing is to be done. Newton's
    /// method on the steps.
    pub fn correction(&self) -> Option<[f64; 2]> {
        let steps: Vec<(f64, f64, f64)> = self
            .0
            .iter()
            .filter(|said| said.joints > 0)
            .map(|said| {
                let mean = (said.confidence / said.joints as f64).clamp(1e-4, 1.0 - 1e-4);
                let logit = (mean / (1.0 - mean)).ln();
                (logit, said.joints as f64, said.right as f64)
            })
            .collect();
        if steps.len() < 2 {
            return None;
        }
        let [mut a, mut b] = [0.0f64, 1.0];
        for _ in 0..30 {
            let mut gradient = [0.0; 2];
            let mut hessian = [1e-6, 0.0, 1e-6];
            for &(x, n, right) in &steps {
                let p = 1.0 / (1.0 + (-(a + b * x)).exp());
                let (miss, weight) = (right - n * p, n * p * (1.0 - p));
                gradient = [gradient[0] + miss, gradient[1] + miss * x];
                hessian = [
                    hessian[0] + weight,
                    hessian[1] + weight * x,
                    hessian[2] + weight * x * x,
                ];
            }
            let determinant = hessian[0] * hessian[2] - hessian[1] * hessian[1];
            a += (hessian[2] * gradient[0] - hessian[1] * gradient[1]) / determinant;
            b += (hessian[0] * gradient[1] - hessian[1] * gradient[0]) / determinant;
        }
        (a.is_finite() && b.is_finite()).then_some([a, b])
    }
}

/// Joints of a person in the sensor's frame.
pub(super) type Pose = JointMap<Position<Sensor>>;

/// The middle of the trunk.
pub(super) fn torso(position: impl Fn(Joint) -> Option<Position<Sensor>>) -> Option<Vector3<f64>> {
    let found: Vec<Vector3<f64>> = Joint::TORSO
        .into_iter()
        .filter_map(|joint| Some(position(joint)?.vector()))
        .collect();
    (!found.is_empty()).then(|| found.iter().sum::<Vector3<f64>>() / found.len() as f64)
}

/// Whether left and right are the right way round: the joints are nearer to the truth as named than exchanged.
pub(super) fn sides_are_right(body: &TrackedBody, truth: &Pose) -> bool {
    let (mut named, mut exchanged) = (0.0, 0.0);
    for (left, right) in SIDE_PAIRS {
        let found = [left, right].map(|joint| body.joints[joint].map(|(at, _)| at));
        if let ([Some(l), Some(r)], Some(tl), Some(tr)) = (found, truth[left], truth[right]) {
            named += l.distance(tl) + r.distance(tr);
            exchanged += l.distance(tr) + r.distance(tl);
        }
    }
    named <= exchanged
}

/// Cosine between a person's heading and the way to the sensor, level by the truth's own upright.
pub(super) fn towards_sensor(truth: &Pose, up: &Vector3<f64>) -> Option<f64> {
    use Joint::{HipLeft, HipRight, ShoulderLeft, ShoulderRight};
    let at = |joint: Joint| Some(truth[joint]?.vector());
    let left = at(ShoulderLeft)? - at(ShoulderRight)? + at(HipLeft)? - at(HipRight)?;
    let ahead = left.cross(up).try_normalize(1e-6)?;
    let away = torso(|joint| truth[joint])?;
    let away = (away - up * up.dot(&away)).try_normalize(1e-6)?;
    Some(-ahead.dot(&away))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confidences_that_say_too_much_have_a_gap_and_a_correction() {
        let mut fair = Reliability::default();
        let mut bold = Reliability::default();
        for step in 0..STEPS {
            let share = (step as f64 + 0.5) / STEPS as f64;
            for joint in 0..1000 {
                let right = f64::from(joint) < share * 1000.0;
                fair.add(share, right);
                let logit = (share / (1.0 - share)).ln();
                bold.add(1.0 / (1.0 + (-(logit + 1.0)).exp()), right);
            }
        }
        assert!(fair.gap().unwrap() < 0.01);
        assert!(bold.gap().unwrap() > 0.1);
        let [a, b] = bold.correction().unwrap();
        assert!((a + 1.0).abs() < 0.15 && (b - 1.0).abs() < 0.15, "{a} {b}");
        assert_eq!(Reliability::default().gap(), None);
    }
}
