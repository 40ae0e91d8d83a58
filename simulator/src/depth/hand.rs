//! Hands: flat with fingers' breadth when open, a lump when closed.

use posefuse_skeleton::Joint;

use super::body::Flesh;
use super::shape::{Shape, V3};

/// Adds the hand of these joints: wrist, hand, tip, thumb.
pub(super) fn add(flesh: &mut Flesh<'_>, joints: [Joint; 4], closed: bool) {
    let [wrist, hand, tip, thumb] = joints.map(|joint| flesh.at(joint));
    let (Some(wrist), Some(hand)) = (wrist, hand) else {
        return;
    };
    let m = flesh.m(1.0);
    let Some(along) = (hand - wrist).try_normalize(1e-6) else {
        return;
    };
    // Through the palm: across the hand and the thumb.
    let palm = thumb
        .and_then(|thumb| along.cross(&(thumb - wrist)).try_normalize(1e-3))
        .unwrap_or_else(|| any_across(along));
    if closed {
        let fist = wrist + along * (0.075 * m);
        let lump = Shape::limb(wrist + along * (0.03 * m), fist, 0.036 * m, 0.046 * m);
        flesh.add(lump.pressed(palm, 0.72));
        return;
    }
    let knuckles = wrist + along * (0.085 * m);
    let back = Shape::limb(wrist + along * (0.02 * m), knuckles, 0.032 * m, 0.044 * m);
    flesh.add(back.pressed(palm, 0.36));
    let tip = tip.unwrap_or(hand + along * (0.08 * m));
    let fingers = Shape::limb(knuckles, tip, 0.042 * m, 0.032 * m);
    flesh.add(fingers.pressed(palm, 0.30));
    if let Some(thumb) = thumb {
        flesh.limb(wrist.lerp(&thumb, 0.3), thumb, 0.017, 0.011);
    }
}

/// Some unit vector across a unit vector.
fn any_across(along: V3) -> V3 {
    let aside = if along.y.abs() < 0.9 {
        V3::y()
    } else {
        V3::x()
    };
    along.cross(&aside).normalize()
}
