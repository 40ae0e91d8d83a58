//! Which joints a sensor can see past the bodies in its way: 19 capsules a body, five rays a joint.

use nalgebra::Vector3;
use posefuse_skeleton::{Frame, Joint, JointMap, Position};

/// The flesh around one bone: end joints and radius in metres.
struct Capsule {
    ends: [Joint; 2],
    radius: f64,
}

const fn capsule(a: Joint, b: Joint, radius: f64) -> Capsule {
    Capsule {
        ends: [a, b],
        radius,
    }
}

const CAPSULES: [Capsule; 19] = {
    use Joint::*;
    [
        capsule(SpineBase, SpineMid, 0.12),
        capsule(SpineMid, SpineShoulder, 0.12),
        capsule(Neck, Head, 0.09),
        capsule(SpineShoulder, ShoulderLeft, 0.06),
        capsule(SpineShoulder, ShoulderRight, 0.06),
        capsule(ShoulderLeft, ElbowLeft, 0.045),
        capsule(ElbowLeft, WristLeft, 0.038),
        capsule(WristLeft, HandTipLeft, 0.035),
        capsule(ShoulderRight, ElbowRight, 0.045),
        capsule(ElbowRight, WristRight, 0.038),
        capsule(WristRight, HandTipRight, 0.035),
        capsule(SpineBase, HipLeft, 0.09),
        capsule(SpineBase, HipRight, 0.09),
        capsule(HipLeft, KneeLeft, 0.075),
        capsule(KneeLeft, AnkleLeft, 0.055),
        capsule(AnkleLeft, FootLeft, 0.04),
        capsule(HipRight, KneeRight, 0.075),
        capsule(KneeRight, AnkleRight, 0.055),
        capsule(AnkleRight, FootRight, 0.04),
    ]
};

/// How far beside a joint the four outer rays pass, metres.
const RAY_SPREAD_M: f64 = 0.03;

/// Flesh this close in front of a joint is its own and does not hide it, metres.
const OWN_DEPTH_M: f64 = 0.06;

/// A capsule in its place.
struct Limb {
    joints: [Joint; 2],
    ends: [Vector3<f64>; 2],
    radius: f64,
}

/// The capsules of one body, ready for rays from the origin of frame `F`.
pub(crate) struct Flesh {
    limbs: Vec<Limb>,
    centre: Vector3<f64>,
    radius: f64,
}

impl Flesh {
    /// Around the joints that are there.
    pub(crate) fn new<F: Frame>(joints: &JointMap<Position<F>>) -> Self {
        let limb = |capsule: &Capsule| {
            let [a, b] = capsule.ends;
            Some(Limb {
                joints: capsule.ends,
                ends: [joints[a]?.vector(), joints[b]?.vector()],
                radius: capsule.radius,
            })
        };
        let limbs: Vec<Limb> = CAPSULES.iter().filter_map(limb).collect();
        let count = joints.len().max(1) as f64;
        let centre = joints.iter().map(|(_, p)| p.vector()).sum::<Vector3<f64>>() / count;
        let furthest = |reach: f64, p: Vector3<f64>| reach.max((p - centre).norm());
        let radius = joints.iter().map(|(_, p)| p.vector()).fold(0.0, furthest) + 0.15;
        Self {
            limbs,
            centre,
            radius,
        }
    }

    /// The limbs that come within `margin` of the straight way from the origin to `target`, leaving out those that
    /// end at `own` (or at a joint next to it, where bones overlap).
    fn limbs_near(
        &self,
        target: Vector3<f64>,
        own: Option<Joint>,
        margin: f64,
    ) -> impl Iterator<Item = &Limb> {
        let end = before(target);
        self.limbs.iter().filter(move |limb| {
            let its_own = own.is_some_and(|joint| limb.joints.iter().any(|j| touches(*j, joint)));
            let reach = limb.radius + margin;
            !its_own && squared_distance(end, limb.ends[0], limb.ends[1]) < reach * reach
        })
    }

    /// Whether anything of this body is near the straight way to `target`.
    fn near(&self, target: Vector3<f64>) -> bool {
        let along = (self.centre.dot(&target) / target.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        (target * along - self.centre).norm() < self.radius
    }
}

fn touches(end: Joint, joint: Joint) -> bool {
    end == joint || (lies_in_parents_flesh(joint) && joint.parent() == Some(end))
}

/// Whether the capsules that end at a joint's parent reach over the joint itself: the hand's joints lie within one
/// capsule and the one before it, the neck within the round end of the chest's.
fn lies_in_parents_flesh(joint: Joint) -> bool {
    use Joint::*;
    matches!(
        joint,
        Neck | HandLeft | HandTipLeft | ThumbLeft | HandRight | HandTipRight | ThumbRight
    )
}

/// The share of five rays from the sensor (the origin) that reach `joint` of body number `body` at `target`.
pub(crate) fn visible_share(
    bodies: &[Flesh],
    body: usize,
    joint: Joint,
    target: Vector3<f64>,
) -> f64 {
    let Some(ahead) = target.try_normalize(1e-9) else {
        return 0.0;
    };
    let in_the_way: Vec<&Limb> = bodies
        .iter()
        .enumerate()
        .filter(|(_, flesh)| flesh.near(target))
        .flat_map(|(index, flesh)| {
            flesh.limbs_near(target, (index == body).then_some(joint), RAY_SPREAD_M)
        })
        .collect();
    if in_the_way.is_empty() {
        return 1.0;
    }
    let (right, down) = across(ahead);
    let beside = [Vector3::zeros(), right, -right, down, -down];
    let free = |aside: &&Vector3<f64>| {
        let end = before(target + **aside * RAY_SPREAD_M);
        !in_the_way.iter().any(|limb| {
            squared_distance(end, limb.ends[0], limb.ends[1]) < limb.radius * limb.radius
        })
    };
    beside.iter().filter(free).count() as f64 / beside.len() as f64
}

/// The end of a ray to `target`: just in front of it.
fn before(target: Vector3<f64>) -> Vector3<f64> {
    let depth = target.norm();
    target * ((depth - OWN_DEPTH_M).max(0.0) / depth.max(1e-9))
}

/// Two unit vectors across `ahead` (a unit vector) and each other.
pub(crate) fn across(ahead: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let aside = if ahead.y.abs() < 0.9 {
        Vector3::y()
    } else {
        Vector3::x()
    };
    let right = aside.cross(&ahead).normalize();
    (right, ahead.cross(&right))
}

/// Squared distance between the segments from the origin to `end` and from `a` to `b` (Ericson, Real-Time
/// Collision Detection, 5.1.9, with one end at the origin).
fn squared_distance(end: Vector3<f64>, a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    let (d1, d2, r) = (end, b - a, -a);
    let (l1, l2) = (d1.norm_squared().max(1e-12), d2.norm_squared().max(1e-12));
    let (f, c, m) = (d2.dot(&r), d1.dot(&r), d1.dot(&d2));
    let denominator = l1 * l2 - m * m;
    let mut s = if denominator > 1e-12 {
        ((m * f - c * l2) / denominator).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut t = (m * s + f) / l2;
    if t < 0.0 {
        (t, s) = (0.0, (-c / l1).clamp(0.0, 1.0));
    } else if t > 1.0 {
        (t, s) = (1.0, ((m - c) / l1).clamp(0.0, 1.0));
    }
    (d1 * s - (a + d2 * t)).norm_squared()
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::Sensor;

    use super::*;

    #[test]
    fn segment_distances() {
        let z = Vector3::z();
        let crossing = squared_distance(
            z * 3.0,
            Vector3::new(-1.0, 0.5, 2.0),
            Vector3::new(1.0, 0.5, 2.0),
        );
        assert!((crossing - 0.25).abs() < 1e-12);
        let behind = squared_distance(z, Vector3::new(-1.0, 0.0, 2.0), Vector3::new(1.0, 0.0, 2.0));
        assert!((behind - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_torso_hides_a_hand_behind_it_and_not_one_beside_it() {
        let at = |x: f64, y: f64, z: f64| Position::<Sensor>::new(x, y, z);
        let joints: JointMap<Position<Sensor>> = [
            (Joint::SpineBase, at(0.0, 0.3, 3.0)),
            (Joint::SpineMid, at(0.0, 0.0, 3.0)),
            (Joint::SpineShoulder, at(0.0, -0.3, 3.0)),
        ]
        .into_iter()
        .collect();
        let bodies = [Flesh::new(&joints)];
        let share =
            |x: f64, z: f64| visible_share(&bodies, 0, Joint::HandLeft, Vector3::new(x, 0.0, z));
        assert_eq!(share(0.0, 3.3), 0.0);
        assert_eq!(share(0.5, 3.3), 1.0);
        assert_eq!(share(0.0, 2.7), 1.0, "in front of it");
        assert!(
            (0.2..=0.8).contains(&share(0.13, 3.2)),
            "half hidden at its edge"
        );
    }
}
