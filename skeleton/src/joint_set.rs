//! Joint sets of the trackers in use, and how each maps into the canonical 25 joints.
//!
//! One table per set. Where a tracker's joint is not the same anatomical point as the canonical one, the
//! table says how it differs; calibration learns the offset. Left and right are the person's own throughout.
//! The tables are in `tables.rs`.

mod tables;

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
            Self::KinectV2 => &tables::KINECT_V2_NAMES,
            Self::KinectV1 => &tables::KINECT_V1_NAMES,
            Self::Nite => &tables::NITE_NAMES,
            Self::Nuitrack => &tables::NUITRACK_NAMES,
            Self::AzureKinect => &tables::AZURE_NAMES,
            Self::BlazePose => &tables::BLAZE_NAMES,
        }
    }

    /// How many joints a frame of this set carries.
    pub fn joint_count(self) -> usize {
        self.joint_names().len()
    }

    /// How each canonical joint that this set can give is made.
    pub fn mappings(self) -> &'static [Mapping] {
        match self {
            Self::KinectV2 => &tables::KINECT_V2,
            Self::KinectV1 => &tables::KINECT_V1,
            Self::Nite => &tables::NITE,
            Self::Nuitrack => &tables::NUITRACK,
            Self::AzureKinect => &tables::AZURE,
            Self::BlazePose => &tables::BLAZE,
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
            assert!(seen.contains(&Joint::SpineBase), "{set} has no pelvis");
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
        assert_eq!(
            JointSet::BlazePose.to_canonical(&raw)[Joint::SpineBase],
            None
        );
        raw[24] = at(0.2, 0.4);
        let base = JointSet::BlazePose.to_canonical(&raw)[Joint::SpineBase].unwrap();
        assert!((base.position.vector().x - 0.1).abs() < 1e-12 && base.confidence.get() == 0.4);
    }
}
