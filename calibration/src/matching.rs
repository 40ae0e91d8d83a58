//! Which body of one sensor is which body of another at an instant, and with which labelling of left and right.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint};

use crate::tracks::{Point, Pose};

/// Joints of the same person closer than this agree, metres.
pub(crate) const INLIER_M: f64 = 0.12;
/// Fewest joints two bodies must have in common to be compared.
const MIN_JOINTS: usize = 4;

/// Two bodies taken to be one person.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Match {
    /// Index among the first sensor's bodies.
    pub(crate) a: usize,
    /// Index among the second sensor's bodies.
    pub(crate) b: usize,
    /// Whether the second sensor has left and right exchanged against the first.
    pub(crate) mirrored: bool,
    /// Sum over joints of weight / (1 + distance^2 / (12 cm)^2).
    pub(crate) score: f64,
}

/// For two sensors' tracks, how well they agreed over the whole walk.
pub(crate) type Votes = BTreeMap<(usize, usize), f64>;

/// Index of the joint that one sensor calls `joint`, in the labels of the other.
pub(crate) fn other_side(joint: usize, mirrored: bool) -> usize {
    if mirrored {
        Joint::ALL[joint].mirrored() as usize
    } else {
        joint
    }
}

/// The joints that both bodies have: canonical index, the point of `a`, the point of `b`.
pub(crate) fn common<'p>(
    a: &'p Pose,
    b: &'p Pose,
    mirrored: bool,
) -> impl Iterator<Item = (usize, &'p Point, &'p Point)> {
    (0..JOINT_COUNT).filter_map(move |joint| {
        let other = other_side(joint, mirrored);
        Some((joint, a.joints[joint].as_ref()?, b.joints[other].as_ref()?))
    })
}

/// The better labelling of `b` against `a` and its score; `None` where too few joints are common.
pub(crate) fn compare(a: &Pose, b: &Pose, a_from_b: &Isometry3<f64>) -> Option<(bool, f64)> {
    let placed: [Option<Vector3<f64>>; JOINT_COUNT] = std::array::from_fn(|joint| {
        b.joints[joint]
            .as_ref()
            .map(|p| a_from_b.rotation * p.at + a_from_b.translation.vector)
    });
    let score = |mirrored: bool| {
        let (mut score, mut count) = (0.0, 0);
        for joint in 0..JOINT_COUNT {
            let other = other_side(joint, mirrored);
            if let (Some(p), Some(q), Some(of_b)) =
                (&a.joints[joint], placed[other], &b.joints[other])
            {
                let square = (p.at - q).norm_squared();
                score += p.weight * of_b.weight / (1.0 + square / (INLIER_M * INLIER_M));
                count += 1;
            }
        }
        (count >= MIN_JOINTS).then_some(score)
    };
    match (score(false), score(true)) {
        (Some(same), Some(other)) if other > same => Some((true, other)),
        (Some(same), _) => Some((false, same)),
        (None, Some(other)) => Some((true, other)),
        (None, None) => None,
    }
}

/// Pairs up the bodies of an instant, the best first, each at most once. Bodies whose centres lie further apart
/// than `reach_m` are different people. Tracks that agreed over the walk go before those that meet by chance.
pub(crate) fn match_bodies(
    a: &[Pose],
    b: &[Pose],
    a_from_b: &Isometry3<f64>,
    reach_m: f64,
    votes: Option<&Votes>,
) -> Vec<Match> {
    let mut candidates = Vec::new();
    for (ia, pose_a) in a.iter().enumerate() {
        for (ib, pose_b) in b.iter().enumerate() {
            let apart = (a_from_b.rotation * pose_b.centre + a_from_b.translation.vector
                - pose_a.centre)
                .norm();
            if apart > reach_m {
                continue;
            }
            if let Some((mirrored, score)) = compare(pose_a, pose_b, a_from_b) {
                let key = (pose_a.track, pose_b.track);
                let vote = votes.and_then(|v| v.get(&key)).copied().unwrap_or(0.0);
                let found = Match {
                    a: ia,
                    b: ib,
                    mirrored,
                    score,
                };
                candidates.push((vote, found));
            }
        }
    }
    candidates.sort_by(|(vote_x, x), (vote_y, y)| {
        (vote_y.total_cmp(vote_x)).then(y.score.total_cmp(&x.score))
    });
    let mut matches: Vec<Match> = Vec::new();
    for (_, found) in candidates {
        if matches.iter().all(|m| m.a != found.a && m.b != found.b) {
            matches.push(found);
        }
    }
    matches
}

/// How well each two tracks agree over all instants.
pub(crate) fn vote(
    a: &[Vec<Pose>],
    b: &[Vec<Pose>],
    a_from_b: &Isometry3<f64>,
    reach_m: f64,
) -> Votes {
    let mut votes = Votes::new();
    for (bodies_a, bodies_b) in a.iter().zip(b) {
        for found in match_bodies(bodies_a, bodies_b, a_from_b, reach_m, None) {
            let key = (bodies_a[found.a].track, bodies_b[found.b].track);
            *votes.entry(key).or_default() += found.score;
        }
    }
    votes
}

/// Whether most of the joints that both bodies have lie within 12 cm.
pub(crate) fn agrees(a: &Pose, b: &Pose, mirrored: bool, a_from_b: &Isometry3<f64>) -> bool {
    let (mut near, mut all) = (0, 0);
    for (_, p, q) in common(a, b, mirrored) {
        let apart = p.at - a_from_b.transform_point(&q.at.into()).coords;
        near += u32::from(apart.norm_squared() < INLIER_M * INLIER_M);
        all += 1;
    }
    2 * near > all
}
