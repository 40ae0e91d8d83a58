//! A pose as anatomical angles, for people who read degrees.

use crate::bones::{ARMS, BONES, CHEST, LEGS, SPINE};
use crate::posture::{Posture, TURNS, Turn};
use crate::range::{cone, ranges, twist};

/// One angle of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angle {
    /// The bone that turns, e.g. `LeftLowerArm`.
    pub bone: &'static str,
    /// In which sense positive is, e.g. `bend`. 0 is the T-pose; `swing` is the angle from the middle of the joint's cone.
    pub turn: &'static str,
    /// How far.
    pub degrees: f64,
    /// The anatomical range, degrees.
    pub low: f64,
    /// See `low`.
    pub high: f64,
}

/// What the turns about a bone's hinges are called, in their order.
fn names(bone: usize) -> &'static [&'static str] {
    let is = |of: fn(&crate::bones::ArmBones) -> usize| ARMS.iter().any(|arm| of(arm) == bone);
    if bone == SPINE || bone == CHEST {
        &["turn left", "bend forwards", "lean right"]
    } else if is(|arm| arm.clavicle) {
        &["forwards", "up"]
    } else if is(|arm| arm.lower) {
        &["bend", "turn"]
    } else if is(|arm| arm.hand) {
        &["to the palm", "to the thumb"]
    } else if is(|arm| arm.fingers) || LEGS.iter().any(|leg| leg.lower == bone) {
        &["bend"]
    } else if LEGS.iter().any(|leg| leg.foot == bone) {
        &["toes outwards", "toes down"]
    } else if LEGS.iter().any(|leg| leg.toes == bone) {
        &["down"]
    } else {
        &["bend forwards", "lean right"]
    }
}

/// All angles of a posture, but the root's.
pub(crate) fn angles(posture: &Posture) -> Vec<Angle> {
    let mut all = Vec::new();
    for (bone, turned) in TURNS.iter().enumerate() {
        let mut push = |turn, radians: f64, low, high| {
            all.push(Angle {
                bone: BONES[bone].name,
                turn,
                degrees: radians.to_degrees(),
                low,
                high,
            });
        };
        match turned {
            Turn::Fixed => {}
            Turn::Hinges(_) => {
                let named = names(bone).iter().zip(ranges(bone));
                for ((turn, range), angle) in named.zip(posture.angles[bone]) {
                    push(turn, angle, range.low, range.high);
                }
            }
            Turn::Ball => {
                if let Some(cone) = cone(bone) {
                    let rotation = &posture.balls[bone];
                    let swing = (rotation * cone.along).angle(&cone.centre);
                    push("swing", swing, 0.0, cone.reach);
                    let (about, _) = twist(rotation, &cone.along);
                    push("twist", about, cone.twist.low, cone.twist.high);
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hinge_has_a_name() {
        for (bone, named) in BONES.iter().enumerate() {
            assert!(
                ranges(bone).is_empty() || names(bone).len() == ranges(bone).len(),
                "{}",
                named.name
            );
        }
    }
}
