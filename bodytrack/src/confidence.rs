//! From what the network says of its own uncertainty to a probability that can be relied on.

use posefuse_skeleton::Confidence;

/// How far is right enough, metres.
pub(crate) const RIGHT_M: f32 = 0.10;
/// Logistic regression over rendered people (`posefuse evaluate bodytrack` prints what would put it right): one, the logit
/// of what sigma alone says, whether the joint's surface is seen.
const WEIGHTS: [f32; 3] = [0.69, 0.96, 0.0];
/// Nothing is surer than this.
const SUREST: f32 = 0.995;

/// The probability that a joint is within [`RIGHT_M`] of the truth.
pub(crate) fn confidence(sigma_m: f32, visible: f32) -> Confidence {
    let [one, logit, seen] = WEIGHTS;
    let at = one + logit * said(sigma_m) + seen * visible;
    let share = 1.0 / (1.0 + (-at).exp());
    Confidence::saturating(share.clamp(1.0 - SUREST, SUREST))
}

/// The logit of the probability that an error with this standard deviation along each axis is shorter than [`RIGHT_M`]:
/// Maxwell's distribution.
pub(crate) fn said(sigma_m: f32) -> f32 {
    let x = f64::from(RIGHT_M / sigma_m.max(1e-3));
    let inside = erf(x / std::f64::consts::SQRT_2)
        - (2.0 / std::f64::consts::PI).sqrt() * x * (-x * x / 2.0).exp();
    let inside = inside.clamp(1e-4, 1.0 - 1e-4);
    (inside / (1.0 - inside)).ln() as f32
}

/// The error function, right to 1.5e-7 (Abramowitz and Stegun 7.1.26), for numbers from 0 on.
fn erf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let series = [
        1.061_405_429,
        -1.453_152_027,
        1.421_413_741,
        -0.284_496_736,
        0.254_829_592,
    ];
    let sum = series.iter().fold(0.0, |sum, factor| (sum + factor) * t);
    1.0 - sum * (-x * x).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sigma_says_how_likely_ten_centimetres_are() {
        let share = |sigma: f32| 1.0 / (1.0 + (-said(sigma)).exp());
        // Chi-squared with three degrees of freedom, quantile 0.5: 2.366.
        assert!((share(RIGHT_M / 2.366f32.sqrt()) - 0.5).abs() < 1e-3);
        assert!((share(RIGHT_M / 7.815f32.sqrt()) - 0.95).abs() < 1e-3);
        assert!(confidence(0.02, 1.0) > confidence(0.2, 1.0));
        for strange in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
            let found = confidence(strange, 0.5).get();
            assert!((0.0..=1.0).contains(&found), "{strange}: {found}");
        }
    }
}
