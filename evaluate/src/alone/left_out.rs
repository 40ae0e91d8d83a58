//! Leave one sensor out: fuse without it, and compare what it measured itself.
//!
//! Its body is compared with the nearest fused person at the body's own capture time, joint by joint where the
//! sensor measured with trust. Both sides err, so that even perfect fusion keeps the left-out sensor's own error; it
//! is the same for every method. A left-out sensor that mirrors a person makes errors of its own, too: the median
//! bears it, the root mean square does not.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::Vector3;
use posefuse_fusion::Input;
use posefuse_skeleton::{
    Calibration, Joint, JointMap, Observation, Position, Room, RoomFrame, SIDE_PAIRS, SensorId,
    Timestamp, Track,
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

/// A body that a left-out sensor saw, room metres.
struct Seen {
    time: Timestamp,
    joints: JointMap<Vector3<f64>>,
}

/// Fuses `inputs` once without each sensor, and counts how far its trusted joints are from what the others make of
/// them: all distances, the median of each sensor, and how often left and right agree. `inputs` is asked once per
/// sensor.
pub fn leave_one_out<I: IntoIterator<Item = (Timestamp, Input)>>(
    method: &Method,
    inputs: &mut dyn FnMut() -> I,
    from: Timestamp,
) -> Tally {
    let sensors: BTreeSet<SensorId> = inputs()
        .into_iter()
        .filter_map(|(_, input)| match input {
            Input::Observation(observation) => Some(observation.sensor),
            _ => None,
        })
        .collect();
    let mut tally = Tally::default();
    if sensors.len() < 2 {
        return tally;
    }
    for sensor in sensors {
        let mut out = LeftOut::new(sensor);
        let mut frames = Vec::new();
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
                    && let Some(time) = engine.map_time(sensor, observation.captured)
                {
                    out.add(observation, time);
                }
                if let Input::Sensor(info) = input {
                    out.greet(info.id, &info.name);
                }
                if let Input::Calibration(calibration) = input {
                    out.calibration = Some(Arc::clone(calibration));
                }
            },
            &mut |frame| frames.push(frame),
        );
        out.compare(&frames, from, &mut tally);
    }
    tally
}

struct LeftOut {
    sensor: SensorId,
    name: String,
    calibration: Option<Arc<Calibration>>,
    seen: Vec<Seen>,
    last: Option<Observation>,
}

impl LeftOut {
    fn new(sensor: SensorId) -> Self {
        Self {
            sensor,
            name: String::new(),
            calibration: None,
            seen: Vec::new(),
            last: None,
        }
    }

    fn greet(&mut self, sensor: SensorId, name: &str) {
        if sensor == self.sensor {
            name.clone_into(&mut self.name);
        }
    }

    /// Notes the bodies of one of its frames, in the room.
    fn add(&mut self, observation: &Observation, time: Timestamp) {
        let pose = self.calibration.as_ref().and_then(|calibration| {
            let pose = calibration.sensors.get(&self.name)?;
            Some((pose.clone(), calibration.ray_bias_m.clone()))
        });
        let stale = |last: &Observation| last.bodies == observation.bodies;
        let repeated = self.last.as_ref().is_some_and(stale);
        self.last = Some(observation.clone());
        let Some((pose, ray_bias_m)) = pose.filter(|_| !repeated) else {
            return;
        };
        let origin = pose.room_from_sensor.origin().vector();
        for body in &observation.bodies {
            let joints = body.skeleton.filter_map(|joint, state| {
                if state.confidence.get() < TRUSTED || !state.position.is_finite() {
                    return None;
                }
                let at = pose.room_from_sensor.apply(state.position).vector();
                let away = (at - origin).try_normalize(1e-9)?;
                Some(at + away * ray_bias_m[joint].unwrap_or(0.0))
            });
            if joints.len() >= FEWEST_JOINTS {
                let time = time.plus_ns(pose.time_offset_ns);
                self.seen.push(Seen { time, joints });
            }
        }
    }

    fn compare(&self, frames: &[RoomFrame], from: Timestamp, tally: &mut Tally) {
        let mut own = Histogram::default();
        for seen in self.seen.iter().filter(|seen| seen.time >= from) {
            let Some(fused) = nearest(seen, frames) else {
                continue;
            };
            for (joint, measured) in seen.joints.iter() {
                if let Some(fused) = fused[joint] {
                    own.add((fused - measured).norm());
                }
            }
            if let Some(agree) = sides_agree(&seen.joints, &fused) {
                tally.left_out_sides.add(f64::from(u8::from(agree)));
            }
        }
        tally.left_out_medians.extend(own.quantile_m(0.5));
        tally.left_out.merge(&own);
    }
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
