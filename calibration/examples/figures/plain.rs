//! What the papers of this field do: one alignment by SVD per pair of sensors, along a tree.
//!
//! Every joint of the nearest frames of two sensors, the first body of each, no time offset, labels as they come, no
//! robustness. With a least confidence of 0.75 it is the filter of Menard (2014).

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use posefuse_calibration::{PointPair, SensorWalk, Walk, kabsch};
use posefuse_skeleton::{Calibration, Sensor, SensorPose, Transform};

/// Frames further apart are not compared, ns: half a frame at 30 Hz.
const NEAREST_NS: i64 = 17_000_000;

/// The sensors' poses in the first one's frame; those that no chain of views joins are left out.
pub(crate) fn solve(walk: &Walk, least_confidence: f32) -> Calibration {
    let count = walk.sensors.len();
    let mut edges = BTreeMap::new();
    for a in 0..count {
        for b in a + 1..count {
            let pairs = pairs(&walk.sensors[a], &walk.sensors[b], least_confidence);
            if let Ok(fit) = kabsch(&pairs) {
                edges.insert((a, b), (pairs.len(), *fit.to_from_from.isometry()));
            }
        }
    }
    let mut placed = BTreeMap::from([(0, Isometry3::identity())]);
    // Prim's tree, by how much each pair shares.
    while let Some((&(a, b), (_, a_from_b))) = edges
        .iter()
        .filter(|((a, b), _)| placed.contains_key(a) != placed.contains_key(b))
        .max_by_key(|(pair, (shared, _))| (*shared, std::cmp::Reverse(**pair)))
    {
        if let Some(pose) = placed.get(&a) {
            placed.insert(b, pose * a_from_b);
        } else {
            placed.insert(a, placed[&b] * a_from_b.inverse());
        }
    }
    let pose = |(sensor, pose): (usize, Isometry3<f64>)| {
        let pose = SensorPose {
            room_from_sensor: Transform::from_isometry(pose),
            ..SensorPose::default()
        };
        (walk.sensors[sensor].name.clone(), pose)
    };
    Calibration {
        sensors: placed.into_iter().map(pose).collect(),
        ..Calibration::default()
    }
}

pub(crate) fn pairs(a: &SensorWalk, b: &SensorWalk, least: f32) -> Vec<PointPair<Sensor, Sensor>> {
    let mut pairs = Vec::new();
    for frame in &b.frames {
        let next = a.frames.partition_point(|f| f.time < frame.time);
        let around = a.frames[next.saturating_sub(1)..].iter().take(2);
        let nearest = around.min_by_key(|f| f.time.since_ns(frame.time).abs());
        let near = nearest.filter(|f| f.time.since_ns(frame.time).abs() <= NEAREST_NS);
        let Some((to, from)) = near
            .and_then(|f| f.bodies.first())
            .zip(frame.bodies.first())
        else {
            continue;
        };
        for (joint, from) in from.joints.iter() {
            if let Some(to) = &to.joints[joint]
                && from.confidence.get() >= least
                && to.confidence.get() >= least
            {
                pairs.push(PointPair {
                    to: to.position,
                    from: from.position,
                    weight: 1.0,
                });
            }
        }
    }
    pairs
}
