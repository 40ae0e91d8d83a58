//! Why two sensors that saw somebody at the same time do not agree: is a picture mirrored, is a clock seconds off, or
//! did they see different people?
//!
//! Each suspicion is tried: the pair is related once more with one picture mirrored back, or over seconds of time
//! offset. What then agrees, was it.

use nalgebra::Vector3;
use posefuse_skeleton::{Position, Timestamp};

use crate::kabsch::singular_values;
use crate::look::Look;
use crate::matching::{agrees, match_bodies};
use crate::pair::{self, PairStart, REACH_M};
use crate::stats::moments;
use crate::tracks::SensorTracks;
use crate::{Cause, SensorWalk};

/// How far off a clock may be to be told so, seconds.
const CLOCK_REACH_S: f64 = 3.0;
/// Share of shared instants that must agree under a suspicion to confirm it: the true one gives more than 0.8, a wrong
/// one under 0.5.
const CONFIRMED: f64 = 0.65;
/// Frames a second below which most instants fall into gaps.
const SPARSE_HZ: f64 = 8.0;
/// How far somebody must have walked for a mirror image to differ from a turned one: standard deviation, metres.
const WALKED_M: f64 = 0.25;
/// Seconds that two sensors must share before they can be said to disagree.
const SHARED_S: f64 = 2.0;

/// Two sensors that should agree, by index; `suspect` is the one that agrees with fewer others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Suspicion {
    pub(crate) suspect: usize,
    pub(crate) other: usize,
}

/// The walk as the diagnosis needs it.
pub(crate) struct Case<'c> {
    pub(crate) walks: &'c [&'c SensorWalk],
    /// By sensor.
    pub(crate) looks: &'c [Look],
    pub(crate) start: Timestamp,
    /// The instants at which sensors are compared, seconds since `start`.
    pub(crate) times: &'c [f64],
    pub(crate) spacing_s: f64,
    pub(crate) max_offset_s: f64,
}

/// What is wrong between the groups that nothing joins: of the pair of sensors across groups that shares most.
pub(crate) fn between(case: &Case<'_>, sensors: &[SensorTracks], groups: &[Vec<usize>]) -> Cause {
    let group_of = |sensor: usize| groups.iter().position(|group| group.contains(&sensor));
    let size = |sensor: usize| group_of(sensor).map_or(0, |group| groups[group].len());
    let mut pairs = Vec::new();
    for a in 0..sensors.len() {
        for b in a + 1..sensors.len() {
            if group_of(a) != group_of(b) {
                let (suspect, other) = if size(a) < size(b) { (a, b) } else { (b, a) };
                let shared_s = shared_s(case, &sensors[a], &sensors[b]);
                pairs.push((shared_s, Suspicion { suspect, other }));
            }
        }
    }
    let most = pairs.into_iter().max_by(|x, y| x.0.total_cmp(&y.0));
    match most {
        Some((shared_s, suspicion)) if shared_s >= SHARED_S => {
            let name = |sensor: usize| case.walks[sensor].name.clone();
            cause(case, sensors, suspicion).unwrap_or(Cause::Strangers {
                sensors: [name(suspicion.other), name(suspicion.suspect)],
                shared_s: shared_s.round() as u64,
            })
        }
        _ => sparse(case).unwrap_or(Cause::Apart),
    }
}

/// The sensor with the fewest frames, if those are too few.
fn sparse(case: &Case<'_>) -> Option<Cause> {
    let rates = case
        .looks
        .iter()
        .filter_map(|look| Some((look, look.rate_hz?)));
    let (look, rate_hz) = rates.min_by(|x, y| x.1.total_cmp(&y.1))?;
    (rate_hz < SPARSE_HZ).then(|| Cause::Sparse {
        sensor: look.name.clone(),
        per_minute: (rate_hz * 60.0).round() as u64,
    })
}

fn shared_s(case: &Case<'_>, a: &SensorTracks, b: &SensorTracks) -> f64 {
    let both = |time: &&f64| !a.at(**time, 0.0).is_empty() && !b.at(**time, 0.0).is_empty();
    case.times.iter().filter(both).count() as f64 * case.spacing_s
}

/// A mirrored picture or a wrong clock, if one of them explains why these two do not agree.
pub(crate) fn cause(
    case: &Case<'_>,
    sensors: &[SensorTracks],
    suspicion: Suspicion,
) -> Option<Cause> {
    let Suspicion { suspect, other } = suspicion;
    let name = case.walks[suspect].name.clone();
    // Of two pictures either may be the mirrored one; a third tells which.
    let blamed = match case.walks {
        [one, two] => vec![one.name.clone(), two.name.clone()],
        _ => vec![name.clone()],
    };
    let mirrored = SensorTracks::new(&mirrored(case.walks[suspect]), case.start);
    let as_mirror = try_to_relate(case, &sensors[other], &mirrored, case.max_offset_s);
    let late = try_to_relate(case, &sensors[other], &sensors[suspect], CLOCK_REACH_S);
    let late = late.filter(|(_, start)| start.offset_s.abs() > case.max_offset_s);
    let ahead_ms = |start: &PairStart| (-start.offset_s * 1e3).round() as i64;
    match (as_mirror, late) {
        (Some((share, _)), Some((other_share, start))) if other_share > share => {
            Some(Cause::Clock {
                sensor: name,
                ahead_ms: ahead_ms(&start),
            })
        }
        (Some(_), _) => Some(Cause::Mirrored { sensors: blamed }),
        (None, Some((_, start))) => Some(Cause::Clock {
            sensor: name,
            ahead_ms: ahead_ms(&start),
        }),
        (None, None) => None,
    }
}

/// The relation and the share of instants that agree with it, if that is most of them.
fn try_to_relate(
    case: &Case<'_>,
    a: &SensorTracks,
    b: &SensorTracks,
    max_offset_s: f64,
) -> Option<(f64, PairStart)> {
    let start = pair::start(a, b, case.times, max_offset_s)?;
    let (seen_a, seen_b) = (
        a.sample(case.times, 0.0),
        b.sample(case.times, start.offset_s),
    );
    let (mut shared, mut agreeing) = (0, 0);
    let mut places = Vec::new();
    for (bodies_a, bodies_b) in seen_a.iter().zip(&seen_b) {
        if bodies_a.is_empty() || bodies_b.is_empty() {
            continue;
        }
        shared += 1;
        places.extend(bodies_a.iter().map(|body| body.centre));
        let matches = match_bodies(bodies_a, bodies_b, &start.a_from_b, REACH_M, None);
        let agree = |m: &crate::matching::Match| {
            agrees(&bodies_a[m.a], &bodies_b[m.b], m.mirrored, &start.a_from_b)
        };
        agreeing += u32::from(matches.iter().any(agree));
    }
    let share = f64::from(agreeing) / f64::from(shared.max(1));
    let enough = f64::from(shared) * case.spacing_s >= SHARED_S;
    let walked = singular_values(&moments(&places).1)[0] >= WALKED_M;
    (enough && walked && share >= CONFIRMED).then_some((share, start))
}

/// The walk as it would be with the picture mirrored back.
fn mirrored(walk: &SensorWalk) -> SensorWalk {
    let mut walk = walk.clone();
    for body in walk.frames.iter_mut().flat_map(|frame| &mut frame.bodies) {
        for (_, joint) in body.joints.iter_mut() {
            let p = joint.position.vector();
            joint.position = Position::from_vector(Vector3::new(-p.x, p.y, p.z));
        }
    }
    walk
}
