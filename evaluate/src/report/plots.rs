//! The report's plots.

use std::fmt::Write;

use super::svg::{Axis, COLOURS, Plot, escaped, number};
use super::{Group, Run};

const SIZE: [f64; 2] = [520.0, 300.0];
const WIDE: [f64; 2] = [1060.0, 260.0];
/// Shares beyond this are not drawn: a few gross errors would leave no room for all others.
const CDF_TO: f64 = 0.98;

/// How large a share of the joints is off by no more than so many millimetres.
pub(super) fn distribution(group: &Group, what: &str) -> String {
    let shown = |run: &Run| -> Vec<(f64, f64)> {
        let points = run.cdf.iter().filter(|(_, share)| *share <= CDF_TO);
        points.map(|(mm, share)| (*mm, share * 100.0)).collect()
    };
    let furthest = group
        .runs
        .iter()
        .filter_map(|run| Some(shown(run).last()?.0));
    let furthest = without_outlier(furthest.collect());
    let x = Axis::from_zero(&format!("{what}, mm"), std::iter::once(furthest));
    let y = Axis {
        label: "share of joints, %".into(),
        low: 0.0,
        high: 100.0,
        logarithmic: false,
    };
    let mut plot = Plot::new("distribution of the error", SIZE, x, y);
    for (series, run) in group.runs.iter().enumerate() {
        plot.line(series, &run.method, &shown(run));
    }
    plot.finish()
}

/// The largest of `values`, but for one that would leave the others no room.
fn without_outlier(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.as_slice() {
        [.., second, worst] if *worst > 2.0 * second => 1.4 * second,
        [.., worst] => *worst,
        [] => 0.0,
    }
}

/// What steadiness costs in delay. A method that smooths afterwards has none: its jitter is a line across.
pub(super) fn jitter_and_delay(group: &Group) -> String {
    let delay = |run: &Run| {
        let ahead = run.all.look_ahead_ms?;
        Some(run.all.lag_ms.unwrap_or(0.0).max(0.0) + ahead)
    };
    let jitter = |run: &Run| run.all.jitter_mps2.filter(|jitter| *jitter > 0.0);
    let points: Vec<(usize, &Run, f64, f64)> = group
        .runs
        .iter()
        .enumerate()
        .filter_map(|(series, run)| Some((series, run, delay(run)?, jitter(run)?)))
        .collect();
    let jitters = group.runs.iter().filter_map(jitter);
    let (low, high) = jitters.fold((f64::INFINITY, 0.0_f64), |(l, h), j| (l.min(j), h.max(j)));
    let known = low.is_finite() && high > 0.0;
    let x = Axis::from_zero(
        "delay: look-ahead and lag, ms",
        points.iter().map(|p| p.2 * 1.15),
    );
    let y = Axis {
        label: "jitter, m/s² (logarithmic)".into(),
        low: if known { low * 0.6 } else { 0.1 },
        high: if known { high * 1.6 } else { 10.0 },
        logarithmic: true,
    };
    let mut plot = Plot::new("jitter against delay", SIZE, x, y);
    for (series, run, delay, jitter) in points {
        let text = format!(
            "{}: {} m/s², {} ms",
            run.method,
            number(jitter),
            number(delay)
        );
        plot.dot(series, &text, (delay, jitter), &run.method);
    }
    for (series, run) in group.runs.iter().enumerate() {
        if let (None, Some(jitter)) = (delay(run), jitter(run)) {
            let text = format!("{}: {} m/s², afterwards", run.method, number(jitter));
            let label = format!("{}, afterwards", run.method);
            plot.level(series, &text, jitter, &label);
        }
    }
    plot.finish()
}

/// The error during the first run.
pub(super) fn over_time(group: &Group) -> Option<String> {
    let all = || group.runs.iter().flat_map(|run| &run.over_time);
    all().next()?;
    let largest = |run: &Run| run.over_time.iter().map(|(_, mm)| *mm).fold(0.0, f64::max);
    let most = without_outlier(group.runs.iter().map(largest).collect());
    let x = Axis::from_zero("time, s", all().map(|(s, _)| *s));
    let y = Axis::from_zero("mean error, mm", std::iter::once(most));
    let mut plot = Plot::new("error over time", WIDE, x, y);
    for (series, run) in group.runs.iter().enumerate() {
        plot.line(series, &run.method, &run.over_time);
    }
    Some(plot.finish())
}

/// The error of every joint, as rows of dots.
pub(super) fn by_joint(group: &Group) -> Option<String> {
    let joints: Vec<&str> = group
        .runs
        .first()?
        .all
        .by_joint_mm
        .keys()
        .copied()
        .collect();
    if joints.is_empty() {
        return None;
    }
    let worst = |run: &Run| run.all.by_joint_mm.values().copied().fold(1.0, f64::max);
    let worst = without_outlier(group.runs.iter().map(worst).collect());
    let mut rows = String::new();
    for joint in joints {
        let dots: String = group
            .runs
            .iter()
            .enumerate()
            .filter_map(|(series, run)| {
                let mm = run.all.by_joint_mm.get(joint)?;
                Some(format!(
                    "<i class=s{} style='left:{:.2}%' title='{}: {} mm'></i>",
                    series % COLOURS,
                    (100.0 * mm / worst).min(100.0),
                    escaped(&run.method),
                    number(*mm)
                ))
            })
            .collect();
        let best = group
            .runs
            .iter()
            .filter_map(|run| run.all.by_joint_mm.get(joint));
        let best = best.copied().fold(f64::INFINITY, f64::min);
        let _ = write!(
            rows,
            "<div class=joint><span>{}</span><div>{dots}</div><b>{} mm</b></div>",
            escaped(&spaced(joint)),
            number(best)
        );
    }
    Some(format!("<div class=joints>{rows}</div>"))
}

/// `HandTipLeft` as `hand tip left`.
fn spaced(joint: &str) -> String {
    let mut out = String::new();
    for c in joint.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push(' ');
        }
        out.extend(c.to_lowercase());
    }
    out
}
