//! What is hidden: which joints, for how long, and where in which recording.

use posefuse_skeleton::{BONES, Joint};
use serde::Serialize;

use super::motion::{Motion, RATE_HZ};

/// How long joints are hidden, seconds.
pub const GAPS_S: [f64; 4] = [0.2, 0.5, 1.0, 2.0];
/// So many poses are seen before each gap at least, and after it.
const BEFORE: usize = 30;
const AFTER: usize = 15;
/// From one gap to the next one, poses; each begins up to half of that later.
const EVERY: usize = 30;

/// A part of the body that is hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyPart {
    /// An arm from the elbow on.
    Arm,
    /// A leg from the knee on.
    Leg,
    /// Both legs from the knees on.
    BothLegs,
    /// The arm and the leg of one side.
    Side,
}

impl BodyPart {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Arm, Self::Leg, Self::BothLegs, Self::Side];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Leg => "leg",
            Self::BothLegs => "both legs",
            Self::Side => "side",
        }
    }

    /// Bits of its joints, by number. The left one where there are two.
    fn joints(self) -> u32 {
        use Joint::*;
        let bits = |joints: &[Joint]| {
            joints
                .iter()
                .fold(0, |bits, joint| bits | 1 << *joint as u32)
        };
        let arm = bits(&[ElbowLeft, WristLeft, HandLeft, HandTipLeft, ThumbLeft]);
        let leg = bits(&[KneeLeft, AnkleLeft, FootLeft]);
        match self {
            Self::Arm => arm,
            Self::Leg => leg,
            Self::BothLegs => leg | bits(&[KneeRight, AnkleRight, FootRight]),
            Self::Side => arm | leg,
        }
    }
}

/// A part of the body hidden for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Gap {
    /// Number of the motion.
    pub(super) motion: usize,
    /// Its first hidden pose, and how many are.
    pub(super) start: usize,
    pub(super) length: usize,
    /// Bits of the hidden joints.
    pub(super) hidden: u32,
    /// Whether the person is shown as in a mirror.
    pub(super) mirrored: bool,
}

impl Gap {
    /// The pose after the last hidden one.
    pub(super) fn end(&self) -> usize {
        self.start + self.length
    }

    /// Whether joint number `index` is hidden.
    pub(super) fn hides(&self, index: usize) -> bool {
        self.hidden & 1 << index != 0
    }

    /// The bones of which at least one end is hidden.
    pub(super) fn bones(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let gap = *self;
        let ends = BONES.map(|bone| (bone.parent as usize, bone.child as usize));
        ends.into_iter()
            .filter(move |(a, b)| gap.hides(*a) || gap.hides(*b))
    }
}

/// One gap of `gap_s` for every second of each motion, somewhere in it: of the left part and, the person mirrored, of what
/// looks like the left part and is the right one. The same for every method.
pub(super) fn gaps(motions: &[&Motion], part: BodyPart, gap_s: f64, every: usize) -> Vec<Gap> {
    let length = (gap_s * RATE_HZ).round() as usize;
    let mut gaps = Vec::new();
    for (motion, own) in motions.iter().enumerate() {
        let last = own.count().saturating_sub(length + AFTER);
        let mut slot = BEFORE;
        while slot <= last {
            let chance = scrambled(motion as u64 ^ (slot as u64) << 20 ^ (length as u64) << 50);
            gaps.push(Gap {
                motion,
                start: (slot + (chance >> 1) as usize % (EVERY / 2)).min(last),
                length,
                hidden: part.joints(),
                mirrored: chance & 1 == 1,
            });
            slot += EVERY * every;
        }
    }
    gaps
}

/// A number that looks as if it came by chance (SplitMix64).
fn scrambled(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
