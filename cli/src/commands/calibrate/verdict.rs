//! The outcome of a calibration, as a person reads it.

use crate::failure::Outcome;
use crate::output::{self, Style, line, paint, print_table};
use crate::views::{CalibrationView, PairView, SensorPoseView};

/// Most reasons that are printed; they come the worst first.
const REASONS: usize = 8;

/// What the columns mean, a line each.
const SENSOR_COLUMNS: [(&str, &str); 6] = [
    (
        "x y z",
        "where it stands: metres ahead, to the left and above the room's origin",
    ),
    (
        "median, p95",
        "how far half, and 95 %, of its joints at most lie from the other sensors', on frames the solver did not use",
    ),
    (
        "known to",
        "one standard deviation of its place, its direction and its delay",
    ),
    (
        "offset",
        "what its capture times are corrected by; only differences between sensors count",
    ),
    (
        "drift",
        "how fast its clock runs away, parts in a million; a dash: the walk was too short to tell",
    ),
    (
        "bones",
        "its bone lengths over the median of all sensors': 1 unless its tracker or its unit is off",
    ),
];
const PAIR_COLUMNS: [(&str, &str); 4] = [
    (
        "before",
        "how far two sensors' joints lie apart (median) if both are taken to stand in one place",
    ),
    (
        "after, p95",
        "the same with this calibration: median, and what 95 % stay below",
    ),
    (
        "agree",
        "share of shared frames in which most joints lie within 12 cm",
    ),
    (
        "mirrored",
        "share in which one of the two took left for right",
    ),
];

/// A failed calibration is a failure, a weak one a loss.
pub(crate) fn outcome(view: &CalibrationView) -> Outcome {
    match view.verdict {
        "passed" => Outcome::Done,
        "weak" => Outcome::DoneWithLoss,
        _ => Outcome::Failed,
    }
}

/// Prints verdict, reasons and tables.
pub(crate) fn print(view: &CalibrationView) -> anyhow::Result<()> {
    summary(view)?;
    if !view.sensors.is_empty() {
        line("")?;
        print_table(&sensors(&view.sensors))?;
        legend(&SENSOR_COLUMNS)?;
    }
    if !view.pairs.is_empty() {
        line("")?;
        print_table(&pairs(&view.pairs))?;
        legend(&PAIR_COLUMNS)?;
        let weakest = view.pairs.iter().find(|pair| pair.weakest);
        if let Some(weakest) = weakest.filter(|_| view.pairs.len() > 1) {
            line(format!(
                "weakest link: {} - {}; the room hangs together by it",
                weakest.a, weakest.b
            ))?;
        }
    }
    if let Some(mm) = view.ray_bias_mm {
        line(format!(
            "the trackers place joints {mm:.0} mm in front of where they are (mean); fusing moves them back"
        ))?;
    }
    if !view.sensors.is_empty() {
        line("")?;
    }
    Ok(())
}

fn legend(columns: &[(&str, &str)]) -> anyhow::Result<()> {
    for (name, meaning) in columns {
        line(paint(Style::Faint, &format!("  {name:<12} {meaning}")))?;
    }
    Ok(())
}

/// Prints verdict and reasons.
pub(crate) fn summary(view: &CalibrationView) -> anyhow::Result<()> {
    let style = match view.verdict {
        "passed" => Style::Good,
        "weak" => Style::Doubtful,
        _ => Style::Bad,
    };
    let verdict = paint(style, view.verdict);
    let worst = view
        .sensors
        .iter()
        .map(|s| s.residual_median_mm)
        .fold(f64::NAN, f64::max);
    line(match view.sensors.len() {
        // A failed one may have had nothing to be measured on.
        _ if view.verdict == "failed" && worst <= 0.0 => format!("calibration {verdict}"),
        0 => format!("calibration {verdict}"),
        1 => format!("calibration {verdict}: one sensor, laid on the floor"),
        n => format!(
            "calibration {verdict}: {} agree to {worst:.0} mm (median)",
            output::sensors(n)
        ),
    })?;
    for reason in view.reasons.iter().take(REASONS) {
        line(format!("  - {reason}"))?;
    }
    if view.reasons.len() > REASONS {
        let more = view.reasons.len() - REASONS;
        line(format!("  - and {more} more like these; --json names all"))?;
    }
    Ok(())
}

/// The table of the sensors; what is not known is a dash.
pub(crate) fn sensors(sensors: &[SensorPoseView]) -> Vec<Vec<String>> {
    let head = [
        "sensor",
        "x m",
        "y m",
        "z m",
        "median mm",
        "p95 mm",
        "known to",
        "offset ms",
        "drift ppm",
        "bones",
    ];
    let row = |s: &SensorPoseView| {
        let place = |axis: usize| {
            let at = s.position_m.map(|position| position[axis]);
            at.map_or_else(dash, |metres| format!("{metres:+.2}"))
        };
        let known = match (s.sigma_mm, s.sigma_deg, s.sigma_ms) {
            (Some(mm), Some(deg), Some(ms)) => format!("{mm:.1} mm {deg:.2}° {ms:.1} ms"),
            _ => dash(),
        };
        vec![
            s.sensor.clone(),
            place(0),
            place(1),
            place(2),
            format!("{:.0}", s.residual_median_mm),
            format!("{:.0}", s.residual_p95_mm),
            known,
            format!("{:+.1}", s.time_offset_ms),
            s.clock_drift_ppm
                .map_or_else(dash, |ppm| format!("{ppm:+.0}")),
            s.bone_scale
                .map_or_else(dash, |scale| format!("{scale:.3}")),
        ]
    };
    headed(&head, sensors.iter().map(row))
}

fn pairs(pairs: &[PairView]) -> Vec<Vec<String>> {
    let several = pairs.len() > 1;
    let head = [
        "pair",
        "before mm",
        "after mm",
        "p95 mm",
        "agree %",
        "mirrored %",
        "samples",
        "",
    ];
    let row = |p: &PairView| {
        vec![
            format!("{} - {}", p.a, p.b),
            // Of several people at once nothing can be told before they are matched.
            if p.before_median_mm > 0.0 {
                format!("{:.0}", p.before_median_mm)
            } else {
                dash()
            },
            format!("{:.0}", p.after_mm),
            format!("{:.0}", p.after_p95_mm),
            format!("{:.0}", p.agreeing_share * 100.0),
            format!("{:.0}", p.mirrored_share * 100.0),
            p.samples.to_string(),
            if several && p.weakest {
                paint(Style::Doubtful, "weakest")
            } else {
                String::new()
            },
        ]
    };
    headed(&head, pairs.iter().map(row))
}

fn dash() -> String {
    "-".to_owned()
}

/// A table with its headings.
pub(crate) fn headed(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Vec<Vec<String>> {
    let head = head.iter().map(|cell| paint(Style::Faint, cell)).collect();
    std::iter::once(head).chain(rows).collect()
}
