//! A figure as VMC's root and bones: Unity's `HumanBodyBones`, each local to the one that carries it, the identity in the
//! T-pose.

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_kinematics::{Bone, Figure};
use rosc::OscType;

use super::Travel;
use crate::Axes;
use crate::packets::message;

/// Those bones of our rig that are Unity's, too.
const BONES: [&str; 21] = [
    "Hips",
    "Spine",
    "Chest",
    "Neck",
    "Head",
    "LeftShoulder",
    "LeftUpperArm",
    "LeftLowerArm",
    "LeftHand",
    "RightShoulder",
    "RightUpperArm",
    "RightLowerArm",
    "RightHand",
    "LeftUpperLeg",
    "LeftLowerLeg",
    "LeftFoot",
    "LeftToes",
    "RightUpperLeg",
    "RightLowerLeg",
    "RightFoot",
    "RightToes",
];
const SIDES: [&str; 2] = ["Left", "Right"];
/// Fingers, and where their knuckles are across the hand, as shares of its length, towards the thumb.
const FINGERS: [(&str, f64); 4] = [
    ("Index", 0.16),
    ("Middle", 0.05),
    ("Ring", -0.06),
    ("Little", -0.16),
];
/// The joints of a finger; how far each bone's origin is from the one before, as a share of the finger; how much of the
/// fingers' bend is its own. A fist bends all three.
const PHALANGES: [(&str, f64, f64); 3] = [
    ("Proximal", 0.0, 0.85),
    ("Intermediate", 0.5, 1.0),
    ("Distal", 0.28, 0.6),
];

/// Root and bones.
pub(super) fn messages(figure: &Figure, travel: Travel, fingers: bool) -> Vec<Vec<u8>> {
    let at = figure.pose.root.vector();
    let (root, hips) = match travel {
        Travel::Root => (Vector3::new(at.x, at.y, 0.0), Vector3::new(0.0, 0.0, at.z)),
        Travel::Hips => (Vector3::zeros(), at),
    };
    let still = UnitQuaternion::identity();
    let mut messages = vec![pose("/VMC/Ext/Root/Pos", "root", root, &still)];
    let bones = figure.rig.bones.iter().zip(&figure.pose.rotations);
    for (bone, rotation) in bones.filter(|(bone, _)| BONES.contains(&bone.name.as_str())) {
        let offset = match bone.parent {
            None => hips,
            Some(_) => bone.offset,
        };
        messages.push(one(&bone.name, offset, rotation));
    }
    if fingers {
        for (side, hand) in SIDES.into_iter().zip(figure.hands) {
            if hand.is_some() {
                hand_messages(figure, side, &mut messages);
            }
        }
    }
    messages
}

/// The fingers of one hand: our rig has them as one bone, and all of them bend like it.
fn hand_messages(figure: &Figure, side: &str, to: &mut Vec<Vec<u8>>) {
    let bone = |name: &str| -> Option<(&Bone, &UnitQuaternion<f64>)> {
        let name = format!("{side}{name}");
        let index = figure.rig.bones.iter().position(|bone| bone.name == name)?;
        Some((&figure.rig.bones[index], figure.pose.rotations.get(index)?))
    };
    let (Some((knuckles, bend)), Some((end, _))) = (bone("Fingers"), bone("FingersEnd")) else {
        return;
    };
    let length = knuckles.offset.norm() + end.offset.norm();
    for (finger, across) in FINGERS {
        // In the T-pose palms are down and thumbs ahead.
        let knuckle = knuckles.offset + Vector3::x() * (across * length);
        for (phalanx, along, share) in PHALANGES {
            let offset = match phalanx {
                "Proximal" => knuckle,
                _ => end.offset * along,
            };
            to.push(one(
                &format!("{side}{finger}{phalanx}"),
                offset,
                &bend.powf(share),
            ));
        }
    }
    if let Some((thumb, turn)) = bone("Thumb") {
        to.push(one(&format!("{side}ThumbProximal"), thumb.offset, turn));
    }
}

fn one(name: &str, offset: Vector3<f64>, rotation: &UnitQuaternion<f64>) -> Vec<u8> {
    pose("/VMC/Ext/Bone/Pos", name, offset, rotation)
}

fn pose(
    address: &str,
    name: &str,
    offset: Vector3<f64>,
    rotation: &UnitQuaternion<f64>,
) -> Vec<u8> {
    let place = Axes::Unity.from_room() * offset;
    let turn = Axes::Unity.rotation(rotation);
    let numbers = place.iter().copied().chain(turn.coords.iter().copied());
    let numbers = numbers.map(|number| OscType::Float(number as f32));
    let name = OscType::String(name.to_owned());
    message(address, std::iter::once(name).chain(numbers).collect())
}
