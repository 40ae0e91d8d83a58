//! Leave one sensor out: fuse without it, and compare what it measured itself.
//!
//! Its body is compared with the nearest fused person at the body's own capture time, joint by joint where the
//! sensor measured with trust. Time and place of the body are those that the engine under test would give it
//! ([`Engine::locate`]): how far a method's people are from a sensor that it takes as it takes all others. Both sides
//! err, so that even perfect fusion keeps the left-out sensor's own error; it is the same for every method. A left-out
//! sensor that mirrors a person makes errors of its own, too: the median bears it, the root mean square does not.
//!
//! Methods are compared on the same bodies and joints ([`left_out_alike`]): one that shows nobody where it is difficult
//! would else have the smaller distances.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use posefuse_fusion::{Engine, Input};
use posefuse_skeleton::{
    Joint, JointMap, Observation, Position, Room, RoomFrame, SIDE_PAIRS, SensorId, Timestamp, Track,
};

use crate::compare::FURTHEST_MATCH_M;
use crate::fuse::fuse_watched;
use crate::histogram::Histogram;
use crate::methods::Method;
use crate::tally::Tally;

/// Fused frames further apart than this say nothing of the time between, nanoseconds.
const LONGEST_GAP_NS: i64 = 100_000_000;
/// Joints of at least this confidence are measured with trust.
const TRUSTED: f32 = 0.75;
/// Bodies with fewer such joints are not compared.
const FEWEST_JOINTS: usize = 5;

/// How far one method's people are from what each sensor measured that had no part in them. The bodies are the same for
/// every method and in the same order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeftOut {
    sensors: Vec<Vec<Away>>,
}

/// A left-out sensor's body beside the fused person.
#[derive(Clone, Debug, Default, PartialEq)]
struct Away {
    /// From each of its trusted joints to the fused one, metres; empty where nobody was fused.
    joints: JointMap<f32>,
    /// Whether left and right agree, where there is enough to tell.
    sides: Option<bool>,
}

/// A body that a left-out sensor saw: its trusted joints, room metres.
struct Seen {
    time: Timestamp,
    joints: JointMap<Vector3<f64>>,
}

/// Fuses `inputs` once without each sensor, and notes how far the bodies that it saw from `from` on are from what the
/// others make of them. `inputs` is asked once per sensor. Of fewer than two sensors none can be left out.
pub fn leave_one_out<I: IntoIterator<Item = (Timestamp, Input)>>(
    method: &Method,
    inputs: &mut dyn FnMut() -> I,
    from: Timestamp,
) -> LeftOut {
    let sensors: BTreeSet<SensorId> = inputs()
        .into_iter()
        .filter_map(|(_, input)| match input {
            Input::Observation(observation) => Some(observation.sensor),
            _ => None,
        })
        .collect();
    if sensors.len() < 2 {
        return LeftOut::default();
    }
    let without = |sensor: SensorId| {
        let (mut seen, mut frames) = (Vec::new(), Vec::new());
        let mut last: Option<Observation> = None;
        let kept = inputs().into_iter().map(|(time, input)| {
            let own = matches!(&input, Input::Observation(o) if o.sensor == sensor);
            // A tick in its place tells the engine how late it is, and nothing else.
            (time, if own { Err(input) } else { Ok(input) })
        });
        fuse_watched(
            method,
            kept,
            |engine, input| {
                if let Input::Observation(observation) = input
                    && observation.sensor == sensor
                    && observation.received >= from
                {
                    // A frame that repeats the last one tells of no time.
                    let stale = |last: &Observation| last.bodies == observation.bodies;
                    if !last.as_ref().is_some_and(stale) {
                        note(engine, observation, &mut seen);
                    }
                    last = Some(observation.clone());
                }
            },
            &mut |frame| frames.push(frame),
        );
        let away = |seen: &Option<Seen>| {
            let away = seen.as_ref().and_then(|seen| away(seen, &frames));
            away.unwrap_or_default()
        };
        seen.iter().map(away).collect()
    };
    LeftOut {
        sensors: sensors.into_iter().map(without).collect(),
    }
}

/// What several methods on the same inputs count for on the joints of bodies that all of them fused: all distances, the
/// median of each sensor, and how often left and right agree.
pub fn left_out_alike(methods: &[LeftOut]) -> Vec<Tally> {
    let mut tallies = vec![Tally::default(); methods.len()];
    let sensors = methods.iter().map(|method| method.sensors.len());
    for sensor in 0..sensors.min().unwrap_or(0) {
        let of = |method: &LeftOut| method.sensors[sensor].len();
        let bodies = methods.iter().map(of).min().unwrap_or(0);
        let mut own = vec![Histogram::default(); methods.len()];
        for body in 0..bodies {
            let all: Vec<&Away> = methods.iter().map(|m| &m.sensors[sensor][body]).collect();
            let everywhere = |joint: &Joint| all.iter().all(|away| away.joints[*joint].is_some());
            for joint in Joint::ALL.into_iter().filter(everywhere) {
                for (away, own) in all.iter().zip(&mut own) {
                    own.add(f64::from(away.joints[joint].unwrap_or_default()));
                }
            }
            if all.iter().all(|away| away.sides.is_some()) {
                for (away, tally) in all.iter().zip(&mut tallies) {
                    let agree = away.sides == Some(true);
                    tally.left_out_sides.add(f64::from(u8::from(agree)));
                }
            }
        }
        for (own, tally) in own.iter().zip(&mut tallies) {
            tally.left_out_medians.extend(own.quantile_m(0.5));
            tally.left_out.merge(own);
        }
    }
    tallies
}

/// Notes the bodies of a frame that the engine did not get: `None` where it could not tell where they are.
fn note(engine: &Engine, observation: &Observation, seen: &mut Vec<Option<Seen>>) {
    let located = engine.locate(observation);
    for (index, body) in observation.bodies.iter().enumerate() {
        let trusted = body.skeleton.filter_map(|_, state| {
            let measured = state.confidence.get() >= TRUSTED && state.position.is_finite();
            measured.then_some(())
        });
        if trusted.len() < FEWEST_JOINTS {
            continue;
        }
        seen.push(located.as_ref().map(|(time, bodies)| Seen {
            time: *time,
            joints: trusted.filter_map(|joint, ()| Some(bodies[index].position(joint)?.vector())),
        }));
    }
}

/// How far the body is from the nearest fused person.
fn away(seen: &Seen, frames: &[RoomFrame]) -> Option<Away> {
    let fused = nearest(seen, frames)?;
    let distance = |joint: Joint, measured: &Vector3<f64>| {
        let fused: Vector3<f64> = fused[joint]?;
        Some((fused - measured).norm() as f32)
    };
    Some(Away {
        joints: seen.joints.filter_map(distance),
        sides: sides_agree(&seen.joints, &fused),
    })
}
/// The joints of the fused person nearest to the body at its time.
fn nearest(seen: &Seen, frames: &[RoomFrame]) -> Option<JointMap<Vector3<f64>>> {
    let after = frames.partition_point(|frame| frame.time < seen.time);
    let (next, before) = (frames.get(after)?, frames.get(after.checked_sub(1)?)?);
    let gap_ns = next.time.since_ns(before.time);
    if gap_ns > LONGEST_GAP_NS {
        return None;
    }
    let share = seen.time.since_ns(before.time) as f64 / gap_ns.max(1) as f64;
    let between = |track: &Track| {
        let later = next.tracks.iter().find(|later| later.id == track.id)?;
        Some(track.skeleton.filter_map(|joint, state| {
            let to = later.skeleton.position(joint)?;
            Some(Position::<Room>::lerp(state.position, to, share).vector())
        }))
    };
    let distance = |joints: &JointMap<Vector3<f64>>| {
        let distances = seen.joints.iter();
        let distances = distances.filter_map(|(joint, at)| Some((joints[joint]? - at).norm()));
        let (sum, count) = distances.fold((0.0, 0.0), |(s, c), d| (s + d, c + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    before
        .tracks
        .iter()
        .filter_map(between)
        .filter_map(|joints| Some((distance(&joints)?, joints)))
        .filter(|(distance, _)| *distance <= FURTHEST_MATCH_M)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, joints)| joints)
}

/// Whether the body is nearer to the fused person as it is than mirrored; `None` where too little is there to tell.
fn sides_agree(body: &JointMap<Vector3<f64>>, fused: &JointMap<Vector3<f64>>) -> Option<bool> {
    let (mut as_is, mut mirrored, mut count) = (0.0, 0.0, 0);
    let sided = SIDE_PAIRS.iter().flat_map(|(left, right)| [*left, *right]);
    for joint in sided {
        let other: Joint = joint.mirrored();
        if let (Some(own), Some(same), Some(opposite)) = (body[joint], fused[joint], fused[other]) {
            as_is += (own - same).norm();
            mirrored += (own - opposite).norm();
            count += 1;
        }
    }
    (count >= FEWEST_JOINTS).then_some(as_is <= mirrored)
}
