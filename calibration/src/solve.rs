//! From a walk to a calibration with its report.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use posefuse_skeleton::{Calibration, SensorPose, Timestamp, Transform};

use crate::bundle::sample;
use crate::diagnose::Case;
use crate::graph::{self, Edges, Placed};
use crate::posterior::posterior;
use crate::refine::{Refined, refine};
use crate::residual::{Evidence, instants, pair_rows, sensor_rows};
use crate::tracks::SensorTracks;
use crate::verdict::Findings;
use crate::{
    CalibrationError, HandFloor, Options, Report, SensorCovariance, SensorRow, SensorWalk,
    Solution, Verdict, Walk,
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
    let floor = if held.is_empty() {
        floor::find(
            &names,
            &seen,
            refined.placed(),
            root,
            options.floor.as_ref(),
        )
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
    let weakest = graph::weakest(&tree, &edges);
    let pairs = pair_rows(&evidence, |pair| {
        (tree.contains(&pair), weakest == Some(pair))
    });
    // Sensors that are held keep their offsets, and so the room its clock.
    let clock_s = if held.is_empty() {
        refined.placed()[root].offset_s
    } else {
        0.0
    };
    let mut rows = sensor_rows(&evidence, &pairs, &refined.bundled.samples, clock_s);
    let covariance = add_sigmas(&evidence, &refined, &mut rows);
    let pairs: Vec<_> = pairs.into_iter().map(|(_, row, _)| row).collect();
    let suspicions = verdict::suspicions(&rows, &pairs, options);
    let causes = suspicions
        .iter()
        .filter_map(|s| diagnose::cause(&case, &sensors, *s));
    let findings = Findings {
        sensors: &rows,
        pairs: &pairs,
        floor: &floor.row,
        looks: &looks,
        against: &against::against(&evidence),
        turned: against::turned(&evidence),
        causes: &causes.collect::<Vec<_>>(),
    };
    let (verdict, mut reasons) = verdict::judge(&findings, options);
    reasons.extend(refined.notes());
    let rows = if held.is_empty() {
        none_ahead(rows)
    } else {
        rows
    };
    Ok(Solution {
        calibration: calibration(&evidence, &rows, &floor, &refined, verdict, options),
        report: Report {
            verdict,
            reasons,
            sensors: rows,
            pairs,
            floor: floor.row,
            ray_bias_mm: refined.ray_bias_mm(),
            covariance,
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
    if let Some(hand) = &options.floor {
        validate_floor(hand, names)?;
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

/// Whether a floor set by hand can be one.
fn validate_floor(hand: &HandFloor, names: &[&str]) -> Result<(), CalibrationError> {
    let refused = |what: &str| Err(CalibrationError::HandFloor(what.to_owned()));
    if !names.contains(&hand.sensor.as_str()) {
        return refused("its `sensor` must be one of this walk");
    }
    let up = hand.up.map(Vector3::from);
    if up.is_some_and(|up| !(1e-6..1e6).contains(&up.norm())) {
        return refused("its `up` must be a direction, such as [0, -1, 0] for a level sensor");
    }
    let numbers = [hand.height_m, hand.looks_deg].into_iter().flatten();
    if numbers
        .chain(hand.at_m.into_iter().flatten())
        .any(|n| n.abs() > 1e4 || n.is_nan())
    {
        return refused(
            "its `height_m`, `at_m` and `looks_deg` must be lengths in metres and an angle in degrees",
        );
    }
    Ok(())
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
