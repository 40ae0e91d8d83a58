//! Each sensor against the others, beyond residuals: whether it moved during the walk, and whether its metre is theirs.
//!
//! Motion: the walk is cut in two at several instants. For each part a robust rigid fit says where the sensor's joints lie
//! beside those of the others. What trackers do wrong, as far as it was not taken out, is in both parts and falls out of the difference, so that this
//! sees a bump of a few centimetres, which residuals hide. Scale: how wide the walk is in the sensor's eyes over how wide
//! it is in those of the others. Trackers differ by 10 % in a bone's length, but not in where somebody walked.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};
use posefuse_skeleton::{Joint, Position, Sensor};

use crate::kabsch::{PointPair, kabsch};
use crate::matching::{common, match_bodies};
use crate::pair::{robust_weight, sigma_of};
use crate::residual::Evidence;

/// Where the walk is cut, as shares of the sensor's shared instants.
const CUTS: [f64; 7] = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
/// Fewest instants in a part: the errors of a tracker live 0.4 s.
const MIN_INSTANTS: usize = 30;
/// Motion is told where the person walks: an instant counts once their middle is this far from where it was at the last
/// one that counted. What a tracker does wrong in one place, in one pose, would not fall out of the difference. Metres.
const STRIDE_M: f64 = 0.05;
/// Rounds of fitting, and the robust scale in standard deviations.
const ROUNDS: usize = 4;
const SCALE: f64 = 3.0;
/// Joints that are looked at for each sensor: more tell no more.
const JOINTS: usize = 4000;
/// Joints of one instant err together and instants 0.1 s apart do, too: this share of them counts.
const INDEPENDENT_SHARE: f64 = 0.03;
/// With several bodies in view, those further apart than this are not compared, metres.
const SEVERAL_REACH_M: f64 = 1.0;

/// The largest motion of a sensor during the walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// How far its picture of the people shifted, RMS, mm.
    pub(crate) by_mm: f64,
    /// How far it turned, degrees.
    pub(crate) turn_deg: f64,
    /// The same in standard deviations of what it can be told to: chance alone gives about 1.
    pub(crate) sigmas: f64,
    /// When, seconds since the walk's start.
    pub(crate) at_s: f64,
}

/// What the others say of a sensor.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Against {
    /// Its largest motion; `None` where too little was shared.
    pub(crate) motion: Option<Motion>,
    /// The length of what it saw over the length of the same as the others saw it; 1 where nothing was shared.
    pub(crate) scale: f64,
}

/// A joint as the sensor has it and as another one does, both in the sensor's axes, metres.
#[derive(Clone, Copy)]
struct Seen {
    instant: usize,
    own: Vector3<f64>,
    others: Vector3<f64>,
}

/// A rigid fit and what is known of it: turn and shift.
struct Fit {
    motion: Isometry3<f64>,
    information: Matrix6<f64>,
}

/// Each sensor against the others.
pub(crate) fn against(evidence: &Evidence<'_>) -> Vec<Against> {
    let against = |sensor: usize| {
        let seen = seen(evidence, sensor);
        let (walking, step) = thinned(walking(&seen));
        Against {
            motion: motion(&walking, step, evidence.spacing_s),
            scale: scale(&thinned(seen).0).unwrap_or(1.0),
        }
    };
    (0..evidence.names.len()).map(against).collect()
}

/// How much the person turned, 0..=1: the share of bodies whose line of shoulders and hips points, on the floor, more
/// than 30 degrees off its most common direction. Left and right exchanged make no difference.
pub(crate) fn turned(evidence: &Evidence<'_>) -> f64 {
    let mut angles = Vec::new();
    for (bodies, placed) in evidence.seen.iter().zip(evidence.placed) {
        let rotation = evidence.room_from_world.rotation * placed.world_from_sensor.rotation;
        for pose in bodies.iter().flatten() {
            let side = |left: Joint, right: Joint| {
                let (left, right) = (pose.joints[left as usize]?, pose.joints[right as usize]?);
                Some((rotation * (left.at - right.at)).xy())
            };
            let lines = side(Joint::ShoulderLeft, Joint::ShoulderRight)
                .zip(side(Joint::HipLeft, Joint::HipRight));
            if let Some(line) = lines.and_then(|(s, h)| (s + h).try_normalize(0.2)) {
                angles.push(line.y.atan2(line.x).to_degrees().rem_euclid(180.0));
            }
        }
    }
    let near = |middle: f64| {
        let off = |angle: &&f64| ((**angle - middle + 90.0).rem_euclid(180.0) - 90.0).abs();
        angles.iter().filter(|angle| off(angle) <= 30.0).count()
    };
    let most = (0..18).map(|tenth| near(f64::from(tenth) * 10.0)).max();
    1.0 - most.unwrap_or(0) as f64 / angles.len().max(1) as f64
}

/// Root of the ratio of the variances of what both saw, robustly weighted.
fn scale(seen: &[Seen]) -> Option<f64> {
    let fit = fit(seen)?;
    let apart = |s: &Seen| (fit.motion.transform_point(&s.own.into()).coords - s.others).norm();
    let sigma = sigma_of(&mut seen.iter().map(apart).collect::<Vec<_>>());
    let weights: Vec<f64> = seen
        .iter()
        .map(|s| robust_weight(apart(s).powi(2), SCALE * sigma))
        .collect();
    let total: f64 = weights.iter().sum();
    let variance = |of: fn(&Seen) -> Vector3<f64>| {
        let weighted = || {
            seen.iter()
                .zip(&weights)
                .map(|(s, weight)| (of(s), *weight))
        };
        let mean = weighted().map(|(p, w)| p * w).sum::<Vector3<f64>>() / total;
        weighted()
            .map(|(p, w)| (p - mean).norm_squared() * w)
            .sum::<f64>()
    };
    let (own, others) = (variance(|s| s.own), variance(|s| s.others));
    (others > 0.0).then(|| (own / others).sqrt())
}

fn seen(evidence: &Evidence<'_>, sensor: usize) -> Vec<Seen> {
    let own_from_world = evidence.placed[sensor].world_from_sensor.inverse();
    let mut all = Vec::new();
    for other in (0..evidence.names.len()).filter(|other| *other != sensor) {
        let own_from_other = own_from_world * evidence.placed[other].world_from_sensor;
        let both = evidence.seen[sensor].iter().zip(&evidence.seen[other]);
        for (instant, (bodies, of_other)) in both.enumerate() {
            let single = bodies.len() == 1 && of_other.len() == 1;
            let reach = if single {
                f64::INFINITY
            } else {
                SEVERAL_REACH_M
            };
            for found in match_bodies(bodies, of_other, &own_from_other, reach, None) {
                let (a, b) = (&bodies[found.a], &of_other[found.b]);
                all.extend(common(a, b, found.mirrored).map(|(_, p, q)| Seen {
                    instant,
                    own: p.at,
                    others: own_from_other.transform_point(&q.at.into()).coords,
                }));
            }
        }
    }
    all.sort_by_key(|seen| seen.instant);
    all
}

/// Every n-th of what was seen, so that not too much is left, and n.
fn thinned(seen: Vec<Seen>) -> (Vec<Seen>, usize) {
    let step = seen.len().div_ceil(JOINTS).max(1);
    (seen.into_iter().step_by(step).collect(), step)
}

/// What was seen at instants that count for motion.
fn walking(seen: &[Seen]) -> Vec<Seen> {
    let mut last: Option<Vector3<f64>> = None;
    let instants = seen.chunk_by(|a, b| a.instant == b.instant);
    let counted = instants.filter(|joints| {
        let middle = joints.iter().map(|s| s.own).sum::<Vector3<f64>>() / joints.len() as f64;
        let counts = last.is_none_or(|last| (middle - last).norm() >= STRIDE_M);
        if counts {
            last = Some(middle);
        }
        counts
    });
    counted.flatten().copied().collect()
}

/// The most certain motion; `seen` is every `step`-th joint.
fn motion(seen: &[Seen], step: usize, spacing_s: f64) -> Option<Motion> {
    let mut instants: Vec<usize> = seen.iter().map(|s| s.instant).collect();
    instants.dedup();
    if instants.len() < 2 * MIN_INSTANTS {
        return None;
    }
    let cuts = CUTS.iter().filter_map(|share| {
        let index = (instants.len() as f64 * share) as usize;
        let long_enough = index >= MIN_INSTANTS && instants.len() - index >= MIN_INSTANTS;
        long_enough.then(|| instants[index])
    });
    let between = |cut: usize| {
        let (first, last) = seen.split_at(seen.partition_point(|s| s.instant < cut));
        let (before, after) = (fit(first)?, fit(last)?);
        let change = before.motion.inverse() * after.motion;
        let squares = seen
            .iter()
            .map(|s| (change.transform_point(&s.own.into()).coords - s.own).norm_squared());
        let mean_square = squares.sum::<f64>() / seen.len() as f64;
        Some(Motion {
            by_mm: mean_square.sqrt() * 1e3,
            turn_deg: change.rotation.angle().to_degrees(),
            sigmas: sigmas(&before, &after)? * (step as f64).sqrt(),
            at_s: cut as f64 * spacing_s,
        })
    };
    cuts.filter_map(between)
        .max_by(|x, y| x.sigmas.total_cmp(&y.sigmas))
}

/// The weighted rigid motion from the sensor's own joints to the others', and its information.
fn fit(seen: &[Seen]) -> Option<Fit> {
    let mut motion = Isometry3::identity();
    let apart =
        |motion: &Isometry3<f64>, s: &Seen| motion.transform_point(&s.own.into()).coords - s.others;
    let mut sigma = 0.0;
    for _ in 0..ROUNDS {
        let mut distances: Vec<f64> = seen.iter().map(|s| apart(&motion, s).norm()).collect();
        sigma = sigma_of(&mut distances);
        let pairs: Vec<PointPair<Sensor, Sensor>> = seen
            .iter()
            .map(|s| PointPair {
                to: Position::from_vector(s.others),
                from: Position::from_vector(s.own),
                weight: robust_weight(apart(&motion, s).norm_squared(), SCALE * sigma),
            })
            .collect();
        motion = *kabsch(&pairs).ok()?.to_from_from.isometry();
    }
    let mut information = Matrix6::zeros();
    for s in seen {
        let weight = robust_weight(apart(&motion, s).norm_squared(), SCALE * sigma);
        let turned = s.own.cross_matrix();
        let corner = turned.transpose() * turned;
        let mut part = Matrix6::identity();
        part.fixed_view_mut::<3, 3>(0, 0).copy_from(&corner);
        part.fixed_view_mut::<3, 3>(0, 3).copy_from(&turned);
        part.fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&turned.transpose());
        information += part * (weight * INDEPENDENT_SHARE / (sigma * sigma));
    }
    Some(Fit {
        motion,
        information,
    })
}

/// Root of the mean squared normalised difference of two fits, over the six degrees of freedom.
fn sigmas(before: &Fit, after: &Fit) -> Option<f64> {
    let change = before.motion.inverse() * after.motion;
    let mut difference = Vector6::zeros();
    difference
        .fixed_rows_mut::<3>(0)
        .copy_from(&change.rotation.scaled_axis());
    difference
        .fixed_rows_mut::<3>(3)
        .copy_from(&change.translation.vector);
    let covariance = before.information.try_inverse()? + after.information.try_inverse()?;
    let square = difference.dot(&(covariance.try_inverse()? * difference));
    Some((square / 6.0).max(0.0).sqrt())
}
