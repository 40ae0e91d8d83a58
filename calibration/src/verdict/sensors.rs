//! Checks of each sensor against the others.

use super::{Findings, Reasons, above};
use crate::against::Against;
use crate::stats::median;
use crate::{Options, SensorRow, Verdict};

/// Whether each sensor agrees with the others, and is known well enough.
pub(super) fn check_agreement(findings: &Findings<'_>, options: &Options, reasons: &mut Reasons) {
    for row in findings.sensors {
        check_residual(row, options, reasons);
        check_sigma(row, options, reasons);
    }
}

fn check_residual(row: &SensorRow, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    let name = row.name.as_str();
    if row.samples == 0 {
        let what = format!("no frame of `{name}` was left to check the result with");
        let remedy = "walk longer where this sensor and another see you at the same time";
        reasons.add(Verdict::Failed, &[name], what, remedy);
    }
    reasons.add(
        above(row.median_mm, limits.median_mm),
        &[name],
        format!(
            "`{name}` and the others place the same joint {:.0} mm apart (median)",
            row.median_mm
        ),
        "check that the sensor stands still and sees whole bodies, then repeat",
    );
    reasons.add(
        above((row.bone_scale - 1.0).abs(), limits.bone_share),
        &[name],
        format!(
            "`{name}` sees bones {:.2} times as long as the others do",
            row.bone_scale
        ),
        "check the sensor's unit (metres) and lens settings, and that only one person walks",
    );
}

/// Whether a clock is off by more than is searched, going by the middle one of all clocks.
pub(super) fn check_clocks(rows: &[SensorRow], options: &Options, reasons: &mut Reasons) {
    let limit_ms = options.max_time_offset_s * 1e3;
    let mut offsets: Vec<f64> = rows.iter().map(|row| row.time_offset_ms).collect();
    let middle_ms = median(&mut offsets).unwrap_or(0.0);
    for row in rows {
        let ahead_ms = middle_ms - row.time_offset_ms;
        let side = if ahead_ms > 0.0 { "ahead" } else { "behind" };
        reasons.add(
            above(ahead_ms.abs(), [limit_ms * 0.99, limit_ms * 1.4]),
            &[&row.name],
            format!(
                "the clock of `{}` seems {:.0} ms {side}, beyond what is searched",
                row.name,
                ahead_ms.abs()
            ),
            "restart its agent so that its clock is measured again, then repeat",
        );
    }
}

/// Whether the pose is known well enough.
fn check_sigma(row: &SensorRow, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    let name = row.name.as_str();
    let Some(sigma) = row.sigma else { return };
    let remedy =
        "walk longer and wider where this sensor and others see you, turn around, and reach out";
    reasons.add(
        above(sigma.position_m * 1e3, limits.sigma_mm),
        &[name],
        format!(
            "the place of `{name}` is known to {:.0} mm only",
            sigma.position_m * 1e3
        ),
        remedy,
    );
    let turn_deg = sigma.rotation_rad.to_degrees();
    reasons.add(
        above(turn_deg, limits.sigma_deg),
        &[name],
        format!("the direction of `{name}` is known to {turn_deg:.1} degrees only"),
        remedy,
    );
    reasons.add(
        above(sigma.time_s * 1e3, limits.sigma_ms),
        &[name],
        format!(
            "the delay of `{name}` is known to {:.0} ms only",
            sigma.time_s * 1e3
        ),
        "walk faster and swing your arms where this sensor and others see you",
    );
}

/// Whether all sensors have the same metre: the one furthest off is told, as it drags the others along. The severity.
pub(super) fn check_scale(
    findings: &Findings<'_>,
    options: &Options,
    reasons: &mut Reasons,
) -> Verdict {
    let off = |against: &Against| against.scale.ln().abs();
    let all = findings.sensors.iter().zip(findings.against);
    let Some((row, worst)) = all.max_by(|x, y| off(x.1).total_cmp(&off(y.1))) else {
        return Verdict::Passed;
    };
    let severity = above((worst.scale - 1.0).abs(), options.thresholds.scale_share);
    reasons.add(
        severity,
        &[&row.name],
        format!(
            "`{}` sees the same way {:.2} times as long as the others do",
            row.name, worst.scale
        ),
        "check the sensor's unit (metres) and lens settings, then repeat",
    );
    severity
}

/// Whether a sensor moved: the one that moved most is told, as the others seem to have moved against it.
pub(super) fn check_motion(findings: &Findings<'_>, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    let motions = findings.sensors.iter().zip(findings.against);
    let motions = motions.filter_map(|(row, against)| Some((row, against.motion?)));
    let Some((row, motion)) = motions.max_by(|x, y| x.1.sigmas.total_cmp(&y.1.sigmas)) else {
        return;
    };
    let severity =
        above(motion.by_mm, limits.moved_mm).min(above(motion.sigmas, limits.moved_sigmas));
    let names: Vec<&str> = match findings.sensors {
        [a, b] => vec![&a.name, &b.name],
        _ => vec![&row.name],
    };
    let named: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    reasons.add(
        severity,
        &names,
        format!(
            "{} moved during the walk, about {:.0} s after its start, by some {:.0} mm and {:.1} degrees",
            named.join(" or "),
            motion.at_s,
            motion.by_mm,
            motion.turn_deg
        ),
        "fix the sensor in place, let nobody touch it, then repeat",
    );
}
