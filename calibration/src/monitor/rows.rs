//! One comparison taken apart: how far each sensor puts each joint from where the others put it.
//!
//! A sensor is held against the others only, so that its own error does not hide in what it is compared with. Room
//! axes, metres.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{Comparison, JOINT_COUNT, Joint, SensorId};

use super::Stand;
use super::motion::{Motion, Stats};

/// Standard deviation of a joint per axis at 3 m, noise that lives for some tenths of a second included, metres; it grows
/// with distance.
const SIGMA_AT_3_M: f64 = 0.012;
/// A sensor that disagrees with most of the others by so much counts a quarter in what they agree on, metres.
const CONSENSUS_M: f64 = 0.08;
/// A joint that moves against the rest of its body by so much counts a quarter, metres.
const JOINT_M: f64 = 0.045;
/// A body this far from where the others see it is another one, or badly tracked, metres.
const BODY_M: f64 = 0.25;
/// A tracker's errors live some 0.4 s and joints of a limb err together, so that looks 0.2 s apart count for so much.
const INDEPENDENT_SHARE: f64 = 0.3;
/// Size of a place, metres, and how many headings are told apart in it: within one, trackers repeat their bias.
const PLACE_M: f64 = 0.5;
const HEADINGS: f64 = 4.0;

/// Where a person stands and faces: floor cell and heading.
pub(super) type Place = (i16, i16, u8);

/// One sensor in one comparison.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pub(super) sensor: SensorId,
    /// What the joints say of how the sensor has moved.
    pub(super) stats: Stats,
    /// Each joint's distance from the others, metres.
    pub(super) distances: Vec<f64>,
}

/// One joint as one sensor puts it.
#[derive(Clone, Copy)]
struct Seen {
    view: usize,
    at: Vector3<f64>,
    variance: f64,
    weight: f64,
}

/// Every sensor of `comparison` against the others, each put right by what `moved` says of it, and where the person is.
pub(super) fn rows(
    comparison: &Comparison,
    stands: &BTreeMap<SensorId, Stand>,
    moved: &BTreeMap<SensorId, Motion>,
) -> Option<(Place, Vec<Rows>)> {
    let views: Vec<_> = comparison
        .views
        .iter()
        .filter_map(|view| Some((view, stands.get(&view.sensor)?)))
        .collect();
    if views.len() < 2 {
        return None;
    }
    let mut joints: [Vec<Seen>; JOINT_COUNT] =
        std::array::from_fn(|_| Vec::with_capacity(views.len()));
    for (index, (view, stand)) in views.iter().enumerate() {
        let motion = moved.get(&view.sensor);
        for (joint, position) in view.joints.iter() {
            let at = stand.room_from_sensor.apply(*position).vector();
            let shift = motion.map_or_else(Vector3::zeros, |m| m.at(at - stand.origin));
            let sigma = SIGMA_AT_3_M * (position.vector().norm() / 3.0).max(0.5);
            joints[joint as usize].push(Seen {
                view: index,
                at: at + shift,
                variance: sigma * sigma,
                weight: 0.0,
            });
        }
    }
    let mut agreed = [None; JOINT_COUNT];
    for (seen, agreed) in joints.iter_mut().zip(&mut agreed) {
        *agreed = consensus(seen);
    }
    let place = place(&agreed)?;
    let rows = views
        .iter()
        .enumerate()
        .filter_map(|(index, (view, stand))| {
            let (stats, distances) = against_others(index, stand, &joints)?;
            Some(Rows {
                sensor: view.sensor,
                stats,
                distances,
            })
        });
    Some((place, rows.collect()))
}

/// The robust mean of one joint; leaves in each view the weight it has in it.
fn consensus(seen: &mut [Seen]) -> Option<Vector3<f64>> {
    if seen.is_empty() {
        return None;
    }
    // From the middle one: a mean would begin half way to an outlier.
    let mut mean = Vector3::from_fn(|axis, _| {
        let mut values: Vec<f64> = seen.iter().map(|view| view.at[axis]).collect();
        middle(&mut values)
    });
    for _ in 0..3 {
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for view in seen.iter_mut() {
            view.weight = soft((view.at - mean).norm(), CONSENSUS_M) / view.variance;
            sum += view.at * view.weight;
            total += view.weight;
        }
        mean = sum / total;
    }
    Some(mean)
}

/// What view `index` says of its sensor's motion; `None` where too few joints can be compared.
fn against_others(index: usize, stand: &Stand, joints: &[Vec<Seen>]) -> Option<(Stats, Vec<f64>)> {
    let mut found: Vec<(Vector3<f64>, Vector3<f64>, f64)> = Vec::with_capacity(JOINT_COUNT);
    for seen in joints {
        let Some(own) = seen.iter().find(|s| s.view == index) else {
            continue;
        };
        let (mut sum, mut total, mut spread) = (Vector3::zeros(), 0.0, 0.0);
        for other in seen.iter().filter(|s| s.view != index) {
            sum += other.at * other.weight;
            total += other.weight;
            spread += other.weight * other.weight * other.variance;
        }
        if total > 0.0 {
            let variance = own.variance + spread / (total * total);
            found.push((own.at, sum / total - own.at, variance));
        }
    }
    if found.len() < 4 {
        return None;
    }
    let middle = Vector3::from_fn(|axis, _| {
        let mut values: Vec<f64> = found.iter().map(|(_, apart, _)| apart[axis]).collect();
        middle(&mut values)
    });
    let trust = soft(middle.norm(), BODY_M) * INDEPENDENT_SHARE;
    let mut stats = Stats::default();
    for (at, apart, variance) in &found {
        let weight = trust * soft((apart - middle).norm(), JOINT_M) / variance;
        stats.add(at - stand.origin, *apart, weight);
    }
    let distances = found.iter().map(|(_, apart, _)| apart.norm()).collect();
    Some((stats, distances))
}

/// The median; of an even number the mean of the two in the middle. 0 of nothing.
fn middle(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    match (values.get(values.len() / 2), values.len() % 2) {
        (Some(upper), 0) => 0.5 * (upper + values[values.len() / 2 - 1]),
        (Some(middle), _) => *middle,
        (None, _) => 0.0,
    }
}

/// Geman-McClure: 1 at no distance, a quarter at `scale`.
fn soft(distance: f64, scale: f64) -> f64 {
    crate::pair::robust_weight(distance * distance, scale)
}

fn place(agreed: &[Option<Vector3<f64>>; JOINT_COUNT]) -> Option<Place> {
    let of = |joint: Joint| agreed[joint as usize];
    let torso: Vec<Vector3<f64>> = Joint::TORSO.into_iter().filter_map(of).collect();
    if torso.is_empty() {
        return None;
    }
    let centre = torso.iter().sum::<Vector3<f64>>() / torso.len() as f64;
    let across = [
        (Joint::ShoulderLeft, Joint::ShoulderRight),
        (Joint::HipLeft, Joint::HipRight),
    ]
    .into_iter()
    .find_map(|(left, right)| Some(of(left)? - of(right)?));
    let heading = across.map_or(0.0, |across| {
        let turn = across.y.atan2(across.x) / std::f64::consts::TAU;
        (turn.rem_euclid(1.0) * HEADINGS)
            .floor()
            .min(HEADINGS - 1.0)
    });
    let cell = |metres: f64| (metres / PLACE_M).floor().clamp(-100.0, 100.0) as i16;
    Some((cell(centre.x), cell(centre.y), heading as u8))
}
