//! Hands: a palm with four fingers and a thumb, stretched or half bent when open, folded into a fist when closed.
//!
//! Lengths and breadths are an average adult's (hand 19 cm long from wrist to middle finger's tip, 8.5 cm broad, fingers 1.5 to 2 cm
//! thick; Garrett 1971), for somebody 1.75 m tall. A closed hand's tip and thumb joints are where the open hand's would be.

use posefuse_skeleton::Joint;

use super::body::Flesh;
use super::shape::{Shape, V3};

/// For index, middle, ring and little finger: how far the knuckle is from the wrist along the hand and from its middle towards
/// the thumb, and the finger's length, metres.
const FINGERS: [[f32; 3]; 4] = [
    [0.088, 0.029, 0.086],
    [0.092, 0.010, 0.093],
    [0.088, -0.010, 0.087],
    [0.080, -0.028, 0.070],
];
/// Share of a finger before its middle joint.
const FIRST: f32 = 0.46;
/// How thick a finger is at its knuckle and its tip: radii, metres.
const FINGER_M: [f32; 2] = [0.0105, 0.0080];
/// Half the palm's thickness as a share of half its breadth.
const PALM_FLAT: f32 = 0.36;
/// A fist's fingers are bent so far at the knuckle and at the joint after it, radians.
const FIST_RAD: [f32; 2] = [1.45, 2.5];

/// Along the hand, towards the thumb, and out of the palm; unit vectors across each other.
struct Axes {
    along: V3,
    thumb: V3,
    palm: V3,
}

impl Axes {
    /// `side`: 1 for a left hand, -1 for a right one.
    fn new(wrist: V3, hand: V3, thumb: Option<V3>, side: f32) -> Option<Self> {
        let along = (hand - wrist).try_normalize(1e-6)?;
        let across = |way: V3| (way - along * along.dot(&way)).try_normalize(1e-3);
        let thumb = thumb
            .and_then(|thumb| across(thumb - wrist))
            .unwrap_or_else(|| any_across(along));
        Some(Self {
            along,
            thumb,
            palm: along.cross(&thumb) * side,
        })
    }

    /// A place by metres along these axes.
    fn at(&self, [along, thumb, palm]: [f32; 3]) -> V3 {
        self.along * along + self.thumb * thumb + self.palm * palm
    }
}

/// Adds the hand of these joints: wrist, hand, tip, thumb. `side` as in [`Axes::new`].
pub(super) fn add(flesh: &mut Flesh<'_>, joints: [Joint; 4], side: f32, closed: bool) {
    let [wrist, hand, _, thumb] = joints.map(|joint| flesh.at(joint));
    let (Some(wrist), Some(hand)) = (wrist, hand) else {
        return;
    };
    let Some(axes) = Axes::new(wrist, hand, thumb, side) else {
        return;
    };
    let m = flesh.m(flesh.build.hand as f32);
    let at = |place: [f32; 3]| wrist + axes.at(place) * m;
    let (heel, knuckles) = (at([0.022, 0.0, 0.0]), at([0.076, 0.0, 0.0]));
    let palm = Shape::limb(heel, knuckles, 0.031 * m, 0.043 * m);
    flesh.add(palm.pressed(axes.palm, PALM_FLAT));
    let bend = match closed {
        true => FIST_RAD.map(|bend| bend - 0.5 * flesh.build.fist_loose as f32),
        false => [flesh.build.fingers_bent as f32; 2],
    };
    let spread = if closed {
        0.0
    } else {
        flesh.build.fingers_apart as f32
    };
    for (index, [knuckle, aside, long]) in FINGERS.into_iter().enumerate() {
        let apart = spread * (1.0 - index as f32 / 1.5);
        let way = |bent: f32| {
            let [straight, down] = [bent.cos(), bent.sin()];
            axes.at([straight * apart.cos(), straight * apart.sin(), down])
        };
        let from = at([knuckle, aside, 0.0]);
        let middle = from + way(bend[0]) * (FIRST * long * m);
        let tip = middle + way(bend[0] + bend[1]) * ((1.0 - FIRST) * long * m);
        let [thick, thin] = FINGER_M.map(|radius| radius * m);
        flesh.add(Shape::limb(from, middle, thick, 0.5 * (thick + thin)));
        flesh.add(Shape::limb(middle, tip, 0.5 * (thick + thin), thin));
    }
    let out = flesh.build.fingers_apart as f32;
    // A fist's thumb lies across its fingers, an open hand's stands off.
    let thumb = match closed {
        true => [
            [0.028, 0.026, 0.006],
            [0.060, 0.040, 0.030],
            [0.070, 0.004, 0.052],
        ],
        false => [
            [0.028, 0.026, 0.004],
            [0.062, 0.046 + 0.03 * out, 0.012],
            [0.094, 0.050 + 0.10 * out, 0.018],
        ],
    };
    let [base, joint, end] = thumb.map(at);
    flesh.add(Shape::limb(base, joint, 0.016 * m, 0.0125 * m));
    flesh.add(Shape::limb(joint, end, 0.0125 * m, 0.0095 * m));
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
