//! One sensor's view as tracks over time, and its bodies interpolated at any instant.
//!
//! Times are seconds since the walk's start on the server's clock. A sensor's time offset is added to its stamps,
//! so that what it saw at the true instant `t` bears the stamp `t - offset`.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{JOINT_COUNT, Joint, Timestamp};

use crate::{SensorWalk, WalkBody};

/// Confidence from which a joint counts: what Kinect v2 calls tracked is 1, what it infers 0.5 (after Menard 2014).
const TRUSTED: f64 = 0.75;
/// Where a sensor has fewer trusted joints than this share, its confidences are taken as a relative weight only.
const TRUSTED_SHARE: f64 = 0.2;
/// Frames further apart than this are not interpolated, seconds: two lost frames at 30 Hz.
const MAX_GAP_S: f64 = 0.11;
/// Half the span of the frames that a place and a velocity are fitted to, seconds: three frames at 30 Hz.
const WINDOW_S: f64 = 0.105;
/// Frames that lie further from that fit (root mean square) are no motion of a body, metres.
const MAX_ROUGH_M: f64 = 0.06;
/// Speed above which a joint is a tracker's jump, not a motion, m/s.
const MAX_SPEED: f64 = 5.0;
/// No sensor of this class sees further, metres.
const MAX_RANGE_M: f64 = 20.0;

/// One joint at an instant, in the sensor's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// Metres.
    pub(crate) at: Vector3<f64>,
    /// Metres per second; zero where it is not known.
    pub(crate) velocity: Vector3<f64>,
    /// How much it counts, above 0 and up to 1.
    pub(crate) weight: f64,
}

/// One body at an instant.
#[derive(Clone, Debug)]
pub(crate) struct Pose {
    /// Which of the sensor's tracks it belongs to.
    pub(crate) track: usize,
    /// The mean of its torso joints, or of all if there are none.
    pub(crate) centre: Vector3<f64>,
    /// Its joints, in canonical order.
    pub(crate) joints: [Option<Point>; JOINT_COUNT],
}

/// Everything one sensor saw.
#[derive(Clone, Debug)]
pub(crate) struct SensorTracks {
    pub(crate) name: String,
    tracks: Vec<Track>,
}

#[derive(Clone, Debug, Default)]
struct Track {
    times: Vec<f64>,
    frames: Vec<Frame>,
}

type Frame = [Option<(Vector3<f64>, f64)>; JOINT_COUNT];

impl SensorTracks {
    /// Sorts the frames into tracks by tracking id. Stale repeats of a frame, frames of a time already seen and
    /// joints that cannot be are left out.
    pub(crate) fn new(walk: &SensorWalk, start: Timestamp) -> Self {
        let threshold = trust_threshold(walk);
        let mut order: Vec<_> = walk.frames.iter().collect();
        order.sort_by_key(|frame| frame.time);
        let mut tracks: BTreeMap<u64, Track> = BTreeMap::new();
        for frame in order {
            let time = frame.time.since_seconds(start);
            for body in &frame.bodies {
                let track = tracks.entry(body.tracking_id).or_default();
                track.push(time, joints_of(body, threshold));
            }
        }
        Self {
            name: walk.name.clone(),
            tracks: tracks.into_values().collect(),
        }
    }

    /// Whether no body was seen at all.
    pub(crate) fn is_empty(&self) -> bool {
        self.tracks.iter().all(|track| track.frames.is_empty())
    }

    /// The bodies at the true instant `time`, for this time offset.
    pub(crate) fn at(&self, time: f64, offset_s: f64) -> Vec<Pose> {
        self.tracks
            .iter()
            .enumerate()
            .filter_map(|(index, track)| track.pose(index, time - offset_s))
            .collect()
    }

    /// The bodies at each of these instants.
    pub(crate) fn sample(&self, times: &[f64], offset_s: f64) -> Vec<Vec<Pose>> {
        times.iter().map(|time| self.at(*time, offset_s)).collect()
    }
}

impl Track {
    fn push(&mut self, time: f64, frame: Frame) {
        let late = self.times.last().is_some_and(|last| time <= *last);
        let stale = self.frames.last() == Some(&frame);
        if !late && !stale && frame.iter().any(Option::is_some) {
            self.times.push(time);
            self.frames.push(frame);
        }
    }

    /// The body at `stamp`: per joint a quadratic through the frames around it, which takes two thirds off white noise
    /// and gives the velocity along. `None` where there is no frame on each side.
    fn pose(&self, track: usize, stamp: f64) -> Option<Pose> {
        let next = self.times.partition_point(|time| *time <= stamp);
        let before = *self.times.get(next.checked_sub(1)?)?;
        let after = match self.times.get(next) {
            Some(after) => *after,
            None if before == stamp => before,
            None => return None,
        };
        if after - before > MAX_GAP_S {
            return None;
        }
        let nearest = if stamp - before <= after - stamp {
            next - 1
        } else {
            next
        };
        let middle = self.times[nearest];
        let first = self.times[..nearest].partition_point(|time| *time < middle - WINDOW_S);
        let last =
            nearest + self.times[nearest..].partition_point(|time| *time <= middle + WINDOW_S);
        let times = &self.times[first..last];
        let frames = &self.frames[first..last];
        let joints = std::array::from_fn(|joint| {
            let (_, weight) = self.frames[nearest][joint]?;
            fit(times, frames, joint, stamp, weight)
        });
        Some(Pose {
            track,
            centre: centre(&joints)?,
            joints,
        })
    }
}

/// The quadratic (a line where there are two frames only) through one joint's places, at `stamp`; `None` where the joint
/// is not seen on each side of it or does not move like a body: a jump, or an exchange of left and right.
fn fit(times: &[f64], frames: &[Frame], joint: usize, stamp: f64, weight: f64) -> Option<Point> {
    let mut powers = [0.0; 5];
    let mut sums = [Vector3::zeros(); 3];
    let (mut count, mut left, mut right) = (0, false, false);
    let mut square = 0.0;
    for (time, frame) in times.iter().zip(frames) {
        let Some((at, _)) = frame[joint] else {
            continue;
        };
        let t = time - stamp;
        (left, right) = (left || t <= 0.0, right || t >= 0.0);
        count += 1;
        square += at.norm_squared();
        let mut power = 1.0;
        for k in 0..5 {
            powers[k] += power;
            if k < 3 {
                sums[k] += at * power;
            }
            power *= t;
        }
    }
    if !left || !right {
        return None;
    }
    let [n, s1, s2, s3, s4] = powers;
    let (at, velocity, acceleration) = match count {
        0 => return None,
        1 => (sums[0], Vector3::zeros(), Vector3::zeros()),
        2 => {
            let det = n * s2 - s1 * s1;
            let at = (sums[0] * s2 - sums[1] * s1) / det;
            (at, (sums[1] * n - sums[0] * s1) / det, Vector3::zeros())
        }
        _ => {
            let inverse = Matrix3::new(n, s1, s2, s1, s2, s3, s2, s3, s4).try_inverse()?;
            let row = |i: usize| {
                sums[0] * inverse[(i, 0)] + sums[1] * inverse[(i, 1)] + sums[2] * inverse[(i, 2)]
            };
            (row(0), row(1), row(2))
        }
    };
    let fitted = at.dot(&sums[0]) + velocity.dot(&sums[1]) + acceleration.dot(&sums[2]);
    let rough = ((square - fitted) / n).max(0.0).sqrt();
    (rough <= MAX_ROUGH_M && velocity.norm() <= MAX_SPEED).then_some(Point {
        at,
        velocity,
        weight,
    })
}

fn joints_of(body: &WalkBody, threshold: f64) -> Frame {
    std::array::from_fn(|joint| {
        let joint = body.joints[Joint::ALL[joint]]?;
        let confidence = f64::from(joint.confidence.get());
        let at = joint.position.vector();
        let possible = at.norm() <= MAX_RANGE_M && confidence > 0.0;
        (possible && confidence >= threshold).then_some((at, confidence))
    })
}

/// The confidence below which this sensor's joints are left out: none where too little would be left.
fn trust_threshold(walk: &SensorWalk) -> f64 {
    let (mut all, mut trusted) = (0_u64, 0_u64);
    for body in walk.frames.iter().flat_map(|frame| &frame.bodies) {
        for (_, joint) in body.joints.iter() {
            all += 1;
            trusted += u64::from(f64::from(joint.confidence.get()) >= TRUSTED);
        }
    }
    if (trusted as f64) < TRUSTED_SHARE * all as f64 {
        0.0
    } else {
        TRUSTED
    }
}

fn centre(joints: &[Option<Point>; JOINT_COUNT]) -> Option<Vector3<f64>> {
    let mean = |points: &mut dyn Iterator<Item = Point>| {
        let (sum, count) = points.fold((Vector3::zeros(), 0.0), |(sum, count), point| {
            (sum + point.at, count + 1.0)
        });
        (count > 0.0).then(|| sum / count)
    };
    mean(&mut Joint::TORSO.iter().filter_map(|j| joints[*j as usize]))
        .or_else(|| mean(&mut joints.iter().flatten().copied()))
}
