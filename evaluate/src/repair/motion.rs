//! Recorded motion that may be tested on: 30 poses a second, cut where the recording jumps.

use nalgebra::Vector3;
use posefuse_simulator::motion::Clip;
use posefuse_skeleton::{BONES, JOINT_COUNT, Joint};

use super::split::Tests;

/// Poses per second.
pub(super) const RATE_HZ: f64 = 30.0;
/// A pelvis is never faster, m/s.
const FASTEST_ROOT_MPS: f64 = 8.0;
/// Nor is any joint against it, m/s.
const FASTEST_LIMB_MPS: f64 = 14.0;
/// No bone of a person changes its length by more than this share and this much, metres.
const BONE_CHANGE: f64 = 0.15;
const BONE_CHANGE_M: f64 = 0.02;
/// Shorter stretches are of no use, poses.
const SHORTEST: usize = 30;

/// All joints of one pose, room metres.
pub(super) type Pose = [Vector3<f64>; JOINT_COUNT];

/// A stretch of a recording without jumps.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// The recording.
    pub name: String,
    /// What it tests.
    pub tests: Tests,
    poses: Vec<Pose>,
}

impl Motion {
    /// The stretches of `clip` that do not jump and in which every joint is known. `place` is the recording's path below
    /// the folder of recordings.
    pub fn of(clip: Clip, place: &str, tests: Tests) -> Vec<Self> {
        let count = (clip.duration_s() * RATE_HZ).floor() as usize + 1;
        let pose = |index: usize| -> Option<Pose> {
            let joints = clip.pose(index as f64 / RATE_HZ);
            let mut pose = [Vector3::zeros(); JOINT_COUNT];
            for joint in Joint::ALL {
                pose[joint as usize] = joints[joint]?.vector();
            }
            Some(pose)
        };
        let poses: Vec<Option<Pose>> = (0..count).map(pose).collect();
        let stretch = |poses: Vec<Pose>| Self {
            name: place.to_owned(),
            tests,
            poses,
        };
        let stretches = clean(&poses).into_iter();
        stretches.map(stretch).collect()
    }

    /// How long it is, seconds.
    pub fn duration_s(&self) -> f64 {
        self.poses.len() as f64 / RATE_HZ
    }

    /// The poses as they are, or as a mirror shows them: left is right, and y changes its sign.
    pub(super) fn poses(&self, mirrored: bool) -> Vec<Pose> {
        if !mirrored {
            return self.poses.clone();
        }
        let mirror = |pose: &Pose| {
            Joint::ALL.map(|joint| {
                let at = pose[joint.mirrored() as usize];
                Vector3::new(at.x, -at.y, at.z)
            })
        };
        self.poses.iter().map(mirror).collect()
    }

    /// How many poses.
    pub(super) fn count(&self) -> usize {
        self.poses.len()
    }
}

/// The stretches between poses that cannot be true.
fn clean(poses: &[Option<Pose>]) -> Vec<Vec<Pose>> {
    let usual = usual_lengths(poses);
    let mut stretches: Vec<Vec<Pose>> = Vec::new();
    let mut own: Vec<Pose> = Vec::new();
    for pose in poses {
        let true_bones = pose.as_ref().filter(|pose| {
            let found = lengths(pose).into_iter().zip(&usual);
            found
                .into_iter()
                .all(|(found, usual)| (found - usual).abs() <= BONE_CHANGE * usual + BONE_CHANGE_M)
        });
        let jumped = match (true_bones, own.last()) {
            (Some(pose), Some(last)) => jumps(last, pose),
            _ => true,
        };
        if jumped {
            stretches.push(std::mem::take(&mut own));
        }
        // The pose after a jump begins the next stretch.
        own.extend(true_bones);
    }
    stretches.push(own);
    stretches.retain(|stretch| stretch.len() >= SHORTEST);
    stretches
}

fn lengths(pose: &Pose) -> [f64; BONES.len()] {
    BONES.map(|bone| (pose[bone.parent as usize] - pose[bone.child as usize]).norm())
}

/// The median length of each bone, metres.
fn usual_lengths(poses: &[Option<Pose>]) -> [f64; BONES.len()] {
    let all: Vec<[f64; BONES.len()]> = poses.iter().flatten().map(lengths).collect();
    std::array::from_fn(|bone| {
        let mut own: Vec<f64> = all.iter().map(|lengths| lengths[bone]).collect();
        own.sort_by(f64::total_cmp);
        own.get(own.len() / 2).copied().unwrap_or(0.0)
    })
}

fn jumps(from: &Pose, to: &Pose) -> bool {
    const ROOT: usize = Joint::SpineBase as usize;
    let root = to[ROOT] - from[ROOT];
    let fastest = from.iter().zip(to).map(|(a, b)| (b - a - root).norm());
    root.norm() * RATE_HZ > FASTEST_ROOT_MPS
        || fastest.fold(0.0, f64::max) * RATE_HZ > FASTEST_LIMB_MPS
}
