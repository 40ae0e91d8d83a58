//! From a walk to a calibration with its report.

use std::collections::BTreeSet;

use posefuse_skeleton::{Calibration, Joint, SensorPose, Timestamp, Transform};

use crate::diagnose::Case;
use crate::graph::{self, Edges};
use crate::refine::{Choice, Refined, refine};
use crate::residual::{Evidence, instants, pair_rows, sensor_rows};
use crate::tracks::SensorTracks;
use crate::{CalibrationError, Options, Report, SensorRow, SensorWalk, Solution, Verdict, Walk};
use crate::verdict::Findings;
use crate::{against, diagnose, floor, look, pair, verdict};

/// What lies between a body's skin and its joints, metres, with room for error. Beyond, the rays do not start at the
/// sensor: the two-Kinect recordings, which their logger turned and moved, give -80 to -340 mm.
const PLAUSIBLE_BIAS_M: std::ops::RangeInclusive<f64> = -0.015..=0.06;

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
    let blind: Vec<String> = sensors
        .iter()
        .filter(|sensor| sensor.is_empty())
        .map(|sensor| sensor.name.clone())
        .collect();
    if !blind.is_empty() {
        return Err(CalibrationError::NobodySeen { sensors: blind });
    }

    let (spacing_s, times, held_out) = instants(span_s, options);
    let solved: Vec<f64> = times
        .iter()
        .zip(&held_out)
        .filter_map(|(time, held_out)| (!held_out).then_some(*time))
        .collect();
    let max_offset_s = if options.time_offsets {
        options.max_time_offset_s
    } else {
        0.0
    };
    let edges = edges(&sensors, &solved, max_offset_s);
    let case = Case {
        walks: &walks,
        looks: &looks,
        start,
        times: &solved,
        spacing_s,
        max_offset_s,
    };
    let tree = graph::spanning_tree(sensors.len(), &edges).map_err(|groups| {
        CalibrationError::Disconnected {
            groups: named(&groups, &names),
            cause: diagnose::between(&case, &sensors, &groups),
        }
    })?;
    let placed = graph::place(sensors.len(), &tree, &edges);
    let (refined, ray_bias_mm) = refined(&sensors, &solved, placed, options);

    let seen: Vec<_> = sensors
        .iter()
        .zip(&refined.placed)
        .map(|(sensor, placed)| sensor.sample(&times, placed.offset_s))
        .collect();
    let floor = floor::find(&names, &seen, &refined.placed, root);
    let evidence = Evidence {
        names: &names,
        seen: &seen,
        held_out: &held_out,
        spacing_s,
        placed: &refined.placed,
        room_from_world: floor.room_from_world,
    };
    let pairs = pair_rows(&evidence, |a, b| tree.contains(&(a, b)));
    let rows = sensor_rows(&evidence, &pairs, &refined.samples, root);
    let pairs: Vec<_> = pairs.into_iter().map(|(_, row, _)| row).collect();
    let suspicions = verdict::suspicions(&rows, &pairs, options);
    let causes = suspicions.iter().filter_map(|s| diagnose::cause(&case, &sensors, *s));
    let ray_bias = Joint::ALL.map(|joint| (joint, ray_bias_mm.unwrap_or(0.0) * 1e-3));
    let findings = Findings {
        sensors: &rows,
        pairs: &pairs,
        floor: &floor.row,
        looks: &looks,
        against: &against::against(&evidence, &ray_bias.into_iter().collect()),
        turned: against::turned(&evidence),
        causes: &causes.collect::<Vec<_>>(),
    };
    let (verdict, reasons) = verdict::judge(&findings, options);
    let rows = none_ahead(rows);
    Ok(Solution {
        calibration: calibration(&evidence, &rows, &floor, verdict, options),
        report: Report {
            verdict,
            reasons,
            sensors: rows,
            pairs,
            floor: floor.row,
            ray_bias_mm,
            covariance: Vec::new(),
            duration_s: span_s,
        },
    })
}

/// The index of the root sensor among the sorted `names`.
fn validate(names: &[&str], options: &Options) -> Result<usize, CalibrationError> {
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(CalibrationError::DuplicateSensor(twice[0].to_owned()));
    }
    if names.is_empty() {
        return Err(CalibrationError::NoSensor);
    }
    let Some(root) = &options.root else {
        return Ok(0);
    };
    names
        .iter()
        .position(|name| name == root)
        .ok_or_else(|| CalibrationError::UnknownRoot {
            root: root.clone(),
            sensors: names.iter().map(|name| (*name).to_owned()).collect(),
        })
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

fn edges(sensors: &[SensorTracks], times: &[f64], max_offset_s: f64) -> Edges {
    let mut edges = Edges::new();
    for a in 0..sensors.len() {
        for b in a + 1..sensors.len() {
            if let Some(start) = pair::start(&sensors[a], &sensors[b], times, max_offset_s) {
                edges.insert((a, b), start);
            }
        }
    }
    edges
}

/// Refinement with the ray bias where that is wanted and what it finds can be skin; without it otherwise.
fn refined(
    sensors: &[SensorTracks],
    times: &[f64],
    placed: Vec<graph::Placed>,
    options: &Options,
) -> (Refined, Option<f64>) {
    let choice = |ray_bias| Choice {
        time_offsets: options.time_offsets,
        ray_bias,
    };
    if options.ray_bias && sensors.len() > 1 {
        let refined = refine(sensors, times, placed.clone(), choice(true));
        if PLAUSIBLE_BIAS_M.contains(&refined.bias_m) {
            let bias_mm = refined.bias_m * 1e3;
            return (refined, Some(bias_mm));
        }
    }
    (refine(sensors, times, placed, choice(false)), None)
}

/// Time offsets with the largest as 0: added to a capture time, none gives a time that is yet to come.
fn none_ahead(mut rows: Vec<SensorRow>) -> Vec<SensorRow> {
    let offsets = rows.iter().map(|row| row.time_offset_ms);
    let largest_ms = offsets.fold(f64::NEG_INFINITY, f64::max);
    for row in &mut rows {
        row.time_offset_ms -= largest_ms;
    }
    rows
}

fn named(groups: &[Vec<usize>], names: &[&str]) -> Vec<Vec<String>> {
    let group = |group: &Vec<usize>| group.iter().map(|s| names[*s].to_owned()).collect();
    groups.iter().map(group).collect()
}

fn calibration(
    evidence: &Evidence<'_>,
    rows: &[SensorRow],
    floor: &floor::Floor,
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
            ..SensorPose::default()
        };
        (row.name.clone(), pose)
    };
    Calibration {
        created: options.created.clone(),
        method: if rows.len() > 1 { "svd" } else { "floor" }.to_owned(),
        floor: floor.row.source,
        verdict: verdict.name().to_owned(),
        sensors: rows.iter().zip(evidence.placed).map(pose).collect(),
        ..Calibration::default()
    }
}
