//! How far joints turn, how fast what is hardly seen may change, and what is usual where nothing is seen.
//!
//! Ranges, degrees, in the sense of [`crate::posture`] (0 is the T-pose). Sources: the ranges of motion of the American
//! Academy of Orthopaedic Surgeons (*Joint Motion*, 1965; a healthy adult), the `limits` of CMU's Acclaim skeletons, and
//! where both are narrower than what people did in recorded motion (`examples/ranges.rs`), those. A trunk of many
//! vertebrae is two joints here, so theirs are sums. `docs/KINEMATICS.md` has the table.

use nalgebra::{UnitQuaternion, Vector3};

use crate::bones::{ARMS, CHEST, HEAD, LEGS, NECK, SIDES, SPINE};
use crate::posture::{Posture, TURNS, Turn};

/// What is known beforehand of the turn about one hinge, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Usual, and how much people differ from it (one standard deviation; infinite where nothing is usual).
    pub(crate) usual: f64,
    pub(crate) spread: f64,
    /// How far it strays in a second (one standard deviation, growing with the root of time).
    pub(crate) stray: f64,
}

/// What is known beforehand of a joint that turns freely: a cone for the bone's direction, a range for its twist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cone {
    /// The bone's rest direction in its own axes: what it twists about.
    pub(crate) along: Vector3<f64>,
    /// The cone's middle, in the parent's axes.
    pub(crate) centre: Vector3<f64>,
    /// Furthest from that, degrees.
    pub(crate) reach: f64,
    /// The twist that is left when the shortest swing from the rest direction is taken off.
    pub(crate) twist: Range,
    /// How far the bone's direction strays in a second, degrees.
    pub(crate) stray: f64,
}

const fn range(low: f64, high: f64, usual: f64, spread: f64, stray: f64) -> Range {
    Range {
        low,
        high,
        usual,
        spread,
        stray,
    }
}

const ANY: f64 = f64::INFINITY;
/// Nothing beyond what is usual for joints that are seen well: they may go where they are seen within a frame.
const QUICK: f64 = 200.0;

/// Turn left, bend forwards, lean right. AAOS for the whole trunk: 45, 80 (back 25), 35. Where trackers put `SpineMid` the
/// spine is not straight at rest: recorded motion needs more backwards and forwards.
const LOWER_SPINE: [Range; 3] = [
    range(-25.0, 25.0, 0.0, 10.0, QUICK),
    range(-50.0, 60.0, 0.0, 12.0, QUICK),
    range(-30.0, 30.0, 0.0, 10.0, QUICK),
];
const UPPER_SPINE: [Range; 3] = [
    range(-40.0, 40.0, 0.0, 15.0, QUICK),
    range(-65.0, 60.0, 0.0, 20.0, QUICK),
    range(-35.0, 35.0, 0.0, 15.0, QUICK),
];
/// Forwards, to the right. AAOS: 45 each way; neck and head share it.
const NECK_RANGE: [Range; 2] = [
    range(-40.0, 55.0, 10.0, 20.0, QUICK),
    range(-40.0, 40.0, 0.0, 15.0, QUICK),
];
const HEAD_RANGE: [Range; 2] = [
    range(-50.0, 50.0, 0.0, 25.0, QUICK),
    range(-40.0, 40.0, 0.0, 20.0, QUICK),
];
/// Forwards, up. Ludewig et al., "Motion of the shoulder complex" (2009): about 30 of retraction and of elevation.
const CLAVICLE: [Range; 2] = [
    range(-25.0, 30.0, 0.0, 8.0, 60.0),
    range(-15.0, 45.0, 0.0, 8.0, 60.0),
];
/// Bend (AAOS 0 to 150), turn of the forearm (80 either way).
const LOWER_ARM: [Range; 2] = [
    range(-3.0, 162.0, 30.0, ANY, QUICK),
    range(-95.0, 110.0, 0.0, 50.0, 60.0),
];
/// Towards the palm (AAOS 80, back 70), towards the thumb (20, away 30).
const HAND: [Range; 2] = [
    range(-75.0, 85.0, 0.0, 30.0, 120.0),
    range(-40.0, 30.0, 0.0, 15.0, 120.0),
];
const FINGERS: [Range; 1] = [range(-20.0, 110.0, 10.0, 40.0, 120.0)];
/// AAOS 0 to 135.
const LOWER_LEG: [Range; 1] = [range(-3.0, 168.0, 10.0, ANY, QUICK)];
/// Toes outwards with the shank's own turn, toes down (AAOS 50, up 20; on bent knees more).
const FOOT: [Range; 2] = [
    range(-35.0, 45.0, 5.0, 20.0, 100.0),
    range(-45.0, 60.0, 0.0, 30.0, 150.0),
];
const TOES: [Range; 1] = [range(-60.0, 30.0, 0.0, ANY, QUICK)];

/// The ranges of a bone's hinges, in their order; none for bones without.
pub(crate) fn ranges(bone: usize) -> &'static [Range] {
    let arm = |arm: &crate::bones::ArmBones| -> &'static [Range] {
        match bone {
            _ if bone == arm.clavicle => &CLAVICLE,
            _ if bone == arm.lower => &LOWER_ARM,
            _ if bone == arm.hand => &HAND,
            _ if bone == arm.fingers => &FINGERS,
            _ => &[],
        }
    };
    let leg = |leg: &crate::bones::LegBones| -> &'static [Range] {
        match bone {
            _ if bone == leg.lower => &LOWER_LEG,
            _ if bone == leg.foot => &FOOT,
            _ if bone == leg.toes => &TOES,
            _ => &[],
        }
    };
    match bone {
        SPINE => &LOWER_SPINE,
        CHEST => &UPPER_SPINE,
        NECK => &NECK_RANGE,
        HEAD => &HEAD_RANGE,
        _ if bone < LEGS[0].upper => ARMS.iter().map(arm).find(|r| !r.is_empty()).unwrap_or(&[]),
        _ => LEGS.iter().map(leg).find(|r| !r.is_empty()).unwrap_or(&[]),
    }
}

/// The cone of an upper arm or leg; `None` for every other bone.
pub(crate) fn cone(bone: usize) -> Option<Cone> {
    (0..2).find_map(|side| {
        let out = SIDES[side];
        if bone == ARMS[side].upper {
            // AAOS: 180 forwards and outwards, 60 back, 45 across the chest; 70 and 90 about itself.
            return Some(Cone {
                along: Vector3::y() * out,
                centre: Vector3::new(0.6, 0.75 * out, -0.25).normalize(),
                reach: 122.0,
                twist: range(-110.0, 110.0, 0.0, 50.0, 40.0),
                stray: QUICK,
            });
        }
        // AAOS: 120 forwards, 30 back, 45 outwards, 30 across; 45 about itself.
        (bone == LEGS[side].upper).then(|| Cone {
            along: -Vector3::z(),
            centre: Vector3::new(0.76, 0.10 * out, -0.64).normalize(),
            reach: 100.0,
            twist: range(-65.0, 65.0, 0.0, 25.0, 30.0),
            stray: QUICK,
        })
    })
}

/// Of a rotation the twist about `along` that is left when the shortest swing of `along` is taken off, radians, and its
/// gradient by turns about the rotated bone's own axes.
pub(crate) fn twist(rotation: &UnitQuaternion<f64>, along: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let (w, v) = (rotation.w, rotation.imag());
    let s = v.dot(along);
    let norm = (w * w + s * s).max(1e-12);
    // q and -q are one rotation: the angle is the one within half a turn.
    let angle = 2.0 * if w < 0.0 { (-s).atan2(-w) } else { s.atan2(w) };
    let gradient = ((along * w + along.cross(&v)) * w + v * s) / norm;
    (angle, gradient)
}

/// How far a direction lies beyond the cone, radians (0 within), and the gradient by turns about the bone's own axes.
pub(crate) fn beyond(rotation: &UnitQuaternion<f64>, cone: &Cone) -> Option<(f64, Vector3<f64>)> {
    let centre = rotation.inverse() * cone.centre;
    let cosine = cone.along.dot(&centre).clamp(-1.0, 1.0);
    let angle = cosine.acos() - cone.reach.to_radians();
    let across = cone.along.cross(&centre);
    let sine = across.norm();
    (angle > 0.0 && sine > 1e-6).then(|| (angle, -across / sine))
}

/// Every joint brought within its range.
pub(crate) fn clamp(posture: &mut Posture) {
    for (bone, turn) in TURNS.iter().enumerate() {
        match turn {
            Turn::Fixed => {}
            Turn::Hinges(_) => {
                for (angle, range) in posture.angles[bone].iter_mut().zip(ranges(bone)) {
                    *angle = angle.clamp(range.low.to_radians(), range.high.to_radians());
                }
            }
            Turn::Ball => {
                if let Some(cone) = cone(bone) {
                    clamp_ball(&mut posture.balls[bone], &cone);
                }
            }
        }
    }
}

fn clamp_ball(rotation: &mut UnitQuaternion<f64>, cone: &Cone) {
    if let Some((angle, gradient)) = beyond(rotation, cone) {
        *rotation *= UnitQuaternion::from_scaled_axis(-gradient * angle);
    }
    let (angle, _) = twist(rotation, &cone.along);
    let allowed = angle.clamp(cone.twist.low.to_radians(), cone.twist.high.to_radians());
    *rotation *= UnitQuaternion::from_scaled_axis(cone.along * (allowed - angle));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hinge_has_a_range_and_rest_is_within() {
        for (bone, turn) in TURNS.iter().enumerate() {
            let hinges = match turn {
                Turn::Hinges(hinges) => hinges.len(),
                _ => 0,
            };
            assert_eq!(ranges(bone).len(), hinges, "bone {bone}");
            for range in ranges(bone) {
                assert!(range.low <= 0.0 && range.high >= 0.0 && range.stray > 0.0);
            }
        }
        let mut rest = Posture::rest(Vector3::zeros());
        clamp(&mut rest);
        assert_eq!(rest, Posture::rest(Vector3::zeros()));
    }

    #[test]
    fn gradients_are_those_of_the_angles() {
        let rotation = UnitQuaternion::from_euler_angles(0.7, -1.1, 1.9);
        let step = 1e-6;
        for bone in [ARMS[0].upper, ARMS[1].upper, LEGS[0].upper, LEGS[1].upper] {
            let mut cone = cone(bone).unwrap();
            cone.reach = 1.0;
            let (angle, gradient) = twist(&rotation, &cone.along);
            let (far, further) = beyond(&rotation, &cone).unwrap();
            for axis in 0..3 {
                let turned = rotation * UnitQuaternion::from_scaled_axis(Vector3::ith(axis, step));
                let slope = (twist(&turned, &cone.along).0 - angle) / step;
                assert!((slope - gradient[axis]).abs() < 1e-4, "{slope} {gradient}");
                let slope = (beyond(&turned, &cone).unwrap().0 - far) / step;
                assert!((slope - further[axis]).abs() < 1e-4, "{slope} {further}");
            }
        }
    }
}
