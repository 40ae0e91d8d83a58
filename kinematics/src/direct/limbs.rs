//! Arms and legs: two bones and a bend between them, then hand or foot.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use posefuse_skeleton::Joint;

use super::{Shaping, line};
use crate::bones::{ARMS, HIPS, LEGS, SIDES};
use crate::config::HoldConfig;
use crate::posture::quaternion;

/// Below this sine of its angle to the forearm, a thumb says nothing of the forearm's turn.
const LEAST_THUMB: f64 = 0.2;

/// Nothing from one frame to the next turns a limb about itself by more than this, radians.
const MOST_TURN: f64 = 0.35;

/// A limb's upper bone in its own axes: where it points at rest, and about what the bone below it bends.
struct Hung {
    rest: Vector3<f64>,
    bend: Vector3<f64>,
}

/// The joint of this side, given the left one.
fn of(side: usize, left: Joint) -> Joint {
    if side == 0 { left } else { left.mirrored() }
}

impl Shaping<'_> {
    pub(super) fn bend_arm(&mut self, side: usize) {
        use Joint::*;
        let (bones, out) = (ARMS[side], SIDES[side]);
        let joints = [ShoulderLeft, ElbowLeft, WristLeft].map(|joint| of(side, joint));
        self.posture.angles[bones.clavicle] = [0.0; 3];
        if self.extra.clavicles
            && let Some(line) = self.line_in(crate::bones::CHEST, SpineShoulder, joints[0])
        {
            let rest = self.offsets[bones.upper];
            let drop = rest.z.atan2(rest.y.abs());
            let (forwards, up) = (
                line.x.atan2(out * line.y),
                line.z.clamp(-1.0, 1.0).asin() - drop,
            );
            self.posture.angles[bones.clavicle][..2].copy_from_slice(&[forwards, up]);
        }
        self.settle(bones.clavicle);
        let hung = Hung {
            rest: Vector3::y() * out,
            bend: -Vector3::z() * out,
        };
        self.bend_limb(bones.clavicle, (bones.upper, bones.lower), joints, &hung);
        self.turn_hand(side);
    }

    pub(super) fn bend_leg(&mut self, side: usize) {
        use Joint::*;
        let (bones, out) = (LEGS[side], SIDES[side]);
        let joints = [HipLeft, KneeLeft, AnkleLeft].map(|joint| of(side, joint));
        let hung = Hung {
            rest: -Vector3::z(),
            bend: Vector3::y(),
        };
        self.bend_limb(HIPS, (bones.upper, bones.lower), joints, &hung);
        self.settle(bones.lower);
        if let Some(line) = self.line_in(bones.lower, of(side, AnkleLeft), of(side, FootLeft)) {
            let toes = &self.offsets[bones.toes];
            let flat = (-toes.z).atan2(toes.x);
            if line.xy().norm() > 0.2 {
                self.posture.angles[bones.foot][0] = out * line.y.atan2(line.x);
            }
            self.posture.angles[bones.foot][1] = (-line.z).atan2(line.xy().norm()) - flat;
        }
        self.settle(bones.foot);
    }

    /// The upper bone of a limb, and the bend of the lower one.
    fn bend_limb(
        &mut self,
        parent: usize,
        (upper, lower): (usize, usize),
        joints: [Joint; 3],
        hung: &Hung,
    ) {
        self.settle(upper);
        if let Some(along) = line(self.points, joints[0], joints[1]) {
            let below = line(self.points, joints[1], joints[2]);
            let carried = self.axes[upper];
            let (axes, bend) = limb((along, below), hung, &carried, self.hold, self.fresh);
            self.posture.balls[upper] = quaternion(&(self.axes[parent].transpose() * axes));
            if let Some(bend) = bend {
                self.posture.angles[lower][0] = bend;
            }
            self.settle(upper);
        }
    }

    /// The forearm turns with the thumb, the hand goes where it is.
    fn turn_hand(&mut self, side: usize) {
        use Joint::*;
        let (bones, out) = (ARMS[side], SIDES[side]);
        let [wrist, hand, tip, thumb] =
            [WristLeft, HandLeft, HandTipLeft, ThumbLeft].map(|joint| of(side, joint));
        let turned = self.posture.angles[bones.lower][1];
        self.posture.angles[bones.lower][1] = 0.0;
        self.settle(bones.lower);
        let aside = self
            .line_in(bones.lower, wrist, thumb)
            .zip(self.line_in(bones.lower, wrist, hand))
            .map(|(thumb, hand)| thumb - hand * thumb.dot(&hand));
        self.posture.angles[bones.lower][1] = match aside {
            Some(aside) if aside.xz().norm() > LEAST_THUMB => (-aside.z).atan2(aside.x),
            _ => turned,
        };
        self.settle(bones.lower);
        if let Some(line) = self.line_in(bones.lower, wrist, hand) {
            let (down, to_thumb) = (
                (-line.z).atan2(out * line.y),
                line.x.clamp(-1.0, 1.0).asin(),
            );
            self.posture.angles[bones.hand][..2].copy_from_slice(&[down, to_thumb]);
        }
        self.settle(bones.hand);
        self.posture.angles[bones.fingers][0] = 0.0;
        if self.extra.fingers
            && let Some(line) = self.line_in(bones.hand, hand, tip)
        {
            self.posture.angles[bones.fingers][0] = (-line.z).atan2(out * line.y);
        }
    }
}

/// The upper bone's room axes, and how far the lower one is bent against it (radians). `carried` are its axes as they
/// would be if the limb had not moved against the body.
fn limb(
    (upper, lower): (Vector3<f64>, Option<Vector3<f64>>),
    hung: &Hung,
    carried: &Matrix3<f64>,
    hold: &HoldConfig,
    fresh: bool,
) -> (Matrix3<f64>, Option<f64>) {
    let swing = UnitQuaternion::rotation_between(&(carried * hung.rest), &upper);
    // Exactly reversed: half a turn about the bend's axis.
    let kept = swing.map_or(carried * hung.bend, |swing| swing * (carried * hung.bend));
    let bend = lower.map(|lower| {
        let normal = upper.cross(&lower);
        (normal, normal.norm().atan2(upper.dot(&lower)))
    });
    let normal = bend
        .and_then(|(normal, angle)| {
            let share = trusted(angle, hold, fresh);
            let normal = (share > 0.0)
                .then(|| normal.try_normalize(1e-9))
                .flatten()?;
            Some(if fresh || !hold.enabled {
                normal
            } else {
                turned(&kept, &normal, &upper, share)
            })
        })
        .unwrap_or(kept);
    let normal = (normal - upper * normal.dot(&upper))
        .try_normalize(1e-6)
        .unwrap_or(kept);
    let of_rest = Matrix3::from_columns(&[hung.rest, hung.bend, hung.rest.cross(&hung.bend)]);
    let of_room = Matrix3::from_columns(&[upper, normal, upper.cross(&normal)]);
    let bend = bend.map(|(seen, angle)| {
        if seen.dot(&normal) < 0.0 {
            -angle
        } else {
            angle
        }
    });
    (of_room * of_rest.transpose(), bend)
}

/// `kept`, turned about `upper` towards `normal` by `share` of the way, not by more than [`MOST_TURN`]: a limb that noise bends
/// the wrong way for a frame does not turn over.
fn turned(
    kept: &Vector3<f64>,
    normal: &Vector3<f64>,
    upper: &Vector3<f64>,
    share: f64,
) -> Vector3<f64> {
    let angle = kept.cross(normal).dot(upper).atan2(kept.dot(normal));
    let turn = (share * angle).clamp(-MOST_TURN, MOST_TURN);
    UnitQuaternion::from_scaled_axis(upper * turn) * kept
}

/// How far the bend's plane is taken for the limb's, 0 to 1. With nothing known from before, as soon as it shows.
fn trusted(angle: f64, hold: &HoldConfig, fresh: bool) -> f64 {
    let straight = hold.straight_deg.to_radians();
    if !hold.enabled {
        1.0
    } else if angle <= straight {
        0.0
    } else if fresh {
        1.0
    } else {
        ((angle - straight) / straight).min(1.0)
    }
}
