//! People at any instant, out of frames that came when they came.
//!
//! Each joint for itself, by a cubic through the nearest measurements (Hermite, with slopes through three points: exact for
//! quadratics, whatever the distances). Never across a gap longer than a bound: there the joint is missing.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector3;
use posefuse_skeleton::{
    Confidence, HandVotes, Joint, JointState, Position, Room, Skeleton, Timestamp,
};

use crate::Who;
use crate::source::{Person, Seen};

type Sample = (Timestamp, Person);

/// The last frames of everybody, to interpolate in.
pub(crate) struct Resampler {
    max_gap_ns: i64,
    /// Frames before this matter to no instant that will be asked for.
    oldest: Timestamp,
    series: BTreeMap<Who, VecDeque<Sample>>,
}

impl Resampler {
    /// `max_gap_ns`: the longest time between two measurements of a joint that is interpolated across. `first`: the first
    /// instant that will be asked for.
    pub(crate) fn new(max_gap_ns: i64, first: Timestamp) -> Self {
        Self {
            max_gap_ns,
            oldest: oldest(first, max_gap_ns),
            series: BTreeMap::new(),
        }
    }

    /// Takes in a frame. Frames of one person come in order of time; what is not later than the last is left out, and what
    /// is too early to matter.
    pub(crate) fn push(&mut self, seen: Seen) {
        if seen.time < self.oldest {
            return;
        }
        for (who, person) in seen.people {
            let series = self.series.entry(who).or_default();
            if series.back().is_none_or(|(last, _)| *last < seen.time) {
                series.push_back((seen.time, person));
            }
        }
    }

    /// Everybody at `time`, in order: frames up to the gap bound later must have been pushed. Times must not go back:
    /// what lies too far behind is forgotten.
    pub(crate) fn at(&mut self, time: Timestamp) -> Vec<(Who, Person)> {
        let oldest = oldest(time, self.max_gap_ns);
        self.oldest = oldest;
        self.series.retain(|_, series| {
            while series.front().is_some_and(|(at, _)| *at < oldest) {
                series.pop_front();
            }
            !series.is_empty()
        });
        let person = |(who, series): (&Who, &VecDeque<Sample>)| {
            let skeleton = self.skeleton(series, time);
            let hands = self.hands(series, time);
            (!skeleton.is_empty()).then(|| (who.clone(), Person { skeleton, hands }))
        };
        self.series.iter().filter_map(person).collect()
    }

    /// What is said of the hands in the last sample up to `time`.
    fn hands(&self, series: &VecDeque<Sample>, time: Timestamp) -> [Option<HandVotes>; 2] {
        let later = series.partition_point(|(at, _)| *at <= time);
        let sample = later.checked_sub(1).and_then(|last| series.get(last));
        let fresh = sample.filter(|(at, _)| time.since_ns(*at) <= self.max_gap_ns);
        fresh.map_or([None; 2], |(_, person)| person.hands)
    }

    fn skeleton(&self, series: &VecDeque<Sample>, time: Timestamp) -> Skeleton<Room> {
        let later = series.partition_point(|(at, _)| *at <= time);
        let joint = |joint| Some((joint, self.joint(series, later, joint, time)?));
        Joint::ALL.into_iter().filter_map(joint).collect()
    }

    /// A joint at `time`; `later` is the index of the first sample after it.
    fn joint(
        &self,
        series: &VecDeque<Sample>,
        later: usize,
        joint: Joint,
        time: Timestamp,
    ) -> Option<JointState<Room>> {
        let mut before = measured(series.range(..later).rev(), joint);
        let mut after = measured(series.range(later..), joint);
        let (from_time, from) = before.next()?;
        if from_time == time {
            return Some(*from);
        }
        let (to_time, to) = after.next()?;
        let within = |early: Timestamp, late: Timestamp| late.since_ns(early) <= self.max_gap_ns;
        if !within(from_time, to_time) {
            return None;
        }
        let place = |(at, state): (Timestamp, &JointState<Room>)| Knot {
            seconds: at.since_seconds(time),
            at: state.position.vector(),
        };
        let previous = before
            .next()
            .filter(|(at, _)| within(*at, from_time))
            .map(place);
        let next = after
            .next()
            .filter(|(at, _)| within(to_time, *at))
            .map(place);
        let (a, b) = (place((from_time, from)), place((to_time, to)));
        let share = -a.seconds / (b.seconds - a.seconds);
        let nearer = if share < 0.5 { from } else { to };
        let trust = |state: &JointState<Room>| state.confidence.get();
        Some(JointState {
            position: Position::from_vector(between(previous, a, b, next, share)),
            covariance: from.covariance * (1.0 - share) + to.covariance * share,
            confidence: Confidence::saturating(
                trust(from) + (trust(to) - trust(from)) * share as f32,
            ),
            provenance: nearer.provenance,
        })
    }
}

/// The earliest frame that matters at `time`: a slope looks back across one gap from a measurement that may itself be one
/// gap back.
fn oldest(time: Timestamp, max_gap_ns: i64) -> Timestamp {
    time.plus_ns(max_gap_ns.saturating_mul(-2))
}

fn measured<'a>(
    samples: impl Iterator<Item = &'a Sample>,
    joint: Joint,
) -> impl Iterator<Item = (Timestamp, &'a JointState<Room>)> {
    samples.filter_map(move |(time, person)| Some((*time, person.skeleton[joint].as_ref()?)))
}

/// A place that the curve goes through.
#[derive(Clone, Copy)]
struct Knot {
    seconds: f64,
    at: Vector3<f64>,
}

/// The point at `share` (0..=1) of the time from `a` to `b`.
fn between(
    previous: Option<Knot>,
    a: Knot,
    b: Knot,
    next: Option<Knot>,
    share: f64,
) -> Vector3<f64> {
    let step = b.seconds - a.seconds;
    let chord = (b.at - a.at) / step;
    let slope = |outer: Option<Knot>, inner: Knot| match outer {
        Some(outer) => {
            let far = (inner.seconds - outer.seconds).abs();
            let outer_chord = (inner.at - outer.at) / (inner.seconds - outer.seconds);
            (outer_chord * step + chord * far) / (step + far)
        }
        None => chord,
    };
    let (u, v) = (share, 1.0 - share);
    a.at * (v * v * (1.0 + 2.0 * u))
        + b.at * (u * u * (1.0 + 2.0 * v))
        + (slope(previous, a) * v - slope(next, b) * u) * (u * v * step)
}

#[cfg(test)]
mod tests {
    use posefuse_skeleton::{Provenance, SensorSet, TrackId};

    use super::*;

    const WHO: Who = Who::Person(TrackId(7));

    fn seen(seconds: f64, joints: &[(Joint, f64)]) -> Seen {
        let state = |x: f64| JointState {
            position: Position::new(x, 0.0, 1.0),
            covariance: nalgebra::Matrix3::identity() * 1e-4,
            confidence: Confidence::FULL,
            provenance: Provenance::Measured(SensorSet::EMPTY),
        };
        Seen {
            time: Timestamp::from_seconds(seconds),
            people: vec![(
                WHO,
                Person {
                    skeleton: joints
                        .iter()
                        .map(|(joint, x)| (*joint, state(*x)))
                        .collect(),
                    hands: [None; 2],
                },
            )],
        }
    }

    fn x(resampler: &mut Resampler, seconds: f64, joint: Joint) -> Option<f64> {
        let people = resampler.at(Timestamp::from_seconds(seconds));
        Some(people.first()?.1.skeleton.position(joint)?.vector().x)
    }

    #[test]
    fn a_quadratic_comes_back_exactly_from_uneven_frames() {
        let way = |t: f64| 3.0 * t * t - 2.0 * t + 0.5;
        let times = [0.0, 0.03, 0.07, 0.1, 0.15, 0.18, 0.22];
        let mut resampler = Resampler::new(200_000_000, Timestamp::ZERO);
        for t in times {
            resampler.push(seen(t, &[(Joint::Head, way(t))]));
        }
        for step in 6..34 {
            let t = f64::from(step) * 0.005;
            let found = x(&mut resampler, t, Joint::Head).unwrap();
            assert!((found - way(t)).abs() < 1e-9, "at {t}: {found}");
        }
    }

    #[test]
    fn long_gaps_stay_gaps_and_short_ones_close_for_each_joint_alone() {
        let mut resampler = Resampler::new(100_000_000, Timestamp::ZERO);
        for (t, joints) in [
            (0.0, &[Joint::Head, Joint::Neck][..]),
            (0.05, &[Joint::Neck]),
            (0.1, &[Joint::Head, Joint::Neck]),
            (0.25, &[Joint::Head, Joint::Neck]),
        ] {
            let joints: Vec<(Joint, f64)> = joints.iter().map(|joint| (*joint, t)).collect();
            resampler.push(seen(t, &joints));
        }
        let head = x(&mut resampler, 0.04, Joint::Head).unwrap();
        assert!((head - 0.04).abs() < 1e-9, "{head}");
        assert_eq!(x(&mut resampler, 0.1, Joint::Head), Some(0.1));
        assert_eq!(
            x(&mut resampler, 0.2, Joint::Neck),
            None,
            "150 ms are too long"
        );
        assert_eq!(x(&mut resampler, 0.25, Joint::Neck), Some(0.25));
        assert_eq!(x(&mut resampler, 0.26, Joint::Neck), None, "the end");
        assert!(resampler.at(Timestamp::from_seconds(9.0)).is_empty());
        assert!(resampler.series.is_empty(), "who left is forgotten");
    }

    #[test]
    fn frames_that_are_too_early_for_the_first_instant_are_not_kept() {
        let mut resampler = Resampler::new(100_000_000, Timestamp::from_seconds(9.005));
        for frame in 0..1000 {
            let t = f64::from(frame) * 0.01;
            resampler.push(seen(t, &[(Joint::Head, t)]));
        }
        assert_eq!(resampler.series[&WHO].len(), 119, "from 8.81 s on");
        let head = x(&mut resampler, 9.005, Joint::Head).unwrap();
        assert!((head - 9.005).abs() < 1e-9, "{head}");
    }
}
