//! Whether hands are open or closed: a network of its own on crops of the hands.

use posefuse_models::{Network, NetworkFile, Refused, RunError};
use posefuse_skeleton::{ARMS, DepthImage, Intrinsics, Position};

use crate::TrackerConfig;
use crate::estimate::Estimate;
use crate::hand::{Arm, CHANNELS, SIZE, cut};

/// The network that is part of the program.
const MANIFEST: &str = include_str!("../data/depth-hands.toml");
const ONNX: &[u8] = include_bytes!("../data/depth-hands.onnx");
/// What the network is told of a hand beside its crop.
const KNOWN: usize = 3;
/// A hand is looked at if its surface is seen with this probability.
const SEEN: f32 = 0.3;
/// A probability nearer to one half than this is no word at all.
const TELLS: f32 = 0.2;
/// Over time the logits' mean counts, of about so long, seconds; after a pause longer than the other it begins anew.
const MEAN_S: f32 = 0.1;
const PAUSE_S: f32 = 0.5;
/// Nothing is surer than this logit.
const SUREST: f32 = 5.0;

/// The network with its memory.
pub(crate) struct Grips {
    network: Network,
    hands: Vec<f32>,
    known: Vec<f32>,
    /// Whose hand each is, and which.
    whose: Vec<(usize, usize)>,
}

/// What is believed of one hand over time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Belief {
    logit: f32,
    last_ns: Option<i64>,
}

impl Grips {
    pub(crate) fn open(config: &TrackerConfig) -> Result<Self, Refused> {
        let file = NetworkFile::from_parts(MANIFEST, "depth-hands.toml (in the program)", ONNX)?;
        Ok(Self {
            network: Network::open(&file, &config.models)?,
            hands: Vec::new(),
            known: Vec::new(),
            whose: Vec::new(),
        })
    }

    /// Cuts the hands of person `number` out for the next run. `image` and `camera`: as the sensor gives them.
    pub(crate) fn look(
        &mut self,
        image: &DepthImage,
        camera: &Intrinsics,
        number: usize,
        found: &Estimate,
    ) {
        for (side, [_, elbow, wrist, hand, ..]) in ARMS.into_iter().enumerate() {
            let (seen, sigma_m) = (found.visible[hand as usize], found.sigma_m[hand as usize]);
            if seen < SEEN {
                continue;
            }
            let place = |joint| Position::from_vector(found.joints[joint as usize].cast());
            let arm = Arm {
                joints: [elbow, wrist, hand].map(place),
                is_left: side == 0,
            };
            if let Some(cut) = cut(image, camera, &arm, &mut self.hands) {
                self.known.extend([cut.sharp.ln(), seen, sigma_m.ln()]);
                self.whose.push((number, side));
            }
        }
    }

    /// The logit of being closed of each hand that was cut out since the last run: whose it is, which, what.
    ///
    /// # Errors
    /// The runtime fails.
    pub(crate) fn run(&mut self) -> Result<Vec<(usize, usize, f32)>, RunError> {
        let whose = std::mem::take(&mut self.whose);
        debug_assert_eq!(self.hands.len(), whose.len() * CHANNELS * SIZE * SIZE);
        debug_assert_eq!(self.known.len(), whose.len() * KNOWN);
        for (name, values) in [("hand", &mut self.hands), ("known", &mut self.known)] {
            if let Some(input) = self.network.input(name) {
                std::mem::swap(input, values);
            }
            values.clear();
        }
        if whose.is_empty() {
            return Ok(Vec::new());
        }
        self.network.run(whose.len())?;
        let closed = self.network.output("closed");
        let logit = |p: &f32| {
            let p = p.clamp(1e-4, 1.0 - 1e-4);
            (p / (1.0 - p)).ln().clamp(-SUREST, SUREST)
        };
        Ok(whose
            .iter()
            .zip(closed)
            .map(|(&(number, side), p)| (number, side, logit(p)))
            .collect())
    }
}

impl Belief {
    /// Takes in what an image says.
    pub(crate) fn take(&mut self, logit: f32, at_ns: i64) {
        let since_s = self.last_ns.map(|last| (at_ns - last) as f32 * 1e-9);
        let share = match since_s {
            Some(since_s) if since_s < PAUSE_S => 1.0 - (-since_s.max(0.0) / MEAN_S).exp(),
            _ => 1.0,
        };
        self.logit += share * (logit - self.logit);
        self.last_ns = Some(at_ns);
    }

    /// The probability that the hand is closed in the image of `at_ns`, if that one says something.
    pub(crate) fn closed(&self, at_ns: i64) -> Option<f64> {
        let closed = 1.0 / (1.0 + (-self.logit).exp());
        let tells = self.last_ns == Some(at_ns) && (closed - 0.5).abs() > TELLS;
        tells.then_some(f64::from(closed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_NS: i64 = 33_333_333;

    #[test]
    fn one_odd_image_changes_no_mind_a_lasting_change_does_and_what_is_not_seen_is_not_told() {
        let mut belief = Belief::default();
        assert_eq!(belief.closed(0), None);
        (0..10).for_each(|image| belief.take(2.5, image * STEP_NS));
        assert!(belief.closed(9 * STEP_NS).unwrap() > 0.9);
        belief.take(-2.5, 10 * STEP_NS);
        assert!(belief.closed(10 * STEP_NS).is_some_and(|p| p > 0.5));
        (11..18).for_each(|image| belief.take(-2.5, image * STEP_NS));
        assert!(belief.closed(17 * STEP_NS).unwrap() < 0.2);
        assert_eq!(belief.closed(18 * STEP_NS), None, "not seen in this image");
        belief.take(3.0, 60 * STEP_NS);
        assert!(belief.closed(60 * STEP_NS).unwrap() > 0.9, "begun anew");
    }
}
