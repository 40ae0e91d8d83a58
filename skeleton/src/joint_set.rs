//! Joint sets of the trackers in use, and how each maps into the canonical 25 joints.
//!
//! One table per set. Where a tracker's joint is not the same anatomical point as the canonical one, the
//! table says how it differs; calibration learns the offset. Left and right are the person's own throughout.
//! Names and orders: Kinect for Windows SDK 1.8 and 2.0 (`JointType`), NiTE 2.2 (`JointType`), Nuitrack
//! (`JointType` without the doubled collar), Azure Kinect Body Tracking (`k4abt_joint_id_t`), MediaPipe Pose.

use std::fmt;
use std::str::FromStr;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{Confidence, Joint, JointMap, Position, Sensor};

/// A tracker's own list of joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JointSet {
    /// Kinect v2 SDK, 25 joints: the canonical set.
    KinectV2,
    /// Kinect v1 SDK, 20 joints.
    KinectV1,
    /// NiTE 2, 15 joints.
    Nite,
    /// Nuitrack, 19 joints.
    Nuitrack,
    /// Azure Kinect Body Tracking, 32 joints.
    AzureKinect,
    /// BlazePose (MediaPipe Pose), 33 landmarks.
    BlazePose,
}

/// No joint set has this name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "unknown joint set `{0}`; known are kinect-v2, kinect-v1, nite, nuitrack, azure-kinect, blaze-pose"
)]
pub struct UnknownJointSet(pub String);

/// A joint as a tracker of any joint set reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawJoint {
    /// Where, metres, optical axes.
    pub position: Position<Sensor>,
    /// How much the tracker trusts it.
    pub confidence: Confidence,
}

/// How one canonical joint is made from a tracker's joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapping {
    /// The canonical joint.
    pub joint: Joint,
    /// Indices into the tracker's joints; the mean of several.
    pub from: &'static [usize],
    /// How the tracker's point differs from the canonical one; `None` where it is the same.
    pub difference: Option<&'static str>,
}

const fn same(joint: Joint, from: &'static [usize]) -> Mapping {
    Mapping {
        joint,
        from,
        difference: None,
    }
}

const fn differs(joint: Joint, from: &'static [usize], difference: &'static str) -> Mapping {
    Mapping {
        joint,
        from,
        difference: Some(difference),
    }
}

impl JointSet {
    /// Every joint set.
    pub const ALL: [Self; 6] = [
        Self::KinectV2,
        Self::KinectV1,
        Self::Nite,
        Self::Nuitrack,
        Self::AzureKinect,
        Self::BlazePose,
    ];

    /// The name used on the wire, in configuration and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::KinectV2 => "kinect-v2",
            Self::KinectV1 => "kinect-v1",
            Self::Nite => "nite",
            Self::Nuitrack => "nuitrack",
            Self::AzureKinect => "azure-kinect",
            Self::BlazePose => "blaze-pose",
        }
    }

    /// The tracker's joints, in the order its frames carry them.
    pub fn joint_names(self) -> &'static [&'static str] {
        match self {
            Self::KinectV2 => &KINECT_V2_NAMES,
            Self::KinectV1 => &KINECT_V1_NAMES,
            Self::Nite => &NITE_NAMES,
            Self::Nuitrack => &NUITRACK_NAMES,
            Self::AzureKinect => &AZURE_NAMES,
            Self::BlazePose => &BLAZE_NAMES,
        }
    }

    /// How many joints a frame of this set carries.
    pub fn joint_count(self) -> usize {
        self.joint_names().len()
    }

    /// How each canonical joint that this set can give is made.
    pub fn mappings(self) -> &'static [Mapping] {
        match self {
            Self::KinectV2 => &KINECT_V2,
            Self::KinectV1 => &KINECT_V1,
            Self::Nite => &NITE,
            Self::Nuitrack => &NUITRACK,
            Self::AzureKinect => &AZURE,
            Self::BlazePose => &BLAZE,
        }
    }

    /// A tracker's joints (in the order of [`JointSet::joint_names`]) as canonical joints.
    ///
    /// A canonical joint that is a mean needs all its parts and takes the lowest confidence among them.
    /// Joints beyond the slice's end count as missing.
    pub fn to_canonical(self, raw: &[Option<RawJoint>]) -> JointMap<RawJoint> {
        let joint = |mapping: &Mapping| {
            let (mut sum, mut confidence) = (Vector3::zeros(), Confidence::FULL);
            for &index in mapping.from {
                let part = raw.get(index).copied().flatten()?;
                sum += part.position.vector();
                if part.confidence < confidence {
                    confidence = part.confidence;
                }
            }
            let position = Position::from_vector(sum / mapping.from.len() as f64);
            Some((
                mapping.joint,
                RawJoint {
                    position,
                    confidence,
                },
            ))
        };
        self.mappings().iter().filter_map(joint).collect()
    }
}

impl fmt::Display for JointSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for JointSet {
    type Err = UnknownJointSet;

    fn from_str(name: &str) -> Result<Self, UnknownJointSet> {
        Self::ALL
            .into_iter()
            .find(|set| set.name() == name)
            .ok_or_else(|| UnknownJointSet(name.to_owned()))
    }
}

use Joint::*;

const KINECT_V2_NAMES: [&str; 25] = [
    "SpineBase",
    "SpineMid",
    "Neck",
    "Head",
    "ShoulderLeft",
    "ElbowLeft",
    "WristLeft",
    "HandLeft",
    "ShoulderRight",
    "ElbowRight",
    "WristRight",
    "HandRight",
    "HipLeft",
    "KneeLeft",
    "AnkleLeft",
    "FootLeft",
    "HipRight",
    "KneeRight",
    "AnkleRight",
    "FootRight",
    "SpineShoulder",
    "HandTipLeft",
    "ThumbLeft",
    "HandTipRight",
    "ThumbRight",
];

const KINECT_V2: [Mapping; 25] = [
    same(SpineBase, &[0]),
    same(SpineMid, &[1]),
    same(Neck, &[2]),
    same(Head, &[3]),
    same(ShoulderLeft, &[4]),
    same(ElbowLeft, &[5]),
    same(WristLeft, &[6]),
    same(HandLeft, &[7]),
    same(ShoulderRight, &[8]),
    same(ElbowRight, &[9]),
    same(WristRight, &[10]),
    same(HandRight, &[11]),
    same(HipLeft, &[12]),
    same(KneeLeft, &[13]),
    same(AnkleLeft, &[14]),
    same(FootLeft, &[15]),
    same(HipRight, &[16]),
    same(KneeRight, &[17]),
    same(AnkleRight, &[18]),
    same(FootRight, &[19]),
    same(SpineShoulder, &[20]),
    same(HandTipLeft, &[21]),
    same(ThumbLeft, &[22]),
    same(HandTipRight, &[23]),
    same(ThumbRight, &[24]),
];

const KINECT_V1_NAMES: [&str; 20] = [
    "HipCenter",
    "Spine",
    "ShoulderCenter",
    "Head",
    "ShoulderLeft",
    "ElbowLeft",
    "WristLeft",
    "HandLeft",
    "ShoulderRight",
    "ElbowRight",
    "WristRight",
    "HandRight",
    "HipLeft",
    "KneeLeft",
    "AnkleLeft",
    "FootLeft",
    "HipRight",
    "KneeRight",
    "AnkleRight",
    "FootRight",
];

const KINECT_V1: [Mapping; 20] = [
    differs(
        SpineBase,
        &[0],
        "HipCenter lies above the line between the hips",
    ),
    differs(SpineMid, &[1], "Spine lies lower, just above the pelvis"),
    same(SpineShoulder, &[2]),
    same(Head, &[3]),
    same(ShoulderLeft, &[4]),
    same(ElbowLeft, &[5]),
    same(WristLeft, &[6]),
    same(HandLeft, &[7]),
    same(ShoulderRight, &[8]),
    same(ElbowRight, &[9]),
    same(WristRight, &[10]),
    same(HandRight, &[11]),
    differs(HipLeft, &[12], "hips lie closer together and higher"),
    same(KneeLeft, &[13]),
    same(AnkleLeft, &[14]),
    same(FootLeft, &[15]),
    differs(HipRight, &[16], "hips lie closer together and higher"),
    same(KneeRight, &[17]),
    same(AnkleRight, &[18]),
    same(FootRight, &[19]),
];

const NITE_NAMES: [&str; 15] = [
    "Head",
    "Neck",
    "LeftShoulder",
    "RightShoulder",
    "LeftElbow",
    "RightElbow",
    "LeftHand",
    "RightHand",
    "Torso",
    "LeftHip",
    "RightHip",
    "LeftKnee",
    "RightKnee",
    "LeftFoot",
    "RightFoot",
];

const NITE: [Mapping; 16] = [
    same(Head, &[0]),
    differs(
        SpineShoulder,
        &[1],
        "NiTE's neck is the middle of the shoulder line",
    ),
    same(ShoulderLeft, &[2]),
    same(ShoulderRight, &[3]),
    same(ElbowLeft, &[4]),
    same(ElbowRight, &[5]),
    same(HandLeft, &[6]),
    same(HandRight, &[7]),
    differs(
        SpineMid,
        &[8],
        "NiTE's torso is the centre of the trunk, some centimetres in front of the spine",
    ),
    differs(
        SpineBase,
        &[9, 10],
        "the middle of the hips, below Kinect v2's pelvis joint",
    ),
    differs(HipLeft, &[9], "NiTE's hips lie lower, at the leg's root"),
    differs(HipRight, &[10], "NiTE's hips lie lower, at the leg's root"),
    same(KneeLeft, &[11]),
    same(KneeRight, &[12]),
    differs(AnkleLeft, &[13], "NiTE's foot lies between ankle and toes"),
    differs(AnkleRight, &[14], "NiTE's foot lies between ankle and toes"),
];

const NUITRACK_NAMES: [&str; 19] = [
    "Head",
    "Neck",
    "Torso",
    "Waist",
    "Collar",
    "LeftShoulder",
    "LeftElbow",
    "LeftWrist",
    "LeftHand",
    "RightShoulder",
    "RightElbow",
    "RightWrist",
    "RightHand",
    "LeftHip",
    "LeftKnee",
    "LeftAnkle",
    "RightHip",
    "RightKnee",
    "RightAnkle",
];

const NUITRACK: [Mapping; 19] = [
    same(Head, &[0]),
    same(Neck, &[1]),
    differs(
        SpineMid,
        &[2],
        "Nuitrack's torso lies higher, at the breastbone's end",
    ),
    differs(SpineBase, &[3], "Nuitrack's waist lies above the pelvis"),
    differs(
        SpineShoulder,
        &[4],
        "the collar joint lies in front of the spine",
    ),
    same(ShoulderLeft, &[5]),
    same(ElbowLeft, &[6]),
    same(WristLeft, &[7]),
    same(HandLeft, &[8]),
    same(ShoulderRight, &[9]),
    same(ElbowRight, &[10]),
    same(WristRight, &[11]),
    same(HandRight, &[12]),
    same(HipLeft, &[13]),
    same(KneeLeft, &[14]),
    same(AnkleLeft, &[15]),
    same(HipRight, &[16]),
    same(KneeRight, &[17]),
    same(AnkleRight, &[18]),
];

const AZURE_NAMES: [&str; 32] = [
    "Pelvis",
    "SpineNavel",
    "SpineChest",
    "Neck",
    "ClavicleLeft",
    "ShoulderLeft",
    "ElbowLeft",
    "WristLeft",
    "HandLeft",
    "HandTipLeft",
    "ThumbLeft",
    "ClavicleRight",
    "ShoulderRight",
    "ElbowRight",
    "WristRight",
    "HandRight",
    "HandTipRight",
    "ThumbRight",
    "HipLeft",
    "KneeLeft",
    "AnkleLeft",
    "FootLeft",
    "HipRight",
    "KneeRight",
    "AnkleRight",
    "FootRight",
    "Head",
    "Nose",
    "EyeLeft",
    "EarLeft",
    "EyeRight",
    "EarRight",
];

const AZURE: [Mapping; 25] = [
    differs(
        SpineBase,
        &[0],
        "Azure's pelvis lies inside the body, a few centimetres behind",
    ),
    differs(SpineMid, &[1], "SpineNavel lies lower"),
    differs(
        SpineShoulder,
        &[4, 11],
        "the middle of the clavicles' inner ends, below Kinect v2's SpineShoulder",
    ),
    same(Neck, &[3]),
    differs(
        Head,
        &[26],
        "Azure's head is the skull's base, Kinect v2's its middle",
    ),
    same(ShoulderLeft, &[5]),
    same(ElbowLeft, &[6]),
    same(WristLeft, &[7]),
    same(HandLeft, &[8]),
    same(HandTipLeft, &[9]),
    same(ThumbLeft, &[10]),
    same(ShoulderRight, &[12]),
    same(ElbowRight, &[13]),
    same(WristRight, &[14]),
    same(HandRight, &[15]),
    same(HandTipRight, &[16]),
    same(ThumbRight, &[17]),
    same(HipLeft, &[18]),
    same(KneeLeft, &[19]),
    same(AnkleLeft, &[20]),
    same(FootLeft, &[21]),
    same(HipRight, &[22]),
    same(KneeRight, &[23]),
    same(AnkleRight, &[24]),
    same(FootRight, &[25]),
];

const BLAZE_NAMES: [&str; 33] = [
    "nose",
    "left_eye_inner",
    "left_eye",
    "left_eye_outer",
    "right_eye_inner",
    "right_eye",
    "right_eye_outer",
    "left_ear",
    "right_ear",
    "mouth_left",
    "mouth_right",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_pinky",
    "right_pinky",
    "left_index",
    "right_index",
    "left_thumb",
    "right_thumb",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
    "left_heel",
    "right_heel",
    "left_foot_index",
    "right_foot_index",
];

const BLAZE: [Mapping; 23] = [
    differs(SpineBase, &[23, 24], "the middle of the hips"),
    differs(SpineShoulder, &[11, 12], "the middle of the shoulders"),
    differs(Head, &[7, 8], "the middle of the ears"),
    same(ShoulderLeft, &[11]),
    same(ShoulderRight, &[12]),
    same(ElbowLeft, &[13]),
    same(ElbowRight, &[14]),
    same(WristLeft, &[15]),
    same(WristRight, &[16]),
    differs(
        HandLeft,
        &[17, 19],
        "the middle of the little and index knuckles",
    ),
    differs(
        HandRight,
        &[18, 20],
        "the middle of the little and index knuckles",
    ),
    differs(HandTipLeft, &[19], "the index knuckle, not the tip"),
    differs(HandTipRight, &[20], "the index knuckle, not the tip"),
    differs(ThumbLeft, &[21], "the thumb's knuckle, not its tip"),
    differs(ThumbRight, &[22], "the thumb's knuckle, not its tip"),
    same(HipLeft, &[23]),
    same(HipRight, &[24]),
    same(KneeLeft, &[25]),
    same(KneeRight, &[26]),
    same(AnkleLeft, &[27]),
    same(AnkleRight, &[28]),
    same(FootLeft, &[31]),
    same(FootRight, &[32]),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_is_complete_unique_and_in_range() {
        let counts = [25, 20, 15, 19, 32, 33];
        for (set, count) in JointSet::ALL.into_iter().zip(counts) {
            assert_eq!(set.joint_count(), count, "{set}");
            assert_eq!(set.name().parse::<JointSet>().unwrap(), set);
            let mut seen = Vec::new();
            for mapping in set.mappings() {
                assert!(
                    !seen.contains(&mapping.joint),
                    "{set} maps {} twice",
                    mapping.joint
                );
                assert!(!mapping.from.is_empty() && mapping.from.iter().all(|&i| i < count));
                seen.push(mapping.joint);
            }
            assert!(seen.contains(&SpineBase), "{set} has no pelvis");
        }
    }

    #[test]
    fn sides_are_not_crossed() {
        let side = |name: &str| {
            let name = name.to_lowercase();
            (name.contains("left"), name.contains("right"))
        };
        for set in JointSet::ALL {
            for mapping in set
                .mappings()
                .iter()
                .filter(|mapping| mapping.from.len() == 1)
            {
                let theirs = set.joint_names()[mapping.from[0]];
                assert_eq!(
                    side(theirs),
                    side(mapping.joint.name()),
                    "{set}: {theirs} as {}",
                    mapping.joint
                );
            }
        }
    }

    #[test]
    fn a_mean_needs_all_its_parts_and_takes_the_lowest_trust() {
        let mut raw = vec![None; 33];
        let at = |x: f64, c: f32| {
            Some(RawJoint {
                position: Position::new(x, 0.0, 2.0),
                confidence: Confidence::new(c).unwrap(),
            })
        };
        raw[23] = at(0.0, 0.9);
        assert_eq!(JointSet::BlazePose.to_canonical(&raw)[SpineBase], None);
        raw[24] = at(0.2, 0.4);
        let base = JointSet::BlazePose.to_canonical(&raw)[SpineBase].unwrap();
        assert!((base.position.vector().x - 0.1).abs() < 1e-12 && base.confidence.get() == 0.4);
    }
}
