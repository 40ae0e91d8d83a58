//! What tools call the bones of a body, so that they find them by themselves.

use serde::{Deserialize, Serialize};

use crate::choice::choices;

choices! {
    /// A custom of naming bones.
    Names, "bone names" {
        /// Unity's humanoid bones, VRM: `LeftUpperArm`.
        Humanoid = "humanoid",
        /// MotionBuilder, most BVH files: `LeftArm`.
        MotionBuilder = "motionbuilder",
        /// Mixamo: `mixamorig:LeftArm`.
        Mixamo = "mixamo",
        /// Unreal's mannequin: `upperarm_l`.
        Unreal = "unreal",
        /// The joint of Kinect v2 where the bone begins: `ShoulderLeft`.
        Kinect = "kinect",
    }
}

/// A bone without its side: as the rig calls it, then as MotionBuilder, Mixamo, Unreal and Kinect do.
type Row = [&'static str; 5];

const MIDDLE: [Row; 6] = [
    ["Hips", "Hips", "Hips", "pelvis", "Pelvis"],
    ["Spine", "Spine", "Spine", "spine_01", "SpineBase"],
    ["Chest", "Spine1", "Spine1", "spine_02", "SpineMid"],
    ["Neck", "Neck", "Neck", "neck_01", "SpineShoulder"],
    ["Head", "Head", "Head", "head", "Neck"],
    ["HeadEnd", "HeadEnd", "HeadTop_End", "head_end", "Head"],
];

const SIDED: [Row; 13] = [
    ["Shoulder", "Shoulder", "Shoulder", "clavicle", "Clavicle"],
    ["UpperArm", "Arm", "Arm", "upperarm", "Shoulder"],
    ["LowerArm", "ForeArm", "ForeArm", "lowerarm", "Elbow"],
    ["Hand", "Hand", "Hand", "hand", "Wrist"],
    ["Fingers", "HandMiddle1", "HandMiddle1", "middle_01", "Hand"],
    [
        "FingersEnd",
        "HandMiddle4",
        "HandMiddle4",
        "middle_end",
        "HandTip",
    ],
    ["Thumb", "HandThumb1", "HandThumb1", "thumb_01", "ThumbBase"],
    ["ThumbEnd", "HandThumb4", "HandThumb4", "thumb_end", "Thumb"],
    ["UpperLeg", "UpLeg", "UpLeg", "thigh", "Hip"],
    ["LowerLeg", "Leg", "Leg", "calf", "Knee"],
    ["Foot", "Foot", "Foot", "foot", "Ankle"],
    ["Toes", "ToeBase", "ToeBase", "ball", "Foot"],
    ["ToesEnd", "ToeEnd", "Toe_End", "ball_end", "Toes"],
];

impl Names {
    /// What the bone that the rig calls `bone` is called; a bone that is in no table keeps its name.
    pub fn of_bone(self, bone: &str) -> String {
        let (left, right) = (bone.strip_prefix("Left"), bone.strip_prefix("Right"));
        let row = match left.or(right) {
            Some(part) => SIDED.iter().find(|row| row[0] == part),
            None => MIDDLE.iter().find(|row| row[0] == bone),
        };
        let Some(row) = row else {
            return bone.to_owned();
        };
        let side = match (left, right) {
            (Some(_), _) => ["Left", "l"],
            (None, Some(_)) => ["Right", "r"],
            (None, None) => ["", ""],
        };
        match self {
            Self::Humanoid => bone.to_owned(),
            Self::MotionBuilder => format!("{}{}", side[0], row[1]),
            Self::Mixamo => format!("mixamorig:{}{}", side[0], row[2]),
            Self::Unreal if side[1].is_empty() => row[3].to_owned(),
            Self::Unreal => format!("{}_{}", row[3], side[1]),
            Self::Kinect => format!("{}{}", row[4], side[0]),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn tools_find_their_own_names() {
        for (names, bone, expected) in [
            (Names::Humanoid, "LeftUpperArm", "LeftUpperArm"),
            (Names::MotionBuilder, "LeftUpperArm", "LeftArm"),
            (Names::Mixamo, "RightLowerLeg", "mixamorig:RightLeg"),
            (Names::Unreal, "RightFoot", "foot_r"),
            (Names::Unreal, "Chest", "spine_02"),
            (Names::Kinect, "LeftHand", "WristLeft"),
            (Names::Unreal, "Tail", "Tail"),
        ] {
            assert_eq!(names.of_bone(bone), expected);
        }
    }

    #[test]
    fn no_two_bones_share_a_name() {
        for names in Names::ALL {
            let sides = ["Left", "Right"];
            let sided = sides
                .iter()
                .flat_map(|side| SIDED.iter().map(move |row| format!("{side}{}", row[0])));
            let all: Vec<String> = MIDDLE
                .iter()
                .map(|row| row[0].to_owned())
                .chain(sided)
                .collect();
            let named: BTreeSet<String> = all.iter().map(|bone| names.of_bone(bone)).collect();
            assert_eq!(named.len(), all.len(), "{names}");
        }
    }
}
