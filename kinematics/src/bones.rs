//! The bones of the canonical rig: names as humanoid rigs use them, parents, and the joint at each origin.
//!
//! Every canonical joint is the origin of exactly one bone. Names are Unity's `HumanBodyBones`; the fingers move as one,
//! and `...End` marks where a last bone ends. `Hips` lies between the hip joints, in the pelvis that also carries
//! `SpineBase` (the origin of `Spine`); so no bone but the clavicles shares its origin with the bone that carries it.

use posefuse_skeleton::Joint;

/// How many bones the rig has.
pub(crate) const BONE_COUNT: usize = 32;

pub(crate) const HIPS: usize = 0;
pub(crate) const SPINE: usize = 1;
pub(crate) const CHEST: usize = 2;
pub(crate) const NECK: usize = 3;
pub(crate) const HEAD: usize = 4;
pub(crate) const HEAD_END: usize = 5;

/// The bones of an arm.
#[derive(Clone, Copy)]
pub(crate) struct ArmBones {
    pub(crate) clavicle: usize,
    pub(crate) upper: usize,
    pub(crate) lower: usize,
    pub(crate) hand: usize,
    pub(crate) fingers: usize,
    pub(crate) fingers_end: usize,
    pub(crate) thumb: usize,
    pub(crate) thumb_end: usize,
}

/// The bones of a leg.
#[derive(Clone, Copy)]
pub(crate) struct LegBones {
    pub(crate) upper: usize,
    pub(crate) lower: usize,
    pub(crate) foot: usize,
    pub(crate) toes: usize,
    pub(crate) toes_end: usize,
}

const fn arm(first: usize) -> ArmBones {
    ArmBones {
        clavicle: first,
        upper: first + 1,
        lower: first + 2,
        hand: first + 3,
        fingers: first + 4,
        fingers_end: first + 5,
        thumb: first + 6,
        thumb_end: first + 7,
    }
}

const fn leg(first: usize) -> LegBones {
    LegBones {
        upper: first,
        lower: first + 1,
        foot: first + 2,
        toes: first + 3,
        toes_end: first + 4,
    }
}

/// Left, right.
pub(crate) const ARMS: [ArmBones; 2] = [arm(6), arm(14)];
/// Left, right.
pub(crate) const LEGS: [LegBones; 2] = [leg(22), leg(27)];
/// Where Y points for the left and the right side: +1, -1.
pub(crate) const SIDES: [f64; 2] = [1.0, -1.0];

/// A bone's name, the index of the bone that carries it (its own for the root), and the joint at its origin.
pub(crate) struct Named {
    pub(crate) name: &'static str,
    pub(crate) parent: usize,
    pub(crate) joint: Option<Joint>,
}

const fn named(name: &'static str, parent: usize, joint: Option<Joint>) -> Named {
    Named {
        name,
        parent,
        joint,
    }
}

/// All bones, parents before children.
pub(crate) const BONES: [Named; BONE_COUNT] = {
    use Joint::*;
    let (la, ra, ll, rl) = (ARMS[0], ARMS[1], LEGS[0], LEGS[1]);
    [
        named("Hips", HIPS, None),
        named("Spine", HIPS, Some(SpineBase)),
        named("Chest", SPINE, Some(SpineMid)),
        named("Neck", CHEST, Some(SpineShoulder)),
        named("Head", NECK, Some(Neck)),
        named("HeadEnd", HEAD, Some(Head)),
        named("LeftShoulder", CHEST, None),
        named("LeftUpperArm", la.clavicle, Some(ShoulderLeft)),
        named("LeftLowerArm", la.upper, Some(ElbowLeft)),
        named("LeftHand", la.lower, Some(WristLeft)),
        named("LeftFingers", la.hand, Some(HandLeft)),
        named("LeftFingersEnd", la.fingers, Some(HandTipLeft)),
        named("LeftThumb", la.hand, None),
        named("LeftThumbEnd", la.thumb, Some(ThumbLeft)),
        named("RightShoulder", CHEST, None),
        named("RightUpperArm", ra.clavicle, Some(ShoulderRight)),
        named("RightLowerArm", ra.upper, Some(ElbowRight)),
        named("RightHand", ra.lower, Some(WristRight)),
        named("RightFingers", ra.hand, Some(HandRight)),
        named("RightFingersEnd", ra.fingers, Some(HandTipRight)),
        named("RightThumb", ra.hand, None),
        named("RightThumbEnd", ra.thumb, Some(ThumbRight)),
        named("LeftUpperLeg", HIPS, Some(HipLeft)),
        named("LeftLowerLeg", ll.upper, Some(KneeLeft)),
        named("LeftFoot", ll.lower, Some(AnkleLeft)),
        named("LeftToes", ll.foot, Some(FootLeft)),
        named("LeftToesEnd", ll.toes, None),
        named("RightUpperLeg", HIPS, Some(HipRight)),
        named("RightLowerLeg", rl.upper, Some(KneeRight)),
        named("RightFoot", rl.lower, Some(AnkleRight)),
        named("RightToes", rl.foot, Some(FootRight)),
        named("RightToesEnd", rl.toes, None),
    ]
};

/// For each canonical joint the bone whose origin it is.
pub(crate) const BONE_OF_JOINT: [usize; posefuse_skeleton::JOINT_COUNT] = {
    let mut table = [usize::MAX; posefuse_skeleton::JOINT_COUNT];
    let mut bone = 0;
    while bone < BONE_COUNT {
        if let Some(joint) = BONES[bone].joint {
            table[joint as usize] = bone;
        }
        bone += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_come_first_and_every_joint_has_one_bone() {
        for (index, bone) in BONES.iter().enumerate() {
            assert!(
                bone.parent < index || (index == HIPS && bone.parent == HIPS),
                "{}",
                bone.name
            );
        }
        for joint in Joint::ALL {
            let bones = BONES.iter().filter(|bone| bone.joint == Some(joint));
            assert_eq!(bones.count(), 1, "{joint}");
            assert_eq!(
                BONES[BONE_OF_JOINT[joint as usize]].joint,
                Some(joint),
                "{joint}"
            );
        }
    }

    #[test]
    fn sides_mirror_each_other() {
        for bone in &BONES {
            let Some(part) = bone.name.strip_prefix("Left") else {
                continue;
            };
            let other = BONES
                .iter()
                .find(|other| other.name == format!("Right{part}"))
                .unwrap();
            assert_eq!(bone.joint.map(Joint::mirrored), other.joint, "{part}");
        }
    }
}
