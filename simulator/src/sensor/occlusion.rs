//! Which joints a sensor can see past the bodies and desks in its way: 19 capsules a body, five rays a joint.

use nalgebra::Vector3;
use posefuse_skeleton::{Frame, Joint, JointMap, Position, Room, Sensor, Transform};

use crate::scenario::Scenario;

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

/// Bars that a desk is made of, one above the other: heights of their middles and radius, metres.
const BARS_M: [f64; 4] = [0.12, 0.34, 0.56, 0.78];
const BAR_RADIUS_M: f64 = 0.12;
/// Half as wide as it is, and how far outside of the area it stands, metres.
const DESK_HALF_M: f64 = 0.8;
const DESK_OUTSIDE_M: f64 = 0.1;

/// A capsule in its place.
struct Limb {
    /// The joints at its ends; none for a thing's.
    joints: Option<[Joint; 2]>,
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
                joints: Some(capsule.ends),
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

    /// The desk before sensor `index`, in the sensor's frame, if it has one.
    pub(crate) fn desk(
        scenario: &Scenario,
        index: usize,
        sensor_from_room: &Transform<Sensor, Room>,
    ) -> Option<Self> {
        if index >= scenario.desks {
            return None;
        }
        let sensor = sensor_from_room.inverse().origin().vector();
        let towards = Vector3::new(sensor.x, sensor.y, 0.0).try_normalize(1e-9)?;
        let foot = towards * (0.5 * scenario.area_m + DESK_OUTSIDE_M);
        let aside = towards.cross(&Vector3::z()) * DESK_HALF_M;
        let there = |at: Vector3<f64>| {
            sensor_from_room
                .apply(Position::<Room>::from_vector(at))
                .vector()
        };
        let bar = |height: f64| {
            let middle = foot + Vector3::z() * height;
            Limb {
                joints: None,
                ends: [there(middle - aside), there(middle + aside)],
                radius: BAR_RADIUS_M,
            }
        };
        Some(Self {
            limbs: BARS_M.map(bar).into(),
            centre: there(foot + Vector3::z() * BARS_M[1]),
            radius: 1.1,
        })
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
            let its_own = own.is_some_and(|joint| {
                let mut ends = limb.joints.iter().flatten();
                ends.any(|end| touches(*end, joint))
            });
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
    fn a_desk_hides_the_legs_behind_it_and_nothing_else() {
        let scenario = Scenario {
            desks: 1,
            sensors: 2,
            ..Scenario::default()
        };
        // At (2.9, 0, 1.2) in the room, looking along -x.
        let axes = nalgebra::Matrix3::new(0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        let turn = nalgebra::Rotation3::from_matrix_unchecked(axes);
        let turn = nalgebra::UnitQuaternion::from_rotation_matrix(&turn);
        let room_from_sensor: Transform<Room, Sensor> =
            Transform::from_parts(Vector3::new(2.9, 0.0, 1.2), turn);
        let sensor_from_room = room_from_sensor.inverse();
        let desk = Flesh::desk(&scenario, 0, &sensor_from_room).unwrap();
        assert!(Flesh::desk(&scenario, 1, &sensor_from_room).is_none());
        let things = [Flesh::new(&JointMap::<Position<Sensor>>::empty()), desk];
        let share = |x: f64, y: f64, z: f64| {
            let at = sensor_from_room.apply(Position::<Room>::new(x, y, z));
            visible_share(&things, 0, Joint::KneeLeft, at.vector())
        };
        assert_eq!(share(0.9, 0.2, 0.5), 0.0, "a knee behind it");
        assert_eq!(share(0.9, 0.2, 1.0), 1.0, "a hip over it");
        assert_eq!(share(0.9, 1.4, 0.5), 1.0, "beside it");
        assert_eq!(share(1.9, 0.2, 0.5), 1.0, "on the sensor's side of it");
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
