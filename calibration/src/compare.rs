//! How far sensors stand apart between two calibrations, whatever room frame each of them has.

use posefuse_skeleton::{Calibration, Position, Room, SensorPose, Transform};

use crate::stats::median;
use crate::{PointPair, kabsch};

/// Length of the axes that stand for a sensor's orientation beside its position, metres: a turn of 1 degree counts as
/// much as a shift of 17 mm, about what it does to a person at the usual distance.
const LEVER_M: f64 = 1.0;
/// Rounds of reweighting by distance, then by its square where there are three sensors or more: the majority decides.
/// And the distance below which a sensor's weight grows no more, metres.
const ROUNDS: [usize; 2] = [15, 20];
const CLOSE_M: f64 = 1e-4;

/// One sensor of two calibrations.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorMove {
    /// Its name.
    pub sensor: String,
    /// In which of the two it is, and how far it moved if it is in both.
    pub change: Change,
}

/// What became of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// It is in both.
    Moved {
        /// How far its place is off, mm.
        mm: f64,
        /// How far it is turned, degrees.
        deg: f64,
        /// How much later it is (negative: earlier) beside the other sensors, ms.
        ms: f64,
    },
    /// It is only in the second.
    MissingBefore,
    /// It is only in the first.
    MissingAfter,
}

/// Lays the room of `before` over that of `after` by the rigid motion that fits most of the sensors (iteratively
/// reweighted least squares), then says how far each is off, by name.
///
/// One sensor alone always fits, and of two nobody can tell which has moved: the difference is shared.
pub fn compare(before: &Calibration, after: &Calibration) -> Vec<SensorMove> {
    let both = |(name, old): (&String, &SensorPose)| {
        let new = after.sensors.get(name)?;
        Some((name.clone(), old.clone(), new.clone()))
    };
    let shared: Vec<_> = before.sensors.iter().filter_map(both).collect();
    let after_from_before = overlay(&shared);
    let delay_ms = |old: &SensorPose, new: &SensorPose| {
        new.time_offset_ns.saturating_sub(old.time_offset_ns) as f64 * 1e-6
    };
    let mut delays: Vec<f64> = shared.iter().map(|(_, a, b)| delay_ms(a, b)).collect();
    let common_ms = median(&mut delays).unwrap_or(0.0);
    let moved = shared.iter().map(|(name, old, new)| {
        let expected = after_from_before.then(&old.room_from_sensor);
        let (from, to) = (expected, new.room_from_sensor);
        SensorMove {
            sensor: name.clone(),
            change: Change::Moved {
                mm: from.origin().distance(to.origin()) * 1e3,
                deg: from.rotation().angle_to(&to.rotation()).to_degrees(),
                ms: delay_ms(old, new) - common_ms,
            },
        }
    });
    let only = |of: &Calibration, not: &Calibration, change| {
        let names = of.sensors.keys();
        let missing = names.filter(|name| !not.sensors.contains_key(*name));
        let row = |name: &String| SensorMove {
            sensor: name.clone(),
            change,
        };
        missing.map(row).collect::<Vec<_>>()
    };
    let mut moves: Vec<SensorMove> = moved.collect();
    moves.extend(only(before, after, Change::MissingAfter));
    moves.extend(only(after, before, Change::MissingBefore));
    moves.sort_by(|a, b| a.sensor.cmp(&b.sensor));
    moves
}

/// The motion that brings the first poses nearest to the second.
fn overlay(shared: &[(String, SensorPose, SensorPose)]) -> Transform<Room, Room> {
    let mut weights = vec![1.0; shared.len()];
    let mut best = Transform::identity();
    let squared = if shared.len() > 2 { ROUNDS[1] } else { 0 };
    for round in 0..ROUNDS[0] + squared {
        let pairs: Vec<PointPair<Room, Room>> = shared
            .iter()
            .zip(&weights)
            .flat_map(|((_, old, new), weight)| {
                let (from, to) = (marks(old), marks(new));
                from.into_iter().zip(to).map(|(from, to)| PointPair {
                    to,
                    from,
                    weight: *weight,
                })
            })
            .collect();
        // Four marks that span a sensor's axes always determine a motion; without a sensor there is nothing to lay over.
        let Ok(fit) = kabsch(&pairs) else {
            return best;
        };
        best = fit.to_from_from;
        for (weight, (_, old, new)) in weights.iter_mut().zip(shared) {
            let off = marks(old).into_iter().zip(marks(new));
            let squares: f64 = off.map(|(a, b)| best.apply(a).distance(b).powi(2)).sum();
            let distance = squares.sqrt().max(CLOSE_M);
            *weight = if round < ROUNDS[0] {
                1.0 / distance
            } else {
                distance.powi(-2)
            };
        }
    }
    best
}

/// A sensor's place and the ends of its axes.
fn marks(pose: &SensorPose) -> [Position<Room>; 4] {
    let at = |x, y, z| pose.room_from_sensor.apply(Position::new(x, y, z));
    [
        at(0.0, 0.0, 0.0),
        at(LEVER_M, 0.0, 0.0),
        at(0.0, LEVER_M, 0.0),
        at(0.0, 0.0, LEVER_M),
    ]
}
