//! What the fit knows besides positions: anatomical ranges, what is usual, and the frame before.

use nalgebra::Vector3;

use super::freedom::{Freedoms, NONE};
use super::normal::Normal;
use crate::bones::HIPS;
use crate::config::Config;
use crate::posture::{Posture, TURNS, Turn};
use crate::range::{Cone, Range, beyond, cone, ranges, twist};

/// The root strays by this in a second where nothing is seen, metres and degrees.
const ROOT_STRAY_M: f64 = 3.0;
const ROOT_STRAY_DEG: f64 = 200.0;
/// Twist that nothing is kept of strays by this in a second, degrees.
const FREE_STRAY_DEG: f64 = 400.0;
/// A twist further from the frame before than so many standard deviations was turned over on purpose (Cauchy's weight).
const TURNED_OVER: f64 = 3.0;

/// Of one hinge; radians, and weights in 1/rad^2.
#[derive(Clone, Copy, Debug)]
struct HingePrior {
    freedom: usize,
    bone: usize,
    index: usize,
    low: f64,
    high: f64,
    usual: f64,
    usual_weight: f64,
    /// Times the seconds that passed this is one over the weight of the frame before.
    stray_squared: f64,
}

#[derive(Clone, Copy, Debug)]
struct BallPrior {
    freedom: usize,
    bone: usize,
    cone: Option<Cone>,
    /// The same across the bone's direction and about it.
    stray_squared: f64,
    twist_stray_squared: f64,
}

/// All of it for one body.
#[derive(Clone, Debug)]
pub(super) struct Priors {
    hinges: Vec<HingePrior>,
    balls: Vec<BallPrior>,
    /// 1/rad^2; 0 where limits are off.
    limit_weight: f64,
    /// Of joints, rad/s^2, and of the root, m/s^2; 0: not looked at.
    sudden: [f64; 2],
}

/// What is known of the frame before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Before<'a> {
    pub(crate) last: &'a Posture,
    /// Seconds since.
    pub(crate) elapsed: f64,
    /// Where the body would be now if it went on as it did.
    pub(crate) expected: Option<&'a Posture>,
}

/// A residual, its weight, and its derivative by the freedoms of a ball.
struct BallTerm {
    residual: f64,
    weight: f64,
    derivative: Vector3<f64>,
    /// What it adds to the cost.
    cost: f64,
}

impl Priors {
    pub(super) fn new(freedoms: &Freedoms, config: &Config) -> Self {
        let limit_weight = if config.limits.enabled {
            config.limits.softness_deg.to_radians().powi(-2)
        } else {
            0.0
        };
        let mut priors = Self {
            hinges: Vec::new(),
            balls: Vec::new(),
            limit_weight,
            sudden: [config.fit.sudden_dps2.to_radians(), config.fit.sudden_mps2],
        };
        for (bone, turn) in TURNS.iter().enumerate() {
            let freedom = freedoms.first[bone];
            match turn {
                Turn::Hinges(_) if freedom != NONE => {
                    let hinges = ranges(bone).iter().enumerate();
                    priors.hinges.extend(
                        hinges.map(|(index, range)| hinge(freedom + index, bone, index, range)),
                    );
                }
                Turn::Ball => priors.balls.push(ball(freedom, bone, config.hold.enabled)),
                _ => {}
            }
        }
        priors
    }

    /// Where joints are expected, and how firmly, 1/rad^2.
    fn sudden<'a>(&self, before: Before<'a>) -> Option<(&'a Posture, f64)> {
        weighted(before, self.sudden[0])
    }

    /// The same of the root, 1/m^2.
    fn root_sudden<'a>(&self, before: Before<'a>) -> Option<(&'a Posture, f64)> {
        weighted(before, self.sudden[1])
    }

    /// What the priors add to the cost.
    pub(super) fn cost(&self, posture: &Posture, last: Option<Before>) -> f64 {
        let mut cost = 0.0;
        for hinge in &self.hinges {
            let angle = posture.angles[hinge.bone][hinge.index];
            let over = excess(angle, hinge.low, hinge.high);
            cost += 0.5 * self.limit_weight * over * over;
            cost += 0.5 * hinge.usual_weight * (angle - hinge.usual).powi(2);
            if let Some(before) = last {
                let moved = angle - before.last.angles[hinge.bone][hinge.index];
                cost += 0.5 * moved * moved / (hinge.stray_squared * before.elapsed);
                if let Some((expected, weight)) = self.sudden(before) {
                    let off = angle - expected.angles[hinge.bone][hinge.index];
                    cost += 0.5 * off * off * weight;
                }
            }
        }
        for ball in &self.balls {
            self.ball_terms(ball, posture, last, &mut |term| cost += term.cost);
        }
        if let Some(before) = last {
            let moved = posture.root - before.last.root;
            cost += 0.5 * moved.norm_squared() * root_weight(before.elapsed);
            if let Some((expected, weight)) = self.root_sudden(before) {
                cost += 0.5 * (posture.root - expected.root).norm_squared() * weight;
            }
        }
        cost
    }

    /// Adds them to the normal equations.
    pub(super) fn add(&self, normal: &mut Normal, posture: &Posture, last: Option<Before>) {
        for hinge in &self.hinges {
            let angle = posture.angles[hinge.bone][hinge.index];
            let over = excess(angle, hinge.low, hinge.high);
            if over != 0.0 {
                normal.add_single(hinge.freedom, over, self.limit_weight);
            }
            if hinge.usual_weight > 0.0 {
                normal.add_single(hinge.freedom, angle - hinge.usual, hinge.usual_weight);
            }
            if let Some(before) = last {
                let moved = angle - before.last.angles[hinge.bone][hinge.index];
                let weight = 1.0 / (hinge.stray_squared * before.elapsed);
                normal.add_single(hinge.freedom, moved, weight);
                if let Some((expected, weight)) = self.sudden(before) {
                    let off = angle - expected.angles[hinge.bone][hinge.index];
                    normal.add_single(hinge.freedom, off, weight);
                }
            }
        }
        for ball in &self.balls {
            self.ball_terms(ball, posture, last, &mut |term| {
                normal.add_ball(ball.freedom, &term.derivative, term.residual, term.weight);
            });
        }
        if let Some(before) = last {
            let moved = posture.root - before.last.root;
            for axis in 0..3 {
                normal.add_single(axis, moved[axis], root_weight(before.elapsed));
            }
            if let Some((expected, weight)) = self.root_sudden(before) {
                let off = posture.root - expected.root;
                for axis in 0..3 {
                    normal.add_single(axis, off[axis], weight);
                }
            }
        }
    }

    fn ball_terms(
        &self,
        ball: &BallPrior,
        posture: &Posture,
        last: Option<Before>,
        each: &mut dyn FnMut(BallTerm),
    ) {
        let rotation = &posture.balls[ball.bone];
        let mut square = |residual: f64, weight: f64, derivative: Vector3<f64>| {
            each(BallTerm {
                residual,
                weight,
                derivative,
                cost: 0.5 * weight * residual * residual,
            });
        };
        if let Some(cone) = &ball.cone {
            if self.limit_weight > 0.0
                && let Some((angle, derivative)) = beyond(rotation, cone)
            {
                square(angle, self.limit_weight, derivative);
            }
            let (angle, derivative) = twist(rotation, &cone.along);
            let (low, high) = (cone.twist.low.to_radians(), cone.twist.high.to_radians());
            let over = excess(angle, low, high);
            if over != 0.0 && self.limit_weight > 0.0 {
                square(over, self.limit_weight, derivative);
            }
            let usual = angle - cone.twist.usual.to_radians();
            square(usual, cone.twist.spread.to_radians().powi(-2), derivative);
        }
        let Some(before) = last else {
            return;
        };
        if let Some((expected, weight)) = self.sudden(before) {
            let off = (expected.balls[ball.bone].inverse() * rotation).scaled_axis();
            for axis in 0..3 {
                square(off[axis], weight, Vector3::ith(axis, 1.0));
            }
        }
        let (last, elapsed) = (before.last, before.elapsed);
        let moved = (last.balls[ball.bone].inverse() * rotation).scaled_axis();
        let along = ball.cone.map_or(Vector3::zeros(), |cone| cone.along);
        let weight = 1.0 / (ball.stray_squared * elapsed);
        for axis in 0..3 {
            // The bone's own direction is one of its axes.
            let across = Vector3::ith(axis, 1.0 - along[axis].abs());
            if across[axis] > 0.0 {
                square(moved[axis], weight, across);
            }
        }
        if along != Vector3::zeros() {
            let turned = moved.dot(&along);
            let weight = 1.0 / (ball.twist_stray_squared * elapsed);
            let allowed = TURNED_OVER * TURNED_OVER;
            let squared = weight * turned * turned;
            each(BallTerm {
                residual: turned,
                weight: weight / (1.0 + squared / allowed),
                derivative: along,
                cost: 0.5 * allowed * (squared / allowed).ln_1p(),
            });
        }
    }
}

fn hinge(freedom: usize, bone: usize, index: usize, range: &Range) -> HingePrior {
    HingePrior {
        freedom,
        bone,
        index,
        low: range.low.to_radians(),
        high: range.high.to_radians(),
        usual: range.usual.to_radians(),
        usual_weight: range.spread.to_radians().powi(-2),
        stray_squared: range.stray.to_radians().powi(2),
    }
}

fn ball(freedom: usize, bone: usize, hold: bool) -> BallPrior {
    let cone = cone(bone);
    let stray = cone.map_or(ROOT_STRAY_DEG, |cone| cone.stray);
    let twist = match cone {
        Some(cone) if hold => cone.twist.stray,
        Some(_) => FREE_STRAY_DEG,
        None => ROOT_STRAY_DEG,
    };
    debug_assert!(cone.is_some() || bone == HIPS);
    BallPrior {
        freedom,
        bone,
        cone,
        stray_squared: stray.to_radians().powi(2),
        twist_stray_squared: twist.to_radians().powi(2),
    }
}

fn weighted(before: Before<'_>, sudden: f64) -> Option<(&Posture, f64)> {
    let expected = before.expected.filter(|_| sudden > 0.0)?;
    Some((
        expected,
        (sudden * before.elapsed * before.elapsed).powi(-2),
    ))
}

fn root_weight(elapsed: f64) -> f64 {
    1.0 / (ROOT_STRAY_M * ROOT_STRAY_M * elapsed)
}

/// How far beyond the range, signed; 0 within.
fn excess(angle: f64, low: f64, high: f64) -> f64 {
    if angle < low {
        angle - low
    } else if angle > high {
        angle - high
    } else {
        0.0
    }
}
