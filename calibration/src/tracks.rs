//! One sensor's view as tracks over time, and its bodies interpolated at any instant.
//!
//! Times are seconds since the walk's start on the server's clock. A sensor's time offset is added to its stamps,
//! so that what it saw at the true instant `t` bears the stamp `t - offset`.

use std::collections::BTreeMap;

use nalgebra::{Matrix4, Vector3};
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

impl Pose {
    /// Moves it to where it was this much earlier, along its joints' velocities.
    pub(crate) fn delay(&mut self, by_s: f64) {
        for point in self.joints.iter_mut().flatten() {
            point.at -= point.velocity * by_s;
        }
    }
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

    /// Whether a body was seen around the instant `time` by the sensor's stamps.
    pub(crate) fn sees_at(&self, time: f64) -> bool {
        self.tracks.iter().any(|track| track.around(time).is_some())
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

    /// The index of the frame nearest to `stamp`; `None` where there is no frame on each side.
    fn around(&self, stamp: f64) -> Option<usize> {
        let next = self.times.partition_point(|time| *time <= stamp);
        let before = *self.times.get(next.checked_sub(1)?)?;
        let after = match self.times.get(next) {
            Some(after) => *after,
            None if before == stamp => before,
            None => return None,
        };
        let is_before_nearer = stamp - before <= after - stamp;
        (after - before <= MAX_GAP_S).then_some(if is_before_nearer { next - 1 } else { next })
    }

    /// The body at `stamp`: per joint a polynomial through the frames around it, which takes half off white noise and gives
    /// the velocity along. `None` where there is no frame on each side.
    fn pose(&self, track: usize, stamp: f64) -> Option<Pose> {
        let nearest = self.around(stamp)?;
        let middle = self.times[nearest];
        let first = self.times[..nearest].partition_point(|time| *time < middle - WINDOW_S);
        let last =
            nearest + self.times[nearest..].partition_point(|time| *time <= middle + WINDOW_S);
        // Faster sensors than 300 Hz do without the frames beyond.
        let last = last.min(first + 64);
        let times = &self.times[first..last];
        let frames = &self.frames[first..last];
        let mut kernel: Option<Kernel> = None;
        let mut places = Vec::with_capacity(times.len());
        let joints = std::array::from_fn(|joint| {
            let (_, weight) = self.frames[nearest][joint]?;
            places.clear();
            let mut shown = 0_u64;
            for (k, frame) in frames.iter().enumerate() {
                if let Some((at, _)) = frame[joint] {
                    shown |= 1 << k;
                    places.push(at);
                }
            }
            if kernel.as_ref().is_none_or(|kernel| kernel.shown != shown) {
                kernel = Kernel::new(times, shown, stamp);
            }
            kernel.as_ref()?.point(&places, weight)
        });
        Some(Pose {
            track,
            centre: centre(&joints)?,
            joints,
        })
    }
}

/// The polynomial through one joint's places in the frames that show it, as weights of those places.
///
/// Most joints of a body are in the same frames, so that one serves many. A cubic where there are frames enough: a quadratic
/// would move a swinging arm too little between frames, which looks like a time offset of half a millisecond.
struct Kernel {
    /// Which frames show the joint.
    shown: u64,
    /// By power of the time since the stamp (in units of [`WINDOW_S`]), by frame.
    rows: [Vec<f64>; 4],
    /// Time since the stamp, in the same unit.
    times: Vec<f64>,
}

impl Kernel {
    /// `None` where the frames shown are not on both sides of `stamp`.
    fn new(times: &[f64], shown: u64, stamp: f64) -> Option<Self> {
        let at = |k: &usize| (times[*k] - stamp) / WINDOW_S;
        let times: Vec<f64> = (0..times.len())
            .filter(|k| shown >> k & 1 == 1)
            .map(|k| at(&k))
            .collect();
        let around =
            times.first().is_some_and(|t| *t <= 0.0) && times.last().is_some_and(|t| *t >= 0.0);
        if !around {
            return None;
        }
        let unknowns = match times.len() {
            1 => 1,
            2 => 2,
            3..=5 => 3,
            _ => 4,
        };
        let mut normal = Matrix4::<f64>::identity();
        let power = |t: f64, k: usize| t.powi(k as i32);
        for r in 0..unknowns {
            for c in 0..unknowns {
                normal[(r, c)] = times.iter().map(|t| power(*t, r + c)).sum::<f64>();
            }
        }
        let inverse = normal.try_inverse()?;
        let row = |r: usize| -> Vec<f64> {
            let weight = |t: &f64| (0..unknowns).map(|c| inverse[(r, c)] * power(*t, c)).sum();
            times.iter().map(weight).collect()
        };
        Some(Self {
            shown,
            rows: [0, 1, 2, 3].map(|r| {
                if r < unknowns {
                    row(r)
                } else {
                    vec![0.0; times.len()]
                }
            }),
            times,
        })
    }

    /// The joint at the stamp; `None` where it does not move like a body: a jump, or an exchange of left and right.
    fn point(&self, places: &[Vector3<f64>], weight: f64) -> Option<Point> {
        let [at, slope, bend, twist] = [0, 1, 2, 3].map(|r| {
            let weighted = self.rows[r].iter().zip(places).map(|(w, p)| p * *w);
            weighted.sum::<Vector3<f64>>()
        });
        let off = |(t, p): (&f64, &Vector3<f64>)| {
            (p - (at + (slope + (bend + twist * *t) * *t) * *t)).norm_squared()
        };
        let square = self.times.iter().zip(places).map(off).sum::<f64>() / places.len() as f64;
        let velocity = slope / WINDOW_S;
        let moves = square <= MAX_ROUGH_M * MAX_ROUGH_M && velocity.norm() <= MAX_SPEED;
        moves.then_some(Point {
            at,
            velocity,
            weight,
        })
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
