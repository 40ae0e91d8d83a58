//! Poses that nobody took in a recording: limbs of one on the trunk of another, limbs anyhow, people who bend, lean and lie.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use posefuse_skeleton::{ARMS, Joint, LEGS, Position};

use crate::chance::Chance;
use crate::poses::Pose;

/// From the chest's axes (x forward, y left, z up) to the room's.
fn chest(pose: &Pose) -> Option<UnitQuaternion<f64>> {
    let at = |joint: Joint| pose[joint].map(|p| p.vector());
    let up = (at(Joint::SpineShoulder)? - at(Joint::SpineMid)?).try_normalize(1e-6)?;
    let left = at(Joint::ShoulderLeft)? - at(Joint::ShoulderRight)?;
    let left = (left - up * left.dot(&up)).try_normalize(1e-6)?;
    let axes = Matrix3::from_columns(&[left.cross(&up), left, up]);
    Some(UnitQuaternion::from_matrix(&axes))
}

pub(crate) fn with_arms_of(mut pose: Pose, other: &Pose) -> Option<Pose> {
    let turn = chest(&pose)? * chest(other)?.inverse();
    for arm in ARMS {
        let (here, there) = (pose[arm[0]]?.vector(), other[arm[0]]?.vector());
        for joint in arm {
            let way = turn * (other[joint]?.vector() - there);
            pose[joint] = Some(Position::from_vector(here + way));
        }
    }
    Some(pose)
}

/// Arms in any direction in which a shoulder lets them be, hands anyhow. Those that would go through the trunk stay as they were.
pub(crate) fn with_free_arms(mut pose: Pose, chance: &mut Chance) -> Option<Pose> {
    let chest = chest(&pose)?;
    let (mid, top) = (
        pose[Joint::SpineMid]?.vector(),
        pose[Joint::SpineShoulder]?.vector(),
    );
    for (side, arm) in [1.0, -1.0].into_iter().zip(ARMS) {
        let shoulder = pose[arm[0]]?.vector();
        let any = Vector3::new(
            chance.normal() + 0.4,
            chance.normal(),
            chance.normal() - 0.2,
        );
        let mut upper = chest.inverse() * (chest * any).try_normalize(1e-3)?;
        upper.y = side * (upper.y * side).max(-0.25);
        let upper = chest * upper.try_normalize(1e-3)?;
        // The forearm bends forwards and inwards.
        let bend = chance.between(0.05, 2.4);
        let towards = chest
            * Vector3::new(
                1.0 + 0.6 * chance.normal(),
                -0.6 * side * chance.unit(),
                0.7 * chance.normal(),
            );
        let across = (towards - upper * towards.dot(&upper)).try_normalize(1e-3)?;
        let fore = upper * bend.cos() + across * bend.sin();
        let palm = (fore + across * (0.4 * chance.normal())).try_normalize(1e-3)?;
        let thumb = palm.cross(&Vector3::new(
            chance.normal(),
            chance.normal(),
            chance.normal(),
        ));
        let thumb = (palm + thumb.try_normalize(1e-3)? * 0.8).try_normalize(1e-3)?;
        let elbow = shoulder + upper * 0.29;
        let wrist = elbow + fore * 0.25;
        let hand = wrist + palm * 0.09;
        let through = [elbow, wrist, hand].iter().any(|at| {
            let along = (at - mid).dot(&(top - mid)) / (top - mid).norm_squared();
            let off = chest.inverse() * (at - mid.lerp(&top, along));
            (-1.0..1.1).contains(&along) && (off.x / 0.14).hypot(off.y / 0.17) < 1.0
        });
        if through {
            continue;
        }
        let points = [
            shoulder,
            elbow,
            wrist,
            hand,
            hand + palm * 0.08,
            wrist + thumb * 0.07,
        ];
        for (joint, at) in arm.into_iter().zip(points) {
            pose[joint] = Some(Position::from_vector(at));
        }
    }
    Some(pose)
}

/// From the pelvis' axes (x forward, y left, z up) to the room's.
fn pelvis(pose: &Pose) -> Option<UnitQuaternion<f64>> {
    let at = |joint: Joint| pose[joint].map(|p| p.vector());
    let up = (at(Joint::SpineMid)? - at(Joint::SpineBase)?).try_normalize(1e-6)?;
    let left = at(Joint::HipLeft)? - at(Joint::HipRight)?;
    let left = (left - up * left.dot(&up)).try_normalize(1e-6)?;
    let axes = Matrix3::from_columns(&[left.cross(&up), left, up]);
    Some(UnitQuaternion::from_matrix(&axes))
}

pub(crate) fn with_legs_of(mut pose: Pose, other: &Pose) -> Option<Pose> {
    let floor = lowest(&pose)?;
    let turn = pelvis(&pose)? * pelvis(other)?.inverse();
    for leg in LEGS {
        let (here, there) = (pose[leg[0]]?.vector(), other[leg[0]]?.vector());
        for joint in leg {
            let way = turn * (other[joint]?.vector() - there);
            pose[joint] = Some(Position::from_vector(here + way));
        }
    }
    grounded(pose, floor)
}

/// Bent at the waist, mostly forwards, with some twist: half of it in either half of the spine.
pub(crate) fn bent(mut pose: Pose, chance: &mut Chance) -> Option<Pose> {
    let pelvis = pelvis(&pose)?;
    let angles = Vector3::new(
        0.25 * chance.normal(),
        chance.between(-0.3, 1.3),
        0.3 * chance.normal(),
    );
    let half = pelvis * UnitQuaternion::from_scaled_axis(angles / 2.0) * pelvis.inverse();
    for (about, keeps) in [
        (Joint::SpineBase, None),
        (Joint::SpineMid, Some(Joint::SpineMid)),
    ] {
        let about = pose[about]?.vector();
        for joint in Joint::ALL {
            let is_below = joint == Joint::SpineBase || LEGS.iter().any(|leg| leg.contains(&joint));
            if is_below || Some(joint) == keeps {
                continue;
            }
            let at = pose[joint]?.vector();
            pose[joint] = Some(Position::from_vector(about + half * (at - about)));
        }
    }
    Some(pose)
}

/// The whole person tilted any way, most a little, some until they lie, and on the floor again.
pub(crate) fn tilted(pose: Pose, chance: &mut Chance) -> Option<Pose> {
    let floor = lowest(&pose)?;
    let towards = chance.between(0.0, TAU);
    let angle = match chance.with(0.5) {
        true => 0.25 * chance.normal(),
        false => chance.between(0.4, 1.7),
    };
    let axis = Vector3::new(towards.cos(), towards.sin(), 0.0);
    let turn = UnitQuaternion::from_scaled_axis(axis * angle);
    let base = pose[Joint::SpineBase]?.vector();
    let turned = pose.map(|_, at| Position::from_vector(base + turn * (at.vector() - base)));
    grounded(turned, floor)
}

/// How high the lowest joint is, metres.
fn lowest(pose: &Pose) -> Option<f64> {
    pose.iter().map(|(_, at)| at.vector().z).reduce(f64::min)
}

fn grounded(pose: Pose, floor: f64) -> Option<Pose> {
    let lift = Vector3::z() * (floor - lowest(&pose)?);
    Some(pose.map(|_, at| Position::from_vector(at.vector() + lift)))
}
