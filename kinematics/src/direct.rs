//! Rotations from positions, bone by bone: swing from the rest direction, twist from the bend plane.
//!
//! Pelvis and chest take their axes from hips and shoulders. An upper arm or leg is twisted such that the joint below
//! bends in the plane that its bones show. A straight limb shows none: then the twist is carried along with the limb as it
//! swings, without turning about itself. Lengths are the body's, so origins end up near the positions, not on them.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use crate::bones::{
    ARMS, BONE_COUNT, BONE_OF_JOINT, BONES, CHEST, HEAD, HEAD_END, HIPS, LEGS, NECK, SIDES, SPINE,
};
use crate::config::HoldConfig;
use crate::posture::{Offsets, Placed, Posture, outwards, quaternion};

type Points = JointMap<Vector3<f64>>;

/// Shorter lines have no direction, metres.
const SHORTEST_M: f64 = 0.01;

/// The posture that the positions (room metres) show; what they do not show is as in `last`, or at rest. `None` where
/// neither they nor `last` show the trunk.
pub(crate) fn posture(
    offsets: &Offsets,
    points: &Points,
    last: Option<&Posture>,
    hold: &HoldConfig,
) -> Option<Posture> {
    let Some(pelvis) = pelvis_axes(points, last) else {
        return last.cloned();
    };
    let mut posture = last
        .cloned()
        .unwrap_or_else(|| Posture::rest(Vector3::zeros()));
    let mut axes = [Matrix3::identity(); BONE_COUNT];
    posture.balls[HIPS] = quaternion(&pelvis);
    axes[HIPS] = pelvis;
    bend_spine(&mut posture, &mut axes, points);
    turn_head(&mut posture, &mut axes, points, offsets);
    for side in 0..2 {
        bend_arm(&mut posture, &mut axes, points, last, hold, side);
        bend_leg(&mut posture, &mut axes, points, offsets, last, hold, side);
    }
    posture.root = root(offsets, &posture, points, last)?;
    Some(posture)
}

/// All canonical joints of a placed body.
pub(crate) fn joints(placed: &Placed) -> JointMap<Position<Room>> {
    Joint::ALL
        .into_iter()
        .map(|joint| {
            let origin = placed.origins[BONE_OF_JOINT[joint as usize]];
            (joint, Position::from_vector(origin))
        })
        .collect()
}

fn line(points: &Points, from: Joint, to: Joint) -> Option<Vector3<f64>> {
    (points[to]? - points[from]?).try_normalize(SHORTEST_M)
}

/// Orthonormal axes with Z along `up` and Y as near `left` as that allows.
fn axes_from(up: Vector3<f64>, left: Vector3<f64>) -> Option<Matrix3<f64>> {
    let z = up.try_normalize(1e-9)?;
    let y = (left - z * left.dot(&z)).try_normalize(0.05)?;
    Some(Matrix3::from_columns(&[y.cross(&z), y, z]))
}

fn pelvis_axes(points: &Points, last: Option<&Posture>) -> Option<Matrix3<f64>> {
    use Joint::*;
    let before: Option<Matrix3<f64>> =
        last.map(|last| *last.balls[HIPS].to_rotation_matrix().matrix());
    let up = line(points, SpineBase, SpineMid)
        .or_else(|| line(points, SpineBase, SpineShoulder))
        .or_else(|| {
            let hips = (points[HipLeft]? + points[HipRight]?) / 2.0;
            let shoulders = (points[ShoulderLeft]? + points[ShoulderRight]?) / 2.0;
            (shoulders - hips).try_normalize(SHORTEST_M)
        })
        .or_else(|| before.map(|axes| axes.column(2).into()))?;
    let left = line(points, HipRight, HipLeft)
        .or_else(|| line(points, ShoulderRight, ShoulderLeft))
        .or_else(|| before.map(|axes| axes.column(1).into()))?;
    axes_from(up, left).or(before)
}

/// The chest from the shoulders and the upper spine; half of its turn against the pelvis is the lower spine's.
fn bend_spine(posture: &mut Posture, axes: &mut [Matrix3<f64>; BONE_COUNT], points: &Points) {
    use Joint::*;
    let pelvis = axes[HIPS];
    // The pelvis stands along the lower spine, whose own bend does not show.
    posture.angles[SPINE] = [0.0; 3];
    let up = line(points, SpineMid, SpineShoulder).unwrap_or(pelvis.column(2).into());
    let left = line(points, ShoulderRight, ShoulderLeft).unwrap_or(pelvis.column(1).into());
    if let Some(chest) = axes_from(up, left) {
        let (roll, pitch, yaw) = quaternion(&(pelvis.transpose() * chest)).euler_angles();
        posture.angles[SPINE][0] = yaw / 2.0;
        axes[SPINE] = turned(&pelvis, posture, SPINE);
        let above = quaternion(&(axes[SPINE].transpose() * chest)).euler_angles();
        posture.angles[CHEST] = [above.2, above.1, above.0];
        debug_assert!(roll.is_finite() && pitch.is_finite());
    } else {
        axes[SPINE] = turned(&pelvis, posture, SPINE);
    }
    axes[CHEST] = turned(&axes[SPINE], posture, CHEST);
}

/// The axes of a bone carried by `parent`.
fn turned(parent: &Matrix3<f64>, posture: &Posture, bone: usize) -> Matrix3<f64> {
    parent * posture.rotation(bone).to_rotation_matrix().matrix()
}

fn turn_head(
    posture: &mut Posture,
    axes: &mut [Matrix3<f64>; BONE_COUNT],
    points: &Points,
    offsets: &Offsets,
) {
    let lean = offsets[HEAD_END].x.atan2(offsets[HEAD_END].z);
    let lines = [
        (NECK, Joint::SpineShoulder, Joint::Neck, 0.0),
        (HEAD, Joint::Neck, Joint::Head, lean),
    ];
    for (bone, from, to, lean) in lines {
        let parent = axes[BONES[bone].parent];
        if let Some(line) = line(points, from, to) {
            let line = parent.transpose() * line;
            let (forwards, sideways) = (line.x.atan2(line.z) - lean, (-line.y).asin());
            posture.angles[bone][..2].copy_from_slice(&[forwards, sideways]);
        }
        axes[bone] = turned(&parent, posture, bone);
    }
}

/// A limb of two bones: the axes of the upper one, and how far the lower one is bent against it (radians). `rest` and
/// `bend` are the upper bone's rest direction and the axis about which the lower one bends, in the bone's axes; `carried`
/// is the bone as it was, in room axes.
fn limb(
    (upper, lower): (Vector3<f64>, Option<Vector3<f64>>),
    (rest, bend): (Vector3<f64>, Vector3<f64>),
    carried: &Matrix3<f64>,
    hold: &HoldConfig,
    known: bool,
) -> (Matrix3<f64>, Option<f64>) {
    let swing = UnitQuaternion::rotation_between(&(carried * rest), &upper).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI)
    });
    let kept: Vector3<f64> = swing * (carried * bend);
    let seen = lower.map(|lower| {
        let normal = upper.cross(&lower);
        (normal, normal.norm().atan2(upper.dot(&lower)))
    });
    let straight = if hold.enabled {
        hold.straight_deg.to_radians()
    } else {
        1e-6
    };
    let (normal, angle) = match seen {
        None => (kept, None),
        Some((_, angle)) if angle <= straight => (kept, Some(angle)),
        Some((normal, angle)) => {
            let normal = normal.normalize();
            let share =
                (((angle - straight) / straight).clamp(0.0, 1.0)).max(f64::from(u8::from(!known)));
            // Bent the wrong way by noise: not yet a reason to turn the limb over.
            if normal.dot(&kept) < 0.0 && share < 1.0 {
                (kept, Some(angle))
            } else {
                (kept.lerp(&normal, share), Some(angle))
            }
        }
    };
    let normal = (normal - upper * normal.dot(&upper))
        .try_normalize(1e-6)
        .unwrap_or(kept);
    let of_rest = Matrix3::from_columns(&[rest, bend, rest.cross(&bend)]);
    let of_room = Matrix3::from_columns(&[upper, normal, upper.cross(&normal)]);
    let signed = angle.map(|angle| {
        let beyond = seen.is_some_and(|(seen, _)| seen.dot(&normal) < 0.0);
        if beyond { -angle } else { angle }
    });
    (of_room * of_rest.transpose(), signed)
}

fn bend_arm(
    posture: &mut Posture,
    axes: &mut [Matrix3<f64>; BONE_COUNT],
    points: &Points,
    last: Option<&Posture>,
    hold: &HoldConfig,
    side: usize,
) {
    use Joint::*;
    let (bones, out) = (ARMS[side], SIDES[side]);
    let of = |joint: Joint| if side == 0 { joint } else { joint.mirrored() };
    if let Some(line) = line(points, SpineShoulder, of(ShoulderLeft)) {
        // The rest direction lies a little below Y; what is seen is turned against it.
        let line = axes[CHEST].transpose() * line;
        let (forwards, up) = (line.x.atan2(out * line.y), line.z.asin());
        posture.angles[bones.clavicle][..2].copy_from_slice(&[forwards, up]);
    }
    axes[bones.clavicle] = turned(&axes[CHEST], posture, bones.clavicle);
    if let Some(upper) = line(points, of(ShoulderLeft), of(ElbowLeft)) {
        let carried = turned(&axes[bones.clavicle], posture, bones.upper);
        let lower = line(points, of(ElbowLeft), of(WristLeft));
        let rest = (outwards(side), -Vector3::z() * out);
        let (upper, angle) = limb((upper, lower), rest, &carried, hold, last.is_some());
        posture.balls[bones.upper] = quaternion(&(axes[bones.clavicle].transpose() * upper));
        if let Some(angle) = angle {
            posture.angles[bones.lower][0] = angle;
        }
    }
    axes[bones.upper] = turned(&axes[bones.clavicle], posture, bones.upper);
    turn_hand(posture, axes, points, side);
}

/// The forearm turns with the thumb, the hand goes where it is.
fn turn_hand(
    posture: &mut Posture,
    axes: &mut [Matrix3<f64>; BONE_COUNT],
    points: &Points,
    side: usize,
) {
    use Joint::*;
    let (bones, out) = (ARMS[side], SIDES[side]);
    let of = |joint: Joint| if side == 0 { joint } else { joint.mirrored() };
    let hand = line(points, of(WristLeft), of(HandLeft));
    let thumb = line(points, of(WristLeft), of(ThumbLeft));
    if let (Some(hand), Some(thumb)) = (hand, thumb) {
        let mut flat = posture.clone();
        flat.angles[bones.lower][1] = 0.0;
        let lower = turned(&axes[bones.upper], &flat, bones.lower);
        let aside = lower.transpose() * (thumb - hand * thumb.dot(&hand));
        if aside.xz().norm() > 0.2 {
            posture.angles[bones.lower][1] = (-aside.z).atan2(aside.x);
        }
    }
    axes[bones.lower] = turned(&axes[bones.upper], posture, bones.lower);
    if let Some(hand) = hand {
        let line = axes[bones.lower].transpose() * hand;
        let (down, to_thumb) = ((-line.z).atan2(out * line.y), line.x.asin());
        posture.angles[bones.hand][..2].copy_from_slice(&[down, to_thumb]);
    }
    axes[bones.hand] = turned(&axes[bones.lower], posture, bones.hand);
    if let Some(tip) = line(points, of(HandLeft), of(HandTipLeft)) {
        let line = axes[bones.hand].transpose() * tip;
        posture.angles[bones.fingers][0] = (-line.z).atan2(out * line.y);
    }
}

fn bend_leg(
    posture: &mut Posture,
    axes: &mut [Matrix3<f64>; BONE_COUNT],
    points: &Points,
    offsets: &Offsets,
    last: Option<&Posture>,
    hold: &HoldConfig,
    side: usize,
) {
    use Joint::*;
    let (bones, out) = (LEGS[side], SIDES[side]);
    let of = |joint: Joint| if side == 0 { joint } else { joint.mirrored() };
    if let Some(upper) = line(points, of(HipLeft), of(KneeLeft)) {
        let carried = turned(&axes[HIPS], posture, bones.upper);
        let lower = line(points, of(KneeLeft), of(AnkleLeft));
        let rest = (-Vector3::z(), Vector3::y());
        let (upper, angle) = limb((upper, lower), rest, &carried, hold, last.is_some());
        posture.balls[bones.upper] = quaternion(&(axes[HIPS].transpose() * upper));
        if let Some(angle) = angle {
            posture.angles[bones.lower][0] = angle;
        }
    }
    axes[bones.upper] = turned(&axes[HIPS], posture, bones.upper);
    axes[bones.lower] = turned(&axes[bones.upper], posture, bones.lower);
    if let Some(foot) = line(points, of(AnkleLeft), of(FootLeft)) {
        let line = axes[bones.lower].transpose() * foot;
        let flat = (-offsets[bones.toes].z).atan2(offsets[bones.toes].x);
        let yaw = if line.xy().norm() > 0.2 {
            out * line.y.atan2(line.x)
        } else {
            posture.angles[bones.foot][0]
        };
        let down = (-line.z).atan2(line.xy().norm()) - flat;
        posture.angles[bones.foot][..2].copy_from_slice(&[yaw, down]);
    }
}

/// Where the root must be for the trunk to lie best on its positions, all alike; else as before.
fn root(
    offsets: &Offsets,
    posture: &Posture,
    points: &Points,
    last: Option<&Posture>,
) -> Option<Vector3<f64>> {
    let mut at_zero = posture.clone();
    at_zero.root = Vector3::zeros();
    let placed = Placed::of(offsets, &at_zero);
    let mean = |joints: &mut dyn Iterator<Item = Joint>| {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        for joint in joints {
            if let Some(point) = points[joint] {
                sum += point - placed.origins[BONE_OF_JOINT[joint as usize]];
                count += 1.0;
            }
        }
        (count > 0.0).then(|| sum / count)
    };
    mean(&mut Joint::TORSO.into_iter())
        .or_else(|| mean(&mut Joint::ALL.into_iter()))
        .or(last.map(|last| last.root))
}
