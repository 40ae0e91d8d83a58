//! Rotations from positions, bone by bone: swing from the rest direction, twist from the bend plane.
//!
//! Pelvis and chest take their axes from hips and shoulders. An upper arm or leg is twisted such that the joint below
//! bends in the plane that its bones show. A straight limb shows none: then the twist is carried along with the limb as it
//! swings, without turning about itself. Lengths are the body's, so origins end up near the positions, not on them.

mod limbs;

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{Joint, JointMap, Position, Room};

use crate::bones::{BONE_COUNT, BONE_OF_JOINT, BONES, CHEST, HEAD, HEAD_END, HIPS, NECK, SPINE};
use crate::config::{ExtraConfig, HoldConfig};
use crate::posture::{Offsets, Placed, Posture, quaternion};

pub(crate) type Points = JointMap<Vector3<f64>>;

/// Shorter lines have no direction, metres.
const SHORTEST_M: f64 = 0.01;

/// A posture in the making: parents are done before children.
struct Shaping<'a> {
    posture: Posture,
    /// `room_from_bone` of the bones that are done.
    axes: [Matrix3<f64>; BONE_COUNT],
    points: &'a Points,
    offsets: &'a Offsets,
    hold: &'a HoldConfig,
    extra: &'a ExtraConfig,
    /// Whether nothing is known from before.
    fresh: bool,
}

/// The posture that the positions (room metres) show; what they do not show is as in `last`, or at rest. `None` where
/// neither they nor `last` show the trunk.
pub(crate) fn posture(
    offsets: &Offsets,
    points: &Points,
    last: Option<&Posture>,
    hold: &HoldConfig,
    extra: &ExtraConfig,
) -> Option<Posture> {
    let pelvis = pelvis_axes(points, last)?;
    let mut shaping = Shaping {
        posture: last
            .cloned()
            .unwrap_or_else(|| Posture::rest(Vector3::zeros())),
        axes: [Matrix3::identity(); BONE_COUNT],
        points,
        offsets,
        hold,
        extra,
        fresh: last.is_none(),
    };
    shaping.posture.balls[HIPS] = quaternion(&pelvis);
    shaping.axes[HIPS] = pelvis;
    shaping.bend_spine();
    shaping.turn_head();
    for side in 0..2 {
        shaping.bend_arm(side);
        shaping.bend_leg(side);
    }
    let mut posture = shaping.posture;
    posture.root = root(offsets, &posture, points, last)?;
    Some(posture)
}

/// Whether these positions make a [`posture`] by themselves.
pub(crate) fn shows_trunk(points: &Points) -> bool {
    pelvis_axes(points, None).is_some()
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
    let along_spine = || {
        line(points, SpineBase, SpineMid)
            .or_else(|| line(points, SpineBase, SpineShoulder))
            .or_else(|| {
                let hips = (points[HipLeft]? + points[HipRight]?) / 2.0;
                let shoulders = (points[ShoulderLeft]? + points[ShoulderRight]?) / 2.0;
                (shoulders - hips).try_normalize(SHORTEST_M)
            })
    };
    let across =
        || line(points, HipRight, HipLeft).or_else(|| line(points, ShoulderRight, ShoulderLeft));
    let up = along_spine().or_else(|| before.map(|axes| axes.column(2).into()))?;
    let left = across().or_else(|| before.map(|axes| axes.column(1).into()))?;
    axes_from(up, left).or(before)
}

impl Shaping<'_> {
    /// Places a bone's axes by its parent's and its own angles.
    fn settle(&mut self, bone: usize) {
        let parent = BONES[bone].parent;
        let rotation = self.posture.rotation(bone);
        self.axes[bone] = self.axes[parent] * rotation.to_rotation_matrix().matrix();
    }

    /// The direction from one joint to another in the axes of a bone that is done.
    fn line_in(&self, bone: usize, from: Joint, to: Joint) -> Option<Vector3<f64>> {
        Some(self.axes[bone].transpose() * line(self.points, from, to)?)
    }

    /// The chest from the shoulders and the upper spine; half of its turn against the pelvis is the lower spine's, whose
    /// bend does not show: the pelvis stands along it.
    fn bend_spine(&mut self) {
        use Joint::*;
        let pelvis = self.axes[HIPS];
        let up = line(self.points, SpineMid, SpineShoulder).unwrap_or(pelvis.column(2).into());
        let left =
            line(self.points, ShoulderRight, ShoulderLeft).unwrap_or(pelvis.column(1).into());
        let chest = axes_from(up, left).unwrap_or(pelvis);
        self.posture.angles[SPINE] = [0.0; 3];
        if self.extra.spine {
            let (_, _, turn) = quaternion(&(pelvis.transpose() * chest)).euler_angles();
            self.posture.angles[SPINE][0] = turn / 2.0;
        }
        self.settle(SPINE);
        let above = quaternion(&(self.axes[SPINE].transpose() * chest));
        let (lean, bend, turn) = above.euler_angles();
        self.posture.angles[CHEST] = [turn, bend, lean];
        self.settle(CHEST);
    }

    fn turn_head(&mut self) {
        let end = &self.offsets[HEAD_END];
        let lines = [
            (NECK, Joint::SpineShoulder, Joint::Neck, 0.0),
            (HEAD, Joint::Neck, Joint::Head, end.x.atan2(end.z)),
        ];
        for (bone, from, to, lean) in lines {
            if let Some(line) = self.line_in(BONES[bone].parent, from, to) {
                let (forwards, sideways) = (
                    line.x.atan2(line.z) - lean,
                    (-line.y).clamp(-1.0, 1.0).asin(),
                );
                self.posture.angles[bone][..2].copy_from_slice(&[forwards, sideways]);
            }
            self.settle(bone);
        }
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
