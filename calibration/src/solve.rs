//! From a walk to a calibration with its report.

use std::collections::BTreeSet;

use posefuse_skeleton::{Calibration, SensorPose, Timestamp, Transform};

use crate::bundle::sample;
use crate::diagnose::Case;
use crate::graph::{self, Edges, Placed};
use crate::posterior::posterior;
use crate::refine::{Refined, refine};
use crate::residual::{Evidence, instants, pair_rows, sensor_rows};
use crate::tracks::SensorTracks;
use crate::validate::{all_saw_somebody, validate};
use crate::verdict::Findings;
use crate::{
    CalibrationError, FloorRow, Options, PairRow, Reason, Report, SensorCovariance, SensorRow,
    SensorWalk, Solution, Verdict, Walk,
};
use crate::{against, diagnose, floor, look, pair, verdict};

/// Finds where every sensor of `walk` stands, and says how far the answer can be trusted.
///
/// Deterministic, and independent of the order of the sensors. An answer that cannot be trusted is still an
/// answer, with the verdict [`Failed`](crate::Verdict::Failed); an error means that there is none.
///
/// A lone sensor is laid on the floor that the walk shows. Its residuals are 0, since there is nothing to compare it with,
/// and the verdict rests on the floor and on where the person was.
pub fn solve(walk: &Walk, options: &Options) -> Result<Solution, CalibrationError> {
    let mut walks: Vec<&SensorWalk> = walk.sensors.iter().collect();
    walks.sort_by(|x, y| x.name.cmp(&y.name));
    let names: Vec<&str> = walks.iter().map(|w| w.name.as_str()).collect();
    let root = validate(&names, options)?;
    let looks = look::look(&walks);
    if let Some(error) = look::wrong_unit(&looks) {
        return Err(error);
    }
    let (start, span_s) = span(&walks);
    let sensors: Vec<SensorTracks> = walks.iter().map(|w| SensorTracks::new(w, start)).collect();
    all_saw_somebody(&sensors)?;
    let (spacing_s, times, held_out) = instants(span_s, options);
    let mut solved = times.clone();
    let mut is_held_out = held_out.iter();
    solved.retain(|_| is_held_out.next() == Some(&false));
    let max_offset_s = f64::from(u8::from(options.time_offsets)) * options.max_time_offset_s;
    let held = held(&names, options);
    let edges = edges(&sensors, &solved, max_offset_s, &held);
    let case = Case {
        walks: &walks,
        looks: &looks,
        start,
        times: &solved,
        spacing_s,
        max_offset_s,
    };
    let tree = graph::spanning_tree(sensors.len(), &edges, &indices(&held)).map_err(|groups| {
        CalibrationError::Disconnected {
            groups: named(&groups, &names),
            cause: diagnose::between(&case, &sensors, &groups),
        }
    })?;
    let placed = graph::place(sensors.len(), &tree, &edges, &held);
    let refined = refine(&walks, &sensors, &solved, placed, span_s, options);
    let raw = sample(&sensors, &times, refined.placed(), span_s / 2.0);
    let seen = refined.corrected(&raw);
    let by_hand = options.floor.as_ref();
    let floor = if held.is_empty() {
        floor::find(&names, &seen, refined.placed(), root, by_hand)
    } else {
        floor::kept(&names, &seen, refined.placed())
    };
    let evidence = Evidence {
        names: &names,
        seen: &seen,
        raw: &raw,
        held_out: &held_out,
        spacing_s,
        placed: refined.placed(),
        room_from_world: floor.room_from_world,
    };
    let is_held = !held.is_empty();
    let placing = Placing {
        case: &case,
        sensors: &sensors,
        tree: &tree,
        weakest: graph::weakest(&tree, &edges),
        refined: &refined,
        is_held,
        // Sensors that are held keep their offsets, and so the room its clock.
        clock_s: if is_held {
            0.0
        } else {
            refined.placed()[root].offset_s
        },
        span_s,
    };
    Ok(conclude(&placing, &evidence, floor, options))
}

/// How the sensors came to stand where they stand.
struct Placing<'p> {
    case: &'p Case<'p>,
    sensors: &'p [SensorTracks],
    tree: &'p BTreeSet<(usize, usize)>,
    weakest: Option<(usize, usize)>,
    refined: &'p Refined,
    is_held: bool,
    /// What time offsets are told against.
    clock_s: f64,
    span_s: f64,
}

/// The figures, the verdict on them, and the calibration.
fn conclude(
    placing: &Placing<'_>,
    evidence: &Evidence<'_>,
    floor: floor::Floor,
    options: &Options,
) -> Solution {
    let refined = placing.refined;
    let pairs = pair_rows(evidence, |pair| {
        (placing.tree.contains(&pair), placing.weakest == Some(pair))
    });
    let samples = &refined.bundled.samples;
    let mut rows = sensor_rows(evidence, &pairs, samples, placing.clock_s);
    let covariance = add_sigmas(evidence, refined, &mut rows);
    let pairs: Vec<_> = pairs.into_iter().map(|(_, row, _)| row).collect();
    let found = Found {
        rows: &rows,
        pairs: &pairs,
        floor: &floor.row,
    };
    let (verdict, mut reasons) = judged(placing.case, placing.sensors, evidence, &found, options);
    reasons.extend(refined.notes());
    if !placing.is_held {
        none_ahead(&mut rows);
    }
    Solution {
        calibration: calibration(evidence, &rows, &floor, refined, verdict, options),
        report: Report {
            verdict,
            reasons,
            sensors: rows,
            pairs,
            floor: floor.row,
            ray_bias_mm: refined.ray_bias_mm(),
            covariance,
            duration_s: placing.span_s,
        },
    }
}

/// The rows that the verdict rests on.
struct Found<'f> {
    rows: &'f [SensorRow],
    pairs: &'f [PairRow],
    floor: &'f FloorRow,
}

fn judged(
    case: &Case<'_>,
    sensors: &[SensorTracks],
    evidence: &Evidence<'_>,
    found: &Found<'_>,
    options: &Options,
) -> (Verdict, Vec<Reason>) {
    let suspicions = verdict::suspicions(found.rows, found.pairs, options);
    let causes = suspicions
        .iter()
        .filter_map(|s| diagnose::cause(case, sensors, *s));
    let findings = Findings {
        sensors: found.rows,
        pairs: found.pairs,
        floor: found.floor,
        looks: case.looks,
        against: &against::against(evidence),
        turned: against::turned(evidence),
        causes: &causes.collect::<Vec<_>>(),
    };
    verdict::judge(&findings, options)
}

/// The time during which two sensors or more (the only one, if it is alone) saw somebody: its start, and its length in
/// seconds (negative: never).
fn span(walks: &[&SensorWalk]) -> (Timestamp, f64) {
    let times = |walk: &SensorWalk| {
        let times = walk.frames.iter().filter(|f| !f.bodies.is_empty());
        let times: BTreeSet<Timestamp> = times.map(|f| f.time).collect();
        Some((*times.first()?, *times.last()?))
    };
    let (mut starts, mut ends): (Vec<_>, Vec<_>) =
        walks.iter().filter_map(|walk| times(walk)).unzip();
    starts.sort();
    ends.sort();
    let second = usize::from(walks.len() > 1);
    match (starts.get(second), ends.iter().rev().nth(second)) {
        (Some(start), Some(end)) => (*start, end.since_seconds(*start)),
        _ => (Timestamp::ZERO, -1.0),
    }
}

fn edges(
    sensors: &[SensorTracks],
    times: &[f64],
    max_offset_s: f64,
    held: &[(usize, Placed)],
) -> Edges {
    let is_held = |sensor: usize| held.iter().any(|(index, _)| *index == sensor);
    let mut edges = Edges::new();
    for a in 0..sensors.len() {
        for b in a + 1..sensors.len() {
            if is_held(a) && is_held(b) {
                continue;
            }
            if let Some(start) = pair::start(&sensors[a], &sensors[b], times, max_offset_s) {
                edges.insert((a, b), start);
            }
        }
    }
    edges
}

/// The sensors that are held, by index, where they stand in the room.
fn held(names: &[&str], options: &Options) -> Vec<(usize, Placed)> {
    let held = |(index, name): (usize, &&str)| {
        let pose = options.fixed.get(*name)?;
        let placed = Placed {
            world_from_sensor: *pose.room_from_sensor.isometry(),
            offset_s: pose.time_offset_ns as f64 * 1e-9,
            drift: 0.0,
        };
        Some((index, placed))
    };
    names.iter().enumerate().filter_map(held).collect()
}

fn indices(held: &[(usize, Placed)]) -> Vec<usize> {
    held.iter().map(|(index, _)| *index).collect()
}

/// Puts what is known of each pose and clock into the rows, and gives the covariances.
fn add_sigmas(
    evidence: &Evidence<'_>,
    refined: &Refined,
    rows: &mut [SensorRow],
) -> Vec<SensorCovariance> {
    let placed = refined.placed();
    if refined.setting.drift {
        let mean = placed.iter().map(|p| p.drift).sum::<f64>() / placed.len() as f64;
        for (row, placed) in rows.iter_mut().zip(placed) {
            // What is added to its stamps shrinks while a fast clock gains.
            row.clock_drift_ppm = Some((mean - placed.drift) * 1e6);
        }
    }
    let Some(covariance) = refined
        .bundled
        .covariance
        .as_ref()
        .filter(|_| rows.len() > 1)
    else {
        return Vec::new();
    };
    let held = &refined.setting.held;
    let known = posterior(
        covariance,
        evidence.names,
        placed,
        held,
        &evidence.room_from_world,
    );
    let mut covariances = Vec::new();
    for (row, known) in rows.iter_mut().zip(known) {
        if let Some((covariance, sigma)) = known {
            row.sigma = Some(sigma);
            covariances.push(covariance);
        }
    }
    covariances
}

/// Time offsets with the largest as 0: added to a capture time, none gives a time that is yet to come.
fn none_ahead(rows: &mut [SensorRow]) {
    let offsets = rows.iter().map(|row| row.time_offset_ms);
    let largest_ms = offsets.fold(f64::NEG_INFINITY, f64::max);
    for row in rows {
        row.time_offset_ms -= largest_ms;
    }
}

fn named(groups: &[Vec<usize>], names: &[&str]) -> Vec<Vec<String>> {
    let group = |group: &Vec<usize>| group.iter().map(|s| names[*s].to_owned()).collect();
    groups.iter().map(group).collect()
}

fn calibration(
    evidence: &Evidence<'_>,
    rows: &[SensorRow],
    floor: &floor::Floor,
    refined: &Refined,
    verdict: Verdict,
    options: &Options,
) -> Calibration {
    let pose = |(row, placed): (&SensorRow, &graph::Placed)| {
        let room_from_sensor = evidence.room_from_world * placed.world_from_sensor;
        let pose = SensorPose {
            room_from_sensor: Transform::from_isometry(room_from_sensor),
            time_offset_ns: (row.time_offset_ms * 1e6).round() as i64,
            residual_median_m: row.median_mm * 1e-3,
            residual_p95_m: row.p95_mm * 1e-3,
            samples: row.solved_samples,
            sigma: row.sigma,
        };
        // A sensor that was held stands where it stood, to the last bit.
        let held = options.fixed.get(&row.name);
        let pose = held.map_or(pose.clone(), |held| SensorPose {
            room_from_sensor: held.room_from_sensor,
            time_offset_ns: held.time_offset_ns,
            sigma: held.sigma,
            ..pose
        });
        (row.name.clone(), pose)
    };
    Calibration {
        created: options.created.clone(),
        method: if rows.len() > 1 { "svd" } else { "floor" }.to_owned(),
        floor: floor.row.source,
        verdict: verdict.name().to_owned(),
        sensors: rows.iter().zip(evidence.placed).map(pose).collect(),
        ray_bias_m: refined.ray_bias_m(),
        joint_offsets_m: refined.joint_offsets_m(),
    }
}
