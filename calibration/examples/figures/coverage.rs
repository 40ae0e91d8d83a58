//! Whether the collector's share tells when a walk suffices: walks that end when it says so.

use posefuse_calibration::{Collector, Coverage, Options, Verdict, Walk, solve};
use posefuse_simulator::World;
use posefuse_skeleton::SensorId;

use crate::accuracy::median;
use crate::simulated::{bodies, pair_errors};
use crate::survey::Surveyed;

/// The longest walk, seconds.
pub(crate) const LONGEST_S: f64 = 90.0;
/// The share of walks that must pass, and the median error that they may have, mm.
const PASSED: f64 = 0.95;
const MEDIAN_MM: f64 = 8.0;

/// A walk that ended when the collector said that it suffices.
pub(crate) struct Stopped {
    /// What share was reached after 10 and after 30 seconds.
    after: [f64; 2],
    /// When it was 1, seconds; `None`: never, and then with the hint of the end.
    full_at_s: Result<f64, String>,
    /// What came of a walk that ended then.
    verdict: Option<Verdict>,
    reasons: Vec<String>,
    /// Volume RMS of each pair of sensors, mm.
    errors_mm: Vec<f64>,
}

pub(crate) fn stopped(world: &World, walk: &Walk) -> Stopped {
    let id = |index: usize| SensorId::new(index).expect("few sensors");
    let names = walk.sensors.iter().enumerate();
    let mut collector = Collector::new(names.map(|(index, s)| (id(index), s.name.clone())));
    let frames = walk.sensors.iter().enumerate();
    let mut frames: Vec<_> = frames
        .flat_map(|(index, sensor)| sensor.frames.iter().map(move |frame| (index, frame)))
        .collect();
    frames.sort_by_key(|(index, frame)| (frame.time, *index));
    let (mut after, mut coverage) = ([0.0; 2], Coverage::default());
    let mut asked_s = f64::NEG_INFINITY;
    let mut stopped_s = None;
    for (index, frame) in frames {
        let time = frame.time.seconds();
        collector.add(id(index), frame.time, &bodies(id(index), frame));
        if time - asked_s < 0.1 {
            continue;
        }
        asked_s = time;
        coverage = collector.coverage();
        for (after, limit_s) in after.iter_mut().zip([10.0, 30.0]) {
            if time < limit_s {
                *after = coverage.share;
            }
        }
        if coverage.share >= 1.0 {
            stopped_s = Some(time);
            break;
        }
    }
    if let Some(time) = stopped_s {
        after
            .iter_mut()
            .zip([10.0, 30.0])
            .for_each(|(after, limit_s)| {
                if time < limit_s {
                    *after = 1.0;
                }
            });
    }
    let solution = stopped_s.map(|_| solve(&collector.walk(), &Options::default()));
    let seconds = stopped_s.unwrap_or(LONGEST_S);
    let (verdict, reasons, errors_mm) = match solution {
        None => (None, Vec::new(), Vec::new()),
        Some(Err(error)) => (Some(Verdict::Failed), vec![error.to_string()], Vec::new()),
        Some(Ok(solution)) => {
            let errors = pair_errors(world, &solution.calibration, seconds);
            let report = solution.report;
            let bad = report
                .reasons
                .into_iter()
                .filter(|r| r.severity > Verdict::Passed);
            let errors = errors.into_iter().map(|(_, error)| error.volume_mm);
            (
                Some(report.verdict),
                bad.map(|r| r.what).collect(),
                errors.collect(),
            )
        }
    };
    Stopped {
        after,
        full_at_s: stopped_s.ok_or(coverage.hint),
        verdict,
        reasons,
        errors_mm,
    }
}

/// Prints it; whether the promise holds.
pub(crate) fn print(rooms: &[Surveyed]) -> bool {
    println!(
        "\nCoverage: walks that end when the collector's share is 1 (at most {LONGEST_S:.0} s)"
    );
    println!(
        "{:<24}{:>16}{:>16}{:>26}{:>10}{:>10}{:>18}",
        "room",
        "share at 10 s",
        "share at 30 s",
        "full at s, median/last",
        "never",
        "passed",
        "mm median/worst"
    );
    let key = |room: &Surveyed| (room.layout, room.sensors, room.biased);
    let mut all: Vec<(bool, &Stopped)> = Vec::new();
    for group in rooms.chunk_by(|x, y| key(x) == key(y)) {
        let stopped: Vec<&Stopped> = group.iter().filter_map(|r| r.coverage.as_ref()).collect();
        let (layout, sensors, biased) = key(&group[0]);
        all.extend(stopped.iter().map(|s| (biased, *s)));
        let bias = if biased { ", 8 mm bias" } else { "" };
        let times: Vec<f64> = stopped
            .iter()
            .filter_map(|s| s.full_at_s.clone().ok())
            .collect();
        let errors: Vec<f64> = stopped.iter().flat_map(|s| s.errors_mm.clone()).collect();
        let passed = stopped
            .iter()
            .filter(|s| s.verdict == Some(Verdict::Passed));
        println!(
            "{:<24}{:>16.2}{:>16.2}{:>26}{:>10}{:>10}{:>18}",
            format!("{layout:?} of {sensors}{bias}"),
            median(stopped.iter().map(|s| s.after[0])),
            median(stopped.iter().map(|s| s.after[1])),
            format!("{:.0}/{:.0}", median(times.iter().copied()), worst(&times)),
            stopped.len() - times.len(),
            passed.count(),
            format!(
                "{:.1}/{:.1}",
                median(errors.iter().copied()),
                worst(&errors)
            )
        );
        for (room, stopped) in group.iter().zip(&stopped) {
            if let Err(hint) = &stopped.full_at_s {
                println!("    seed {}: never: {hint}", room.seed);
            }
            for reason in &stopped.reasons {
                println!("    seed {}: {reason}", room.seed);
            }
        }
    }
    totals(&all)
}

/// Prints all walks together; whether the promise holds.
fn totals(all: &[(bool, &Stopped)]) -> bool {
    let ended: Vec<&(bool, &Stopped)> = all.iter().filter(|(_, s)| s.full_at_s.is_ok()).collect();
    let passed = ended
        .iter()
        .filter(|(_, s)| s.verdict == Some(Verdict::Passed))
        .count();
    let share = passed as f64 / ended.len().max(1) as f64;
    let errors = |biased: bool| {
        let of = ended.iter().filter(move |(b, _)| *b == biased);
        median(of.flat_map(|(_, s)| s.errors_mm.clone()))
    };
    println!(
        "{} of {} walks sufficed; {:.1} % of those passed (aim {:.0} %); median error {:.1} mm (aim {MEDIAN_MM}), with 8 mm bias {:.1} mm",
        ended.len(),
        all.len(),
        share * 100.0,
        PASSED * 100.0,
        errors(false),
        errors(true)
    );
    share >= PASSED && errors(false) <= MEDIAN_MM
}

fn worst(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
