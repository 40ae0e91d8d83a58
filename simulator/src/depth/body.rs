//! The flesh around a person's joints.
//!
//! Measures are for somebody 1.75 m tall, after the tables of body measures for adults (e.g. Drillis and Contini 1966 for
//! lengths; breadths and depths as in common anthropometric surveys), and grow with the person. Joints lie inside, where
//! depth trackers report them. Front and back differ as people's do: face, breast and belly, toes; seat, heels, hair.

use posefuse_skeleton::{ARMS, Joint, JointMap, Position, Sensor};

use super::build::Build;
use super::canvas::HAIR;
use super::hand;
use super::shape::{Shape, V3};

const TALL_M: f32 = 1.75;
/// What spine and leg together measure of the height.
const SPINE_AND_LEG: f32 = 0.75;

/// A body's shapes, each with its tag's flags.
pub(super) struct Flesh<'a> {
    joints: &'a JointMap<Position<Sensor>>,
    pub(super) build: &'a Build,
    /// How much bigger than somebody 1.75 m tall.
    scale: f32,
    pub(super) shapes: Vec<(Shape, u8)>,
}

/// The person's left, up and forwards at some part of the body, unit vectors.
#[derive(Clone, Copy)]
struct Axes {
    left: V3,
    up: V3,
    ahead: V3,
}

impl Axes {
    /// Exactly `up`, nearly `left`.
    fn new(left: V3, up: V3) -> Option<Self> {
        let up = up.try_normalize(1e-6)?;
        let left = (left - up * left.dot(&up)).try_normalize(1e-6)?;
        Some(Self {
            left,
            up,
            ahead: left.cross(&up),
        })
    }

    fn turned(self, radians: f32) -> Self {
        let (sin, cos) = radians.sin_cos();
        let ahead = self.ahead * cos + self.left * sin;
        Self {
            left: self.up.cross(&ahead),
            ahead,
            ..self
        }
    }
}

/// The shapes of a body; parts whose joints are missing are missing.
pub(super) fn flesh(
    joints: &JointMap<Position<Sensor>>,
    build: &Build,
    head_turn: f64,
    hands_closed: [bool; 2],
) -> Vec<(Shape, u8)> {
    let mut flesh = Flesh {
        joints,
        build,
        scale: scale(joints),
        shapes: Vec::with_capacity(72),
    };
    flesh.trunk(head_turn as f32);
    flesh.limbs(hands_closed);
    flesh.shapes
}

/// Size against somebody 1.75 m tall, from the bones that are there.
fn scale(joints: &JointMap<Position<Sensor>>) -> f32 {
    use Joint::*;
    let length = |way: &[Joint]| -> Option<f32> {
        way.windows(2)
            .map(|pair| Some(joints[pair[0]]?.distance(joints[pair[1]]?) as f32))
            .sum()
    };
    let spine = length(&[SpineBase, SpineMid, SpineShoulder]);
    let leg = [
        [HipLeft, KneeLeft, AnkleLeft],
        [HipRight, KneeRight, AnkleRight],
    ]
    .iter()
    .find_map(|way| length(way));
    match (spine, leg) {
        (Some(spine), Some(leg)) => ((spine + leg) / SPINE_AND_LEG / TALL_M).clamp(0.4, 1.4),
        _ => 1.0,
    }
}

impl Flesh<'_> {
    pub(super) fn at(&self, joint: Joint) -> Option<V3> {
        Some(self.joints[joint]?.vector().cast::<f32>())
    }

    /// Metres of somebody 1.75 m tall as this person's.
    pub(super) fn m(&self, metres: f32) -> f32 {
        metres * self.scale
    }

    pub(super) fn add(&mut self, shape: Shape) {
        self.shapes.push((shape, 0));
    }

    pub(super) fn limb(&mut self, a: V3, b: V3, ra: f32, rb: f32) {
        self.add(Shape::limb(a, b, self.m(ra), self.m(rb)));
    }

    fn trunk(&mut self, head_turn: f32) {
        use Joint::*;
        let (base, mid, top) = (
            self.at(SpineBase),
            self.at(SpineMid),
            self.at(SpineShoulder),
        );
        let across = |l: Option<V3>, r: Option<V3>| Some(l? - r?);
        let hips = across(self.at(HipLeft), self.at(HipRight));
        let shoulders = across(self.at(ShoulderLeft), self.at(ShoulderRight)).or(hips);
        let pelvis = base.zip(mid).and_then(|(b, m)| Axes::new(hips?, m - b));
        let chest = mid.zip(top).and_then(|(m, t)| Axes::new(shoulders?, t - m));
        if let (Some(base), Some(mid), Some(axes)) = (base, mid, pelvis) {
            self.pelvis(base, mid, axes);
        }
        if let (Some(mid), Some(top), Some(axes)) = (mid, top, chest) {
            self.chest(mid, top, axes);
            self.head(top, axes, head_turn);
        }
    }

    fn pelvis(&mut self, base: V3, mid: V3, axes: Axes) {
        let (trunk, belly) = (self.build.trunk as f32, self.build.belly_m as f32);
        let coat = self.build.coat_m as f32;
        let trousers = self.build.trousers_m as f32;
        let Axes { left, up, ahead } = axes;
        let m = self.m(1.0);
        let half = left * (0.06 * m);
        let low = base - up * (0.025 * m);
        self.limb(
            low + half,
            low - half,
            0.108 * trunk + trousers,
            0.108 * trunk + trousers,
        );
        for side in [1.0, -1.0] {
            let seat = low + left * (side * 0.07 * m) - (up * 0.035 + ahead * 0.04) * m;
            self.add(Shape::ball(seat, (0.084 * trunk + trousers) * m));
        }
        let waist = Shape::limb(
            base + up * (0.04 * m),
            mid,
            (0.152 * trunk + coat) * m,
            (0.140 * trunk + coat) * m,
        );
        self.add(waist.pressed(ahead, 0.74));
        let front = base.lerp(&mid, 0.55) + ahead * ((0.015 + belly) * m);
        let round = Shape::ball(front, (0.125 * trunk + coat) * m);
        self.add(round.pressed(ahead, 0.86));
        if let Some(covers) = self.build.skirt {
            self.skirt(base, covers as f32, ahead);
        }
    }

    fn skirt(&mut self, base: V3, covers: f32, ahead: V3) {
        use Joint::*;
        let ends = [KneeLeft, KneeRight, AnkleLeft, AnkleRight].map(|joint| self.at(joint));
        let [Some(kl), Some(kr), Some(al), Some(ar)] = ends else {
            return;
        };
        let (knees, ankles) = ((kl + kr) * 0.5, (al + ar) * 0.5);
        let wide = 0.10 + 0.07 * covers + 0.4 * (kl - kr).norm().min(0.5);
        let hem = if covers < 0.5 {
            base.lerp(&knees, covers * 2.0)
        } else {
            knees.lerp(&ankles, covers * 2.0 - 1.0)
        };
        let hull = Shape::limb(base, hem, self.m(0.15), self.m(wide));
        self.add(hull.pressed(ahead, 0.75));
    }

    fn chest(&mut self, mid: V3, top: V3, axes: Axes) {
        use Joint::*;
        let Axes { left, up, ahead } = axes;
        let m = self.m(1.0);
        let coat = self.build.coat_m as f32;
        let (trunk, breast) = (self.build.trunk as f32, self.build.breast_m as f32);
        let wide = self.build.chest as f32 * (0.4 + 0.6 * trunk);
        let ribs = Shape::limb(
            mid,
            mid.lerp(&top, 0.52),
            (0.142 * trunk + coat) * m,
            (0.163 * wide + coat) * m,
        );
        self.add(ribs.pressed(ahead, 0.70));
        for side in [1.0, -1.0] {
            let aside = left * (side * 0.072 * m);
            let front = mid.lerp(&top, 0.58) + aside + ahead * ((0.052 + breast) * m);
            self.add(Shape::ball(front, (0.075 * wide + coat) * m));
            let blade = mid.lerp(&top, 0.75) + aside - ahead * (0.045 * m);
            self.add(Shape::ball(blade, (0.078 * wide + coat) * m));
        }
        let sides = [ShoulderLeft, ShoulderRight].map(|joint| self.at(joint));
        if let [Some(l), Some(r)] = sides {
            self.limb(l, r, 0.06 * wide + coat, 0.06 * wide + coat);
        }
        if let Some(neck) = self.at(Neck) {
            for shoulder in sides.into_iter().flatten() {
                let slope = neck - up * (0.035 * m) - ahead * (0.01 * m);
                self.limb(slope, shoulder + up * (0.005 * m), 0.055, 0.05 + coat);
            }
        }
    }

    fn head(&mut self, top: V3, chest: Axes, turn: f32) {
        let (Some(neck), Some(head)) = (self.at(Joint::Neck), self.at(Joint::Head)) else {
            return;
        };
        let Some(axes) = Axes::new(chest.left, head - neck) else {
            return;
        };
        let Axes { left, up, ahead } = axes.turned(turn);
        let size = self.build.head as f32;
        let m = self.m(size);
        self.limb(
            top - chest.ahead * (0.012 * m),
            head - up * (0.06 * m),
            0.060,
            0.056,
        );
        let skull = Shape::ball(head + ahead * (0.004 * m), 0.116 * m);
        self.add(skull.pressed(left, 0.66).pressed(ahead, 0.83));
        let jaw = Shape::ball(head - up * (0.07 * m) + ahead * (0.042 * m), 0.052 * m);
        self.add(jaw);
        let nose = head + ahead * (0.098 * m) - up * (0.012 * m);
        self.add(Shape::limb(
            nose + up * (0.025 * m),
            nose,
            0.008 * m,
            0.016 * m,
        ));
        let (hair, long) = (self.build.hair_m as f32, self.build.long_hair_m as f32);
        let crown = head - ahead * (0.014 * m) + up * (0.014 * m);
        let cap = Shape::ball(crown, (0.108 + hair) * m);
        let cap = cap.pressed(left, 0.74).pressed(ahead, 0.84);
        self.shapes.push((cap, HAIR));
        if long > 0.0 {
            let from = head - ahead * (0.05 * m);
            let to = neck - ahead * (0.065 * m) - chest.up * (long * m);
            let fall = Shape::limb(from, to, (0.07 + hair) * m, 0.075 * m);
            self.shapes.push((fall.pressed(ahead, 0.7), HAIR));
        }
    }

    fn limbs(&mut self, hands_closed: [bool; 2]) {
        use Joint::*;
        for ((arm, side), closed) in ARMS.into_iter().zip([1.0, -1.0]).zip(hands_closed) {
            self.arm([arm[0], arm[1], arm[2]]);
            hand::add(self, [arm[2], arm[3], arm[4], arm[5]], side, closed);
        }
        let hips = self.at(HipLeft).zip(self.at(HipRight)).map(|(l, r)| l - r);
        self.leg([HipLeft, KneeLeft, AnkleLeft, FootLeft], hips);
        self.leg([HipRight, KneeRight, AnkleRight, FootRight], hips);
    }

    fn arm(&mut self, joints: [Joint; 3]) {
        let girth = self.build.limbs as f32;
        let coat = self.build.coat_m as f32;
        let [shoulder, elbow, wrist] = joints.map(|joint| self.at(joint));
        if let (Some(shoulder), Some(elbow)) = (shoulder, elbow) {
            let muscle = shoulder.lerp(&elbow, 0.12);
            self.add(Shape::ball(muscle, self.m(0.060 * girth + coat)));
            self.limb(shoulder, elbow, 0.052 * girth + coat, 0.042 * girth + coat);
        }
        if let (Some(elbow), Some(wrist)) = (elbow, wrist) {
            let full = elbow.lerp(&wrist, 0.2);
            self.limb(elbow, full, 0.041 * girth + coat, 0.044 * girth + coat);
            self.limb(
                full,
                wrist,
                0.044 * girth + coat,
                0.029 * girth + 0.7 * coat,
            );
        }
    }

    fn leg(&mut self, joints: [Joint; 4], hips_left: Option<V3>) {
        let girth = self.build.limbs as f32 * (0.6 + 0.4 * self.build.trunk as f32);
        let (wear, flare) = (self.build.trousers_m as f32, self.build.flare_m as f32);
        let [hip, knee, ankle, foot] = joints.map(|joint| self.at(joint));
        if let (Some(hip), Some(knee)) = (hip, knee) {
            self.limb(hip, knee, 0.088 * girth + wear, 0.060 * girth + wear);
        }
        let (Some(knee), Some(ankle)) = (knee, ankle) else {
            return;
        };
        let axes = foot.and_then(|foot| sole_axes(knee, ankle, foot, hips_left));
        let back = axes.map_or_else(V3::zeros, |axes| -axes.ahead);
        let calf = knee.lerp(&ankle, 0.32) + back * self.m(0.014);
        self.limb(knee, calf, 0.057 * girth + wear, 0.057 * girth + wear);
        self.limb(
            calf,
            ankle,
            0.057 * girth + wear,
            0.038 * girth + wear + flare,
        );
        if let Some(Axes { up, ahead, .. }) = axes {
            let m = self.m(1.0);
            let thick = self.build.soles_m as f32;
            let heel = ankle - (ahead * 0.045 + up * 0.045) * m;
            let toes = ankle + (ahead * 0.165 - up * 0.05) * m;
            let sole = Shape::limb(heel, toes, (0.042 + thick) * m, 0.046 * m);
            self.add(sole.pressed(up, 0.7));
            self.limb(ankle, ankle.lerp(&toes, 0.6), 0.042, 0.034);
        }
    }
}

/// Along a foot: its joint is in front of the ankle and below it by this angle when the foot is flat.
const TOES_DOWN_RAD: f32 = 0.36;

fn sole_axes(knee: V3, ankle: V3, foot: V3, hips_left: Option<V3>) -> Option<Axes> {
    let toes = (foot - ankle).try_normalize(1e-6)?;
    let left = (knee - ankle).normalize().cross(&toes);
    // With the toes pointing along the shin only the hips tell what left is.
    let left = if left.norm() > 0.2 { left } else { hips_left? };
    let left = (left - toes * left.dot(&toes)).try_normalize(1e-6)?;
    let above = toes.cross(&left);
    let (sin, cos) = TOES_DOWN_RAD.sin_cos();
    let ahead = toes * cos + above * sin;
    Some(Axes {
        left,
        up: ahead.cross(&left),
        ahead,
    })
}
