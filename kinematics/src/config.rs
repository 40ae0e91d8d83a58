//! What a [`crate::Solver`] is told: plain data, read from TOML or JSON, every function by itself on or off.
//!
//! Units are in the names (`_deg`, `_mps` for m/s, `_mm`, `_s`). Unknown keys are refused.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Everything a solver can be told. The defaults are what is recommended for fused tracks at 30 Hz.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The fit of the whole body; without it rotations follow from the positions bone by bone.
    pub fit: FitConfig,
    /// What is kept where a limb is straight and its twist unknown.
    pub hold: HoldConfig,
    /// How far joints turn.
    pub limits: LimitsConfig,
    /// Feet that stand still.
    pub feet: FeetConfig,
    /// Where the head looks.
    pub look: LookConfig,
    /// Open and closed hands.
    pub hands: HandsConfig,
    /// Bones that rigs have and trackers say little of.
    pub extra: ExtraConfig,
}

/// Where the fit of a frame begins (both ways are Menard's, 2014).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At the pose of the frame before; at the fused skeleton where that leads nowhere.
    #[default]
    Previous,
    /// At the fused skeleton, bone by bone.
    Skeleton,
}

/// `fit`: damped least squares over all joint angles and the root.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitConfig {
    /// Whether it is done.
    pub enabled: bool,
    /// Where it begins.
    pub start: Start,
    /// Most steps for one frame, 1 to 50.
    pub iterations: usize,
    /// Whether joints far from where the rest of the body has them count less.
    pub robust: bool,
    /// What a fused position is off by besides its covariance, millimetres: 0.1 to 100. Trackers' biases, which no covariance
    /// tells; without it, bodies shake as sensors come and go.
    pub floor_mm: f64,
    /// Over how many seconds the weight of a joint follows its covariance: 0 (at once) to 5. Weights that jump, as sensors
    /// come and go, would make a body jump that does not agree with all joints.
    pub steady_s: f64,
    /// How suddenly joints change their speed, degrees per second squared (one standard deviation); 0: not looked at.
    pub sudden_dps2: f64,
    /// The same of the root, m/s^2.
    pub sudden_mps2: f64,
}

impl Default for FitConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            start: Start::Previous,
            iterations: 6,
            robust: true,
            floor_mm: 15.0,
            steady_s: 0.3,
            sudden_dps2: 8000.0,
            sudden_mps2: 60.0,
        }
    }
}

/// `hold`: the twist of a limb shows in its bend only; straight limbs keep what they had.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HoldConfig {
    /// Whether it is kept.
    pub enabled: bool,
    /// A limb bent by less than this is straight, degrees: 1 to 45. Up to twice that the bend is taken on gradually.
    pub straight_deg: f64,
}

impl Default for HoldConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            straight_deg: 10.0,
        }
    }
}

/// `limits`: anatomical ranges, see `docs/KINEMATICS.md`; soft, because hard ones make jumps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LimitsConfig {
    /// Whether they hold.
    pub enabled: bool,
    /// Going so far beyond one costs as much as a joint that is off by one standard deviation, degrees: 0.05 to 20.
    pub softness_deg: f64,
}

impl Default for LimitsConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            softness_deg: 0.5,
        }
    }
}

/// `feet`: a heel or toes that are slow and low stand, and what stands is kept where it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeetConfig {
    /// Whether feet that stand are kept still (contacts are told anyway).
    pub enabled: bool,
    /// Slower than this a foot begins to stand, m/s.
    pub slow_mps: f64,
    /// Faster than this it stands no more, m/s.
    pub fast_mps: f64,
    /// So far above its height in flat standing it still begins to stand, metres.
    pub low_m: f64,
    /// Higher than that it stands no more, metres.
    pub high_m: f64,
    /// A foot further than this from where it is kept is let go, metres.
    pub leave_m: f64,
    /// Seconds over which a foot is taken hold of.
    pub catch_s: f64,
    /// Seconds over which it is let go.
    pub release_s: f64,
    /// How firmly it is kept, millimetres of standard deviation: 0.1 to 100.
    pub firmness_mm: f64,
}

impl Default for FeetConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            slow_mps: 0.40,
            fast_mps: 0.50,
            low_m: 0.03,
            high_m: 0.05,
            leave_m: 0.055,
            catch_s: 0.15,
            release_s: 0.20,
            firmness_mm: 6.0,
        }
    }
}

/// What a head looks at: its joints tell where it is, not where it turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LookAt {
    /// Ahead, as the chest does.
    #[default]
    Off,
    /// The hands.
    Hands,
    /// A place one step ahead, on the floor.
    Near,
    /// Far ahead.
    Far,
    /// The hands where they are raised in view, near where the person stands, far where they walk.
    Auto,
}

/// `look`: turns the head about itself (its joints stay where they are) towards something, within a neck's range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LookConfig {
    /// What at.
    pub at: LookAt,
    /// After this a turn is all but done (98.5 %), seconds: 0.05 to 10. Critically damped.
    pub settle_s: f64,
    /// How far to either side, degrees: 0 to 90.
    pub side_deg: f64,
    /// Whether the head also nods, which moves its centre: up to this, degrees, 0 to 60.
    pub nod_deg: f64,
}

impl Default for LookConfig {
    fn default() -> Self {
        Self {
            at: LookAt::Off,
            settle_s: 0.8,
            side_deg: 60.0,
            nod_deg: 0.0,
        }
    }
}

/// `hands`: agents' votes become a state that does not flicker, and fingers bend in closed hands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HandsConfig {
    /// Whether hands have a state.
    pub enabled: bool,
    /// How often a vote is right, above 0.5 and below 1. Menard (2014) found 0.668 for single frames of depth.
    pub right_share: f64,
    /// How often a hand opens or closes, per second.
    pub changes_per_s: f64,
    /// Votes of one sensor in successive frames repeat each other: one in so many seconds is news.
    pub news_s: f64,
    /// Closed from this probability on; open from one minus this on.
    pub decide: f64,
    /// How far fingers bend in a closed hand, degrees: 0 (they stay as fitted) to 110.
    pub bend_deg: f64,
    /// How long a hand takes to close or to open, seconds.
    pub settle_s: f64,
}

impl Default for HandsConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            right_share: 0.67,
            changes_per_s: 0.5,
            news_s: 0.1,
            decide: 0.7,
            bend_deg: 80.0,
            settle_s: 0.2,
        }
    }
}

/// `extra`: bones that rigs have and trackers say little of. What is off stays as in the rest pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExtraConfig {
    /// The spine bends in two places; else the chest alone does, above `SpineMid`.
    pub spine: bool,
    /// Shoulders that rise and come forward.
    pub clavicles: bool,
    /// Fingers that bend as one.
    pub fingers: bool,
    /// Toes that stay on the floor while the heel rises.
    pub toes: bool,
}

impl Default for ExtraConfig {
    fn default() -> Self {
        Self {
            spine: true,
            clavicles: true,
            fingers: true,
            toes: true,
        }
    }
}

/// A number that cannot work.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("kinematics.{key}: expected a number from {low} to {high}, found {found}")]
pub struct ConfigError {
    /// The key, with its section.
    pub key: &'static str,
    /// Least.
    pub low: f64,
    /// Most.
    pub high: f64,
    /// What it was.
    pub found: f64,
}

impl Config {
    /// Checks every number.
    ///
    /// # Errors
    /// The first that cannot work.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let (fit, feet, look, hands) = (&self.fit, &self.feet, &self.look, &self.hands);
        let numbers = [
            ("fit.iterations", fit.iterations as f64, 1.0, 50.0),
            ("fit.floor_mm", fit.floor_mm, 0.1, 100.0),
            ("fit.steady_s", fit.steady_s, 0.0, 5.0),
            ("fit.sudden_dps2", fit.sudden_dps2, 0.0, 1e6),
            ("fit.sudden_mps2", fit.sudden_mps2, 0.0, 1e6),
            ("hold.straight_deg", self.hold.straight_deg, 1.0, 45.0),
            ("limits.softness_deg", self.limits.softness_deg, 0.05, 20.0),
            ("feet.slow_mps", feet.slow_mps, 0.01, 5.0),
            ("feet.fast_mps", feet.fast_mps, feet.slow_mps, 5.0),
            ("feet.low_m", feet.low_m, 0.0, 0.5),
            ("feet.high_m", feet.high_m, feet.low_m, 0.5),
            ("feet.leave_m", feet.leave_m, 0.005, 0.5),
            ("feet.catch_s", feet.catch_s, 0.0, 2.0),
            ("feet.release_s", feet.release_s, 0.0, 2.0),
            ("feet.firmness_mm", feet.firmness_mm, 0.1, 100.0),
            ("look.settle_s", look.settle_s, 0.05, 10.0),
            ("look.side_deg", look.side_deg, 0.0, 90.0),
            ("look.nod_deg", look.nod_deg, 0.0, 60.0),
            ("hands.right_share", hands.right_share, 0.501, 0.999),
            ("hands.changes_per_s", hands.changes_per_s, 0.001, 10.0),
            ("hands.news_s", hands.news_s, 0.001, 10.0),
            ("hands.decide", hands.decide, 0.5, 0.999),
            ("hands.bend_deg", hands.bend_deg, 0.0, 110.0),
            ("hands.settle_s", hands.settle_s, 0.01, 5.0),
        ];
        let wrong =
            |(_, found, low, high): &&(&str, f64, f64, f64)| !(*low..=*high).contains(found);
        match numbers.iter().find(wrong) {
            None => Ok(()),
            Some(&(key, found, low, high)) => Err(ConfigError {
                key,
                low,
                high,
                found,
            }),
        }
    }
}
