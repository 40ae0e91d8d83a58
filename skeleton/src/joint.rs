//! The canonical joints: the 25 of Kinect v2, which every tool of this field can map.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// How many canonical joints there are.
pub const JOINT_COUNT: usize = 25;

macro_rules! joints {
    ($($joint:ident),* $(,)?) => {
        /// A canonical joint, in the order of the Kinect v2 SDK. Left and right are the person's own.
        #[allow(missing_docs)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Joint { $($joint),* }

        impl Joint {
            /// All joints, in canonical order.
            pub const ALL: [Self; JOINT_COUNT] = [$(Self::$joint),*];

            /// The name, as the Kinect v2 SDK spells it.
            pub fn name(self) -> &'static str {
                match self { $(Self::$joint => stringify!($joint)),* }
            }
        }
    };
}

joints! {
    SpineBase, SpineMid, Neck, Head,
    ShoulderLeft, ElbowLeft, WristLeft, HandLeft,
    ShoulderRight, ElbowRight, WristRight, HandRight,
    HipLeft, KneeLeft, AnkleLeft, FootLeft,
    HipRight, KneeRight, AnkleRight, FootRight,
    SpineShoulder, HandTipLeft, ThumbLeft, HandTipRight, ThumbRight,
}

impl Joint {
    /// The joints that move least against each other.
    pub const TORSO: [Self; 7] = [
        Self::SpineBase,
        Self::SpineMid,
        Self::SpineShoulder,
        Self::ShoulderLeft,
        Self::ShoulderRight,
        Self::HipLeft,
        Self::HipRight,
    ];

    /// The same joint on the other side of the body; the joint itself on the middle line.
    pub const fn mirrored(self) -> Self {
        MIRRORED[self as usize]
    }

    /// The next joint towards [`Joint::SpineBase`], which itself has none.
    pub fn parent(self) -> Option<Self> {
        BONES
            .iter()
            .find(|bone| bone.child == self)
            .map(|bone| bone.parent)
    }
}

impl fmt::Display for Joint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Joint {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|joint| joint.name() == name).ok_or_else(|| {
            format!("no joint is called `{name}`; the joints are those of Kinect v2, e.g. `WristLeft`")
        })
    }
}

/// The joints that come in pairs, the person's left one first: the six pairs of arms and shoulders, then the four of
/// legs and hips.
pub const SIDE_PAIRS: [(Joint, Joint); 10] = {
    use Joint::*;
    [
        (ShoulderLeft, ShoulderRight),
        (ElbowLeft, ElbowRight),
        (WristLeft, WristRight),
        (HandLeft, HandRight),
        (HandTipLeft, HandTipRight),
        (ThumbLeft, ThumbRight),
        (HipLeft, HipRight),
        (KneeLeft, KneeRight),
        (AnkleLeft, AnkleRight),
        (FootLeft, FootRight),
    ]
};

/// The joints of the left and the right arm, from the shoulder out; tip and thumb both hang on the hand.
pub const ARMS: [[Joint; 6]; 2] = {
    use Joint::*;
    [
        [
            ShoulderLeft,
            ElbowLeft,
            WristLeft,
            HandLeft,
            HandTipLeft,
            ThumbLeft,
        ],
        [
            ShoulderRight,
            ElbowRight,
            WristRight,
            HandRight,
            HandTipRight,
            ThumbRight,
        ],
    ]
};

/// The joints of the left and the right leg, from the hip down.
pub const LEGS: [[Joint; 4]; 2] = {
    use Joint::*;
    [
        [HipLeft, KneeLeft, AnkleLeft, FootLeft],
        [HipRight, KneeRight, AnkleRight, FootRight],
    ]
};

/// For each joint the one on the other side.
const MIRRORED: [Joint; JOINT_COUNT] = {
    let mut table = Joint::ALL;
    let mut pair = 0;
    while pair < SIDE_PAIRS.len() {
        let (left, right) = SIDE_PAIRS[pair];
        table[left as usize] = right;
        table[right as usize] = left;
        pair += 1;
    }
    table
};

/// Two joints at a fixed distance in a living body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bone {
    /// The end nearer to the pelvis.
    pub parent: Joint,
    /// The end further away.
    pub child: Joint,
}

const fn bone(parent: Joint, child: Joint) -> Bone {
    Bone { parent, child }
}

/// The bones of the canonical skeleton: a tree rooted at [`Joint::SpineBase`], parents before children.
pub const BONES: [Bone; JOINT_COUNT - 1] = {
    use Joint::*;
    [
        bone(SpineBase, SpineMid),
        bone(SpineMid, SpineShoulder),
        bone(SpineShoulder, Neck),
        bone(Neck, Head),
        bone(SpineShoulder, ShoulderLeft),
        bone(ShoulderLeft, ElbowLeft),
        bone(ElbowLeft, WristLeft),
        bone(WristLeft, HandLeft),
        bone(HandLeft, HandTipLeft),
        bone(WristLeft, ThumbLeft),
        bone(SpineShoulder, ShoulderRight),
        bone(ShoulderRight, ElbowRight),
        bone(ElbowRight, WristRight),
        bone(WristRight, HandRight),
        bone(HandRight, HandTipRight),
        bone(WristRight, ThumbRight),
        bone(SpineBase, HipLeft),
        bone(HipLeft, KneeLeft),
        bone(KneeLeft, AnkleLeft),
        bone(AnkleLeft, FootLeft),
        bone(SpineBase, HipRight),
        bone(HipRight, KneeRight),
        bone(KneeRight, AnkleRight),
        bone(AnkleRight, FootRight),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirroring_twice_changes_nothing_and_names_round_trip() {
        for (index, joint) in Joint::ALL.into_iter().enumerate() {
            assert_eq!(joint as usize, index);
            assert_eq!(joint.mirrored().mirrored(), joint);
            assert_eq!(joint.name().parse::<Joint>().unwrap(), joint);
        }
        assert!("Nose".parse::<Joint>().is_err());
    }

    #[test]
    fn pairs_are_what_the_names_say() {
        for joint in Joint::ALL {
            let name = joint.name();
            let other = match (name.strip_suffix("Left"), name.strip_suffix("Right")) {
                (Some(part), _) => format!("{part}Right"),
                (_, Some(part)) => format!("{part}Left"),
                _ => name.to_owned(),
            };
            assert_eq!(joint.mirrored().name(), other);
        }
    }

    #[test]
    fn bones_are_a_tree_with_parents_first() {
        let mut seen = vec![Joint::SpineBase];
        for bone in BONES {
            assert!(
                seen.contains(&bone.parent) && !seen.contains(&bone.child),
                "{bone:?}"
            );
            seen.push(bone.child);
        }
        assert_eq!(seen.len(), JOINT_COUNT);
    }
}
