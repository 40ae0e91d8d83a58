//! The outcome of a calibration, as a person reads it.

use crate::failure::Outcome;
use crate::output::{self, Style, line, paint, print_table};
use crate::views::CalibrationView;

/// Most reasons that are printed; they come the worst first.
const REASONS: usize = 8;

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
        print_table(&sensors(view))?;
    }
    if !view.pairs.is_empty() {
        line("")?;
        print_table(&pairs(view))?;
        line(paint(
            Style::Faint,
            "how far two sensors' joints lie apart, on frames the solver did not use: before, as if both stood in one place; \
             after, with this calibration",
        ))?;
        line("")?;
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

fn sensors(view: &CalibrationView) -> Vec<Vec<String>> {
    let head = [
        "sensor",
        "x m",
        "y m",
        "z m",
        "offset ms",
        "median mm",
        "p95 mm",
        "samples",
    ];
    let row = |s: &crate::views::SensorPoseView| {
        let [x, y, z] = s.position_m;
        vec![
            s.sensor.clone(),
            format!("{x:+.2}"),
            format!("{y:+.2}"),
            format!("{z:+.2}"),
            format!("{:+.1}", s.time_offset_ms),
            format!("{:.0}", s.residual_median_mm),
            format!("{:.0}", s.residual_p95_mm),
            s.samples.to_string(),
        ]
    };
    headed(&head, view.sensors.iter().map(row))
}

fn pairs(view: &CalibrationView) -> Vec<Vec<String>> {
    let head = ["pair", "before mm", "after mm", "p95 mm", "samples"];
    let row = |p: &crate::views::PairView| {
        vec![
            format!("{} - {}", p.a, p.b),
            format!("{:.0}", p.before_mm),
            format!("{:.0}", p.after_mm),
            format!("{:.0}", p.after_p95_mm),
            p.samples.to_string(),
        ]
    };
    headed(&head, view.pairs.iter().map(row))
}

fn headed(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Vec<Vec<String>> {
    let head = head.iter().map(|cell| paint(Style::Faint, cell)).collect();
    std::iter::once(head).chain(rows).collect()
}
