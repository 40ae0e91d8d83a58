//! One sensor's view as tracks over time, and its bodies interpolated at any instant.
//!
//! Times are seconds since the walk's start on the server's clock. A sensor's time offset is added to its stamps,
//! so that what it saw at the true instant `t` bears the stamp `t - offset`.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, Joint, Timestamp};

use crate::{SensorWalk, WalkBody};

/// Confidence from which a joint counts: what Kinect v2 calls tracked is 1, what it infers 0.5 (after Menard 2014).
const TRUSTED: f64 = 0.75;
/// Where a sensor has fewer trusted joints than this share, its confidences are taken as a relative weight only.
const TRUSTED_SHARE: f64 = 0.2;
/// Frames further apart than this are not interpolated, seconds: two lost frames at 30 Hz.
const MAX_GAP_S: f64 = 0.11;
/// Half the span over which a velocity is taken, seconds.
const VELOCITY_SPAN_S: f64 = 0.066;
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

    fn pose(&self, track: usize, stamp: f64) -> Option<Pose> {
        let here = self.interpolated(stamp)?;
        let before = self.interpolated(stamp - VELOCITY_SPAN_S);
        let after = self.interpolated(stamp + VELOCITY_SPAN_S);
        let velocity = |joint: usize| {
            let (from, to) = (before.as_ref()?[joint]?.0, after.as_ref()?[joint]?.0);
            let velocity = (to - from) / (2.0 * VELOCITY_SPAN_S);
            (velocity.norm() <= MAX_SPEED).then_some(velocity)
        };
        let joints = std::array::from_fn(|joint| {
            here[joint].map(|(at, weight)| Point {
                at,
                velocity: velocity(joint).unwrap_or_default(),
                weight,
            })
        });
        Some(Pose {
            track,
            centre: centre(&joints)?,
            joints,
        })
    }

    /// Linear between the frames around `stamp`; a joint needs to be in both and takes the lower weight.
    fn interpolated(&self, stamp: f64) -> Option<Frame> {
        let next = self.times.partition_point(|time| *time <= stamp);
        if next == 0 {
            return None;
        }
        let (t0, first) = (self.times[next - 1], &self.frames[next - 1]);
        if stamp == t0 {
            return Some(*first);
        }
        let (t1, second) = (*self.times.get(next)?, &self.frames[next]);
        if t1 - t0 > MAX_GAP_S {
            return None;
        }
        let share = (stamp - t0) / (t1 - t0);
        Some(std::array::from_fn(|joint| {
            let ((p0, w0), (p1, w1)) = (first[joint]?, second[joint]?);
            Some((p0 + (p1 - p0) * share, w0.min(w1)))
        }))
    }
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
