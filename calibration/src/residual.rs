//! How far the sensors' joints lie apart: the figures of the report, from frames the solver did not use.

use nalgebra::Isometry3;
use posefuse_skeleton::BONES;

use crate::graph::Placed;
use crate::kabsch::singular_values;
use crate::matching::{agrees, common, match_bodies};
use crate::stats::{median, moments, quantile, rms};
use crate::tracks::Pose;
use crate::{Options, PairRow, SensorRow};

/// With several bodies in view, those further apart than this are not compared, metres. A single one always is.
const SEVERAL_REACH_M: f64 = 1.0;
/// Shortest bone that says something about scale, metres.
const MIN_BONE_M: f64 = 0.15;

/// Everything the rows are made from; `seen` is per sensor, per instant.
pub(crate) struct Evidence<'e> {
    pub(crate) names: &'e [&'e str],
    pub(crate) seen: &'e [Vec<Vec<Pose>>],
    /// The same before biases were taken out.
    pub(crate) raw: &'e [Vec<Vec<Pose>>],
    pub(crate) held_out: &'e [bool],
    pub(crate) spacing_s: f64,
    pub(crate) placed: &'e [Placed],
    /// Up in the first sensor's frame comes from here.
    pub(crate) room_from_world: Isometry3<f64>,
}

/// The rows of all pairs that saw somebody at the same time, and the held-out distances behind them (mm). `standing`: whether
/// a pair is in the tree, and whether it is its weakest.
pub(crate) fn pair_rows(
    evidence: &Evidence<'_>,
    standing: impl Fn((usize, usize)) -> (bool, bool),
) -> Vec<((usize, usize), PairRow, Vec<f64>)> {
    let sensors = evidence.names.len();
    let mut rows = Vec::new();
    for a in 0..sensors {
        for b in a + 1..sensors {
            if let Some((row, distances)) = pair_row(evidence, a, b, standing((a, b))) {
                rows.push(((a, b), row, distances));
            }
        }
    }
    rows
}

fn pair_row(
    evidence: &Evidence<'_>,
    a: usize,
    b: usize,
    (in_tree, weakest): (bool, bool),
) -> Option<(PairRow, Vec<f64>)> {
    let (seen_a, seen_b) = (&evidence.seen[a], &evidence.seen[b]);
    let [of_a, of_b] = [a, b].map(|s| evidence.placed[s].world_from_sensor);
    let a_from_b = of_a.inverse() * of_b;
    let identity = Isometry3::identity();
    let (mut after, mut before, mut halves) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    let (mut shared, mut solved, mut agreeing, mut matched, mut mirrored) = (0, 0, 0, 0, 0);
    let mut cloud = Vec::new();
    for (instant, (bodies_a, bodies_b)) in seen_a.iter().zip(seen_b).enumerate() {
        if bodies_a.is_empty() || bodies_b.is_empty() {
            continue;
        }
        shared += 1;
        let held_out = evidence.held_out[instant];
        let distances = distances(bodies_a, bodies_b, &a_from_b);
        if held_out {
            after.extend(&distances);
            let [raw_a, raw_b] = [a, b].map(|s| &evidence.raw[s][instant]);
            before.extend(self::distances(raw_a, raw_b, &identity));
        } else {
            solved += 1;
        }
        halves[usize::from(2 * instant >= seen_a.len())].extend(distances);
        let matches = match_bodies(bodies_a, bodies_b, &a_from_b, SEVERAL_REACH_M, None);
        agreeing += u32::from(
            !held_out
                && matches
                    .iter()
                    .any(|m| agrees(&bodies_a[m.a], &bodies_b[m.b], m.mirrored, &a_from_b)),
        );
        for found in matches {
            matched += 1;
            mirrored += u32::from(found.mirrored);
            let (pose_a, pose_b) = (&bodies_a[found.a], &bodies_b[found.b]);
            cloud.extend(common(pose_a, pose_b, found.mirrored).map(|(_, p, _)| p.at));
        }
    }
    if shared == 0 {
        return None;
    }
    let spread = singular_values(&moments(&cloud).1);
    let row = PairRow {
        a: evidence.names[a].to_owned(),
        b: evidence.names[b].to_owned(),
        samples: after.len() as u64,
        shared_s: f64::from(shared) * evidence.spacing_s,
        agreeing_share: f64::from(agreeing) / f64::from(solved.max(1)),
        mirrored_share: f64::from(mirrored) / f64::from(matched.max(1)),
        singular_ratio: if spread[0] > 0.0 {
            spread[2] / spread[0]
        } else {
            0.0
        },
        rms_before_mm: rms(&before),
        median_before_mm: median(&mut before).unwrap_or(0.0),
        rms_after_mm: rms(&after),
        median_mm: median(&mut after).unwrap_or(0.0),
        p95_mm: quantile(&mut after, 0.95).unwrap_or(0.0),
        halves_mm: halves.map(|mut half| median(&mut half).unwrap_or(0.0)),
        in_tree,
        weakest,
    };
    Some((row, after))
}

/// Distances of the joints of the bodies that are one person, mm.
fn distances(a: &[Pose], b: &[Pose], a_from_b: &Isometry3<f64>) -> Vec<f64> {
    let single = a.len() == 1 && b.len() == 1;
    let reach = if single {
        f64::INFINITY
    } else {
        SEVERAL_REACH_M
    };
    match_bodies(a, b, a_from_b, reach, None)
        .iter()
        .flat_map(|m| common(&a[m.a], &b[m.b], m.mirrored))
        .map(|(_, p, q)| (p.at - a_from_b.transform_point(&q.at.into()).coords).norm() * 1e3)
        .collect()
}

/// The rows of all sensors, from the rows of their pairs; time offsets against `clock_s`.
pub(crate) fn sensor_rows(
    evidence: &Evidence<'_>,
    pairs: &[((usize, usize), PairRow, Vec<f64>)],
    solved_samples: &[u64],
    clock_s: f64,
) -> Vec<SensorRow> {
    let scales = bone_scales(evidence.seen);
    let row = |sensor: usize| {
        let mut distances: Vec<f64> = pairs
            .iter()
            .filter(|((a, b), _, _)| *a == sensor || *b == sensor)
            .flat_map(|(_, _, distances)| distances.iter().copied())
            .collect();
        let (shared_s, spread_m) = shared(evidence, sensor);
        let offset_s = evidence.placed[sensor].offset_s - clock_s;
        SensorRow {
            name: evidence.names[sensor].to_owned(),
            median_mm: median(&mut distances).unwrap_or(0.0),
            p95_mm: quantile(&mut distances, 0.95).unwrap_or(0.0),
            rms_mm: rms(&distances),
            samples: distances.len() as u64,
            solved_samples: solved_samples[sensor],
            shared_s,
            spread_m,
            time_offset_ms: offset_s * 1e3,
            bone_scale: scales[sensor],
            sigma: None,
            clock_drift_ppm: None,
        }
    };
    (0..evidence.names.len()).map(row).collect()
}

/// How long a sensor saw somebody together with another (a lone one: at all), and how widely that person moved on the
/// floor.
fn shared(evidence: &Evidence<'_>, sensor: usize) -> (f64, [f64; 2]) {
    let room_from_sensor = evidence.room_from_world * evidence.placed[sensor].world_from_sensor;
    let alone = evidence.seen.len() == 1;
    let mut places = Vec::new();
    let mut instants = 0;
    for (instant, bodies) in evidence.seen[sensor].iter().enumerate() {
        let others = (0..evidence.seen.len())
            .any(|other| other != sensor && !evidence.seen[other][instant].is_empty());
        if (others || alone) && !bodies.is_empty() {
            instants += 1;
            for body in bodies {
                let mut place = room_from_sensor.transform_point(&body.centre.into()).coords;
                place.z = 0.0;
                places.push(place);
            }
        }
    }
    let spread = singular_values(&moments(&places).1);
    (
        f64::from(instants) * evidence.spacing_s,
        [spread[0], spread[1]],
    )
}

/// Each sensor's bone lengths over the median of all sensors'; 1 where no bone was seen.
fn bone_scales(seen: &[Vec<Vec<Pose>>]) -> Vec<f64> {
    let length = |poses: &[Vec<Pose>], bone: usize| {
        let mut lengths: Vec<f64> = poses
            .iter()
            .flatten()
            .filter_map(|pose| {
                let end = |joint| pose.joints[joint as usize].map(|p| p.at);
                Some((end(BONES[bone].parent)? - end(BONES[bone].child)?).norm())
            })
            .collect();
        median(&mut lengths)
    };
    let mut ratios = vec![Vec::new(); seen.len()];
    for bone in 0..BONES.len() {
        let lengths: Vec<Option<f64>> = seen.iter().map(|poses| length(poses, bone)).collect();
        let known: Vec<f64> = lengths.iter().flatten().copied().collect();
        let Some(typical) = median(&mut known.clone()).filter(|l| *l >= MIN_BONE_M) else {
            continue;
        };
        for (ratios, length) in ratios.iter_mut().zip(lengths) {
            ratios.extend(length.map(|length| length / typical));
        }
    }
    ratios
        .iter_mut()
        .map(|ratios| median(ratios).unwrap_or(1.0))
        .collect()
}

/// The instants at which sensors are compared, and which of them are held out.
pub(crate) fn instants(span_s: f64, options: &Options) -> (f64, Vec<f64>, Vec<bool>) {
    /// Longer walks are sampled more sparsely: this many instants determine a room.
    const MOST: f64 = 3000.0;
    let wanted = options.sample_spacing_s;
    let wanted = if wanted.is_finite() {
        wanted.clamp(0.01, 1.0)
    } else {
        0.1
    };
    let spacing = wanted.max(span_s / MOST);
    let count = if span_s >= 0.0 {
        (span_s / spacing) as usize + 1
    } else {
        0
    };
    let times: Vec<f64> = (0..count).map(|i| i as f64 * spacing).collect();
    let every = i64::from(options.held_out_every.max(2));
    let held_out = |time: &f64| (time.floor() as i64).rem_euclid(every) == every - 1;
    let held = times.iter().map(held_out).collect();
    (spacing, times, held)
}
