//! The robust start for one pair of sensors: where the second stands in the first one's frame.
//!
//! Single-frame alignments at evenly spaced instants (every combination of bodies, both labellings, a grid of time
//! offsets) compete in how many joints of other instants they bring together: RANSAC with the draws laid out
//! evenly, so that the same walk always gives the same answer. The best are refined by weighted Kabsch with robust
//! weights. A wrong pairing of people or labels fits its own frame only, because people move.

use nalgebra::Isometry3;
use posefuse_skeleton::{Position, Sensor, Transform};

use crate::kabsch::{PointPair, kabsch};
use crate::matching::{Match, Votes, agrees, common, match_bodies, vote};
use crate::tracks::{Pose, SensorTracks};

/// Spacing of the time offsets that are tried at the start, seconds: 1.5 m/s move 4 cm in half of it.
const OFFSET_STEP_S: f64 = 0.05;
/// Instants that give hypotheses; that judge all of them; that judge the best of them.
const DRAWS: usize = 40;
const QUICK: usize = 16;
const THOROUGH: usize = 80;
/// Most instants that are looked at: the bundle, not the start, must be exact.
const MOST: usize = 120;
/// Hypotheses that pass the quick round; that are refined.
const SHORT_LIST: usize = 40;
const REFINED: usize = 4;
/// Rounds of matching, re-weighting and fitting: at most, those with a wide scale, and the step (m, rad) that ends them.
const ROUNDS: usize = 12;
const WIDE_ROUNDS: usize = 3;
const SETTLED: f64 = 1e-3;
/// What an offset may move from where bodies were looked up, seconds: 1 mm of an arm that swings at 5 m/s^2.
const STALE_S: f64 = 0.02;
/// Bodies further apart than this are different people, metres: at the start, and once refined.
const START_REACH_M: f64 = 0.5;
pub(crate) const REACH_M: f64 = 0.6;
/// Fewest instants a pair must share to be tried, and least share of them that must agree to be believed.
const MIN_INSTANTS: usize = 5;
const MIN_AGREEING: f64 = 0.3;
/// Residual that counts as perfect when edges are compared, metres: below it trackers only repeat their bias.
const PERFECT_M: f64 = 0.02;

/// A pair's relation as it alone suggests it.
#[derive(Clone, Debug)]
pub(crate) struct PairStart {
    /// Takes points of the second sensor to the first one's frame.
    pub(crate) a_from_b: Isometry3<f64>,
    /// Added to the second sensor's stamps, against the first's, seconds.
    pub(crate) offset_s: f64,
    /// For the choice of the spanning tree: more and better agreement is more.
    pub(crate) quality: f64,
}

struct Hypothesis {
    a_from_b: Isometry3<f64>,
    offset: usize,
    score: f64,
}

/// Tries to relate two sensors at these instants; `None` where too little is shared or nothing agrees.
pub(crate) fn start(
    a: &SensorTracks,
    b: &SensorTracks,
    times: &[f64],
    max_offset_s: f64,
) -> Option<PairStart> {
    let steps = (max_offset_s / OFFSET_STEP_S).floor() as i32;
    let offsets: Vec<f64> = (-steps..=steps)
        .map(|i| f64::from(i) * OFFSET_STEP_S)
        .collect();
    let shared: Vec<f64> = times
        .iter()
        .copied()
        .filter(|time| a.sees_at(*time) && b.sees_at(*time))
        .collect();
    if shared.len() < MIN_INSTANTS {
        return None;
    }
    let all = shared.len();
    let shared: Vec<f64> = spread(all, MOST).into_iter().map(|i| shared[i]).collect();
    let seen_a = a.sample(&shared, 0.0);
    let seen_b: Vec<_> = offsets.iter().map(|tau| b.sample(&shared, *tau)).collect();
    let mut hypotheses = hypotheses(&seen_a, &seen_b);
    for (judges, keep) in [(QUICK, SHORT_LIST), (THOROUGH, REFINED)] {
        let judges = spread(shared.len(), judges);
        for hypothesis in &mut hypotheses {
            hypothesis.score = score(
                &seen_a,
                &seen_b[hypothesis.offset],
                &judges,
                &hypothesis.a_from_b,
            );
        }
        hypotheses.sort_by(|x, y| y.score.total_cmp(&x.score));
        hypotheses.truncate(keep);
    }
    hypotheses
        .iter()
        .filter_map(|h| {
            refine(
                &seen_a,
                (b, seen_b[h.offset].clone()),
                &shared,
                h.a_from_b,
                offsets[h.offset],
                max_offset_s,
            )
        })
        .max_by(|x, y| x.quality.total_cmp(&y.quality))
        .map(|start| PairStart {
            quality: start.quality * all as f64 / shared.len() as f64,
            ..start
        })
}

/// Single-frame alignments of every combination at evenly spaced instants.
fn hypotheses(seen_a: &[Vec<Pose>], seen_b: &[Vec<Vec<Pose>>]) -> Vec<Hypothesis> {
    let mut hypotheses = Vec::new();
    for instant in spread(seen_a.len(), DRAWS) {
        for (offset, seen_b) in seen_b.iter().enumerate() {
            for a in &seen_a[instant] {
                for b in &seen_b[instant] {
                    for mirrored in [false, true] {
                        let pairs: Vec<_> = point_pairs(a, b, mirrored).collect();
                        if let Ok(fit) = kabsch(&pairs) {
                            hypotheses.push(Hypothesis {
                                a_from_b: *fit.to_from_from.isometry(),
                                offset,
                                score: 0.0,
                            });
                        }
                    }
                }
            }
        }
    }
    hypotheses
}

fn point_pairs<'p>(
    a: &'p Pose,
    b: &'p Pose,
    mirrored: bool,
) -> impl Iterator<Item = PointPair<Sensor, Sensor>> + 'p {
    common(a, b, mirrored).map(|(_, p, q)| PointPair {
        to: Position::from_vector(p.at),
        from: Position::from_vector(q.at),
        weight: p.weight * q.weight,
    })
}

fn score(
    seen_a: &[Vec<Pose>],
    seen_b: &[Vec<Pose>],
    judges: &[usize],
    a_from_b: &Isometry3<f64>,
) -> f64 {
    let at = |instant: &usize| -> f64 {
        let (a, b) = (&seen_a[*instant], &seen_b[*instant]);
        match_bodies(a, b, a_from_b, START_REACH_M, None)
            .iter()
            .map(|found| found.score)
            .sum()
    };
    judges.iter().map(at).sum()
}

/// Weighted Kabsch over all instants with robust weights, and the time offset along the velocities, in turns.
fn refine(
    seen_a: &[Vec<Pose>],
    (b, mut seen_b): (&SensorTracks, Vec<Vec<Pose>>),
    times: &[f64],
    mut a_from_b: Isometry3<f64>,
    mut offset_s: f64,
    max_offset_s: f64,
) -> Option<PairStart> {
    // Between look-ups bodies are moved along their velocities.
    let mut looked_up_s = offset_s;
    for round in 0..ROUNDS {
        let votes = vote(seen_a, &seen_b, &a_from_b, REACH_M);
        let matches = matches(seen_a, &seen_b, &a_from_b, &votes);
        let mut pairs = Vec::new();
        let (mut along, mut speed) = (0.0, 0.0);
        let scale = robust_scale(seen_a, &seen_b, &matches, &a_from_b)
            * if round < WIDE_ROUNDS { 6.0 } else { 3.0 };
        for (instant, found) in &matches {
            let (pose_a, pose_b) = (&seen_a[*instant][found.a], &seen_b[*instant][found.b]);
            for (_, p, q) in common(pose_a, pose_b, found.mirrored) {
                let apart = p.at - a_from_b.transform_point(&q.at.into()).coords;
                let weight = p.weight * q.weight * robust_weight(apart.norm_squared(), scale);
                pairs.push(PointPair::<Sensor, Sensor> {
                    to: Position::from_vector(p.at),
                    from: Position::from_vector(q.at),
                    weight,
                });
                // A later stamp moves the sample back along its velocity.
                let velocity = -(a_from_b.rotation * q.velocity);
                along += weight * velocity.dot(&apart);
                speed += weight * velocity.norm_squared();
            }
        }
        let fit: Transform<Sensor, Sensor> = kabsch(&pairs).ok()?.to_from_from;
        let moved = a_from_b.inverse() * fit.isometry();
        let settled = moved.translation.vector.norm().max(moved.rotation.angle()) < SETTLED;
        a_from_b = *fit.isometry();
        if max_offset_s > 0.0 && speed > 0.0 {
            let step = (along / speed).clamp(-OFFSET_STEP_S, OFFSET_STEP_S);
            let before_s = offset_s;
            offset_s = (offset_s + step).clamp(-1.5 * max_offset_s, 1.5 * max_offset_s);
            if (offset_s - looked_up_s).abs() > STALE_S {
                seen_b = b.sample(times, offset_s);
                looked_up_s = offset_s;
            } else {
                let poses = seen_b.iter_mut().flatten();
                poses.for_each(|pose| pose.delay(offset_s - before_s));
            }
        }
        if settled && round > WIDE_ROUNDS {
            break;
        }
    }
    judge(seen_a, &seen_b, a_from_b, offset_s)
}

fn judge(
    seen_a: &[Vec<Pose>],
    seen_b: &[Vec<Pose>],
    a_from_b: Isometry3<f64>,
    offset_s: f64,
) -> Option<PairStart> {
    let shared = (seen_a.iter().zip(seen_b))
        .filter(|(a, b)| !a.is_empty() && !b.is_empty())
        .count();
    let votes = vote(seen_a, seen_b, &a_from_b, REACH_M);
    let matches = matches(seen_a, seen_b, &a_from_b, &votes);
    let mut agreeing = std::collections::BTreeSet::new();
    for (instant, found) in &matches {
        let (a, b) = (&seen_a[*instant][found.a], &seen_b[*instant][found.b]);
        if agrees(a, b, found.mirrored, &a_from_b) {
            agreeing.insert(*instant);
        }
    }
    let share = agreeing.len() as f64 / shared.max(1) as f64;
    let sigma = robust_scale(seen_a, seen_b, &matches, &a_from_b);
    let believed = agreeing.len() >= MIN_INSTANTS && share >= MIN_AGREEING;
    believed.then(|| PairStart {
        a_from_b,
        offset_s,
        quality: agreeing.len() as f64 * share / (sigma * sigma + PERFECT_M * PERFECT_M),
    })
}

/// All matches of all instants.
fn matches(
    seen_a: &[Vec<Pose>],
    seen_b: &[Vec<Pose>],
    a_from_b: &Isometry3<f64>,
    votes: &Votes,
) -> Vec<(usize, Match)> {
    let at = |(instant, (a, b)): (usize, (&Vec<Pose>, &Vec<Pose>))| {
        match_bodies(a, b, a_from_b, REACH_M, Some(votes))
            .into_iter()
            .map(move |found| (instant, found))
            .collect::<Vec<_>>()
    };
    seen_a.iter().zip(seen_b).enumerate().flat_map(at).collect()
}

fn robust_scale(
    seen_a: &[Vec<Pose>],
    seen_b: &[Vec<Pose>],
    matches: &[(usize, Match)],
    a_from_b: &Isometry3<f64>,
) -> f64 {
    let mut distances: Vec<f64> = matches
        .iter()
        .flat_map(|(instant, found)| {
            let (a, b) = (&seen_a[*instant][found.a], &seen_b[*instant][found.b]);
            common(a, b, found.mirrored)
                .map(|(_, p, q)| (p.at - a_from_b.transform_point(&q.at.into()).coords).norm())
        })
        .collect();
    sigma_of(&mut distances)
}

/// Standard deviation per axis behind these distances of 3D points, from their median; at least 0.1 mm.
pub(crate) fn sigma_of(distances: &mut [f64]) -> f64 {
    /// Median of the length of a 3D vector of unit normals.
    const MEDIAN_LENGTH: f64 = 1.538;
    crate::stats::median(distances).unwrap_or(0.0).max(1.5e-4) / MEDIAN_LENGTH
}

/// Geman-McClure: 1 at no distance, a quarter at distance `scale`.
pub(crate) fn robust_weight(distance_squared: f64, scale: f64) -> f64 {
    let ratio = 1.0 + distance_squared / (scale * scale);
    1.0 / (ratio * ratio)
}

/// Up to `count` indices, evenly spread over `0..len`.
fn spread(len: usize, count: usize) -> Vec<usize> {
    let count = count.min(len);
    (0..count)
        .map(|i| (2 * i + 1) * len / (2 * count))
        .collect()
}
