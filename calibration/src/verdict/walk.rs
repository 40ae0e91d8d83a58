//! Checks of the walk: what each sensor's own frames say, and whether the person's way suffices.

use super::{Findings, Reasons, above, below, list};
use crate::look::Look;
use crate::{Options, Reason, SensorRow, Verdict};

/// Share of frames with more than one person from which that is said.
pub(super) const CROWDED: f64 = 0.1;
/// A sensor whose last frame is older than this at the walk's end has left, seconds.
const GONE_S: f64 = 3.0;

/// What a sensor's own frames say.
pub(super) fn check_look(look: &Look, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    let name = look.name.as_str();
    reasons.add(
        above(look.hanging_share, limits.hanging_share),
        &[name],
        format!("`{name}` hangs upside down: it sees people head down, and its tracker was made for upright ones"),
        "turn the sensor the right way up, or turn its picture in its driver, then repeat",
    );
    reasons.add(
        above(look.backwards_share, limits.backwards_share),
        &[name],
        format!(
            "`{name}` exchanges left and right: people who face it, by their way or by their toes, show it their backs in \
             {:.0} % of its frames",
            look.backwards_share * 100.0
        ),
        "turn mirroring off in its driver or agent, and do not walk backwards; then repeat",
    );
    if look.gone_s > GONE_S {
        reasons.0.push(Reason {
            severity: Verdict::Passed,
            what: format!(
                "`{name}` sent nothing in the last {:.0} s of the walk",
                look.gone_s
            ),
            remedy: "check its agent; if the sensor was moved since, calibrate again".to_owned(),
            sensors: vec![name.to_owned()],
        });
    }
}

/// Whether each sensor saw enough of the walk. Sensors with the same complaint share a sentence, with the worst figure.
pub(super) fn check_way(findings: &Findings<'_>, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    let rows = findings.sensors;
    let long = |row: &SensorRow| row.spread_m[0];
    let worst = |of: &dyn Fn(&SensorRow) -> f64, check: &dyn Fn(&SensorRow) -> Verdict| {
        let bad: Vec<&SensorRow> = rows.iter().filter(|r| check(r) > Verdict::Passed).collect();
        let severity = bad.iter().map(|row| check(row)).max()?;
        let least = bad.iter().map(|row| of(row)).min_by(f64::total_cmp)?;
        Some((
            severity,
            least,
            bad.iter().map(|row| row.name.as_str()).collect::<Vec<_>>(),
        ))
    };
    let shared = |row: &SensorRow| below(row.shared_s, limits.shared_s);
    if let Some((severity, least, names)) = worst(&|row| row.shared_s, &shared) {
        let (with, remedy) = if rows.len() == 1 {
            ("", "walk longer in front of this sensor")
        } else {
            (
                " together with another sensor",
                "walk longer where this sensor and another see you at the same time",
            )
        };
        let what = format!("{} saw somebody{with} for {least:.1} s only", list(&names));
        reasons.add(severity, &names, what, remedy);
    }
    let stood = |row: &SensorRow| below(long(row), limits.spread_long_m);
    if let Some((severity, least, names)) = worst(&long, &stood) {
        let what = format!(
            "the person hardly moved in the view of {} (spread {least:.2} m)",
            list(&names)
        );
        reasons.add(
            severity,
            &names,
            what,
            "do not stand: walk through all of the room",
        );
    }
    // Somebody who turns on a line shows all sides, which holds the sensors as a wider way does.
    let turned = below(findings.turned, limits.turned);
    let on_a_line = |row: &SensorRow| {
        let narrow = below(row.spread_m[1], limits.spread_short_m);
        if stood(row) == Verdict::Failed {
            Verdict::Passed
        } else {
            narrow.min(turned)
        }
    };
    if let Some((severity, least, names)) = worst(&|row| row.spread_m[1], &on_a_line) {
        let what = format!(
            "the person walked on one line in the view of {} (spread across it {least:.2} m) and hardly turned",
            list(&names)
        );
        let remedy = "walk circles or a figure of eight through all of the room, and turn around now and then";
        reasons.add(severity, &names, what, remedy);
    }
}

/// Says that more than one person was seen, where the solver could tell them apart.
pub(super) fn note_crowd(looks: &[Look], reasons: &mut Reasons) {
    let crowded: Vec<String> = looks
        .iter()
        .filter(|look| look.crowded_share > CROWDED)
        .map(|look| look.name.clone())
        .collect();
    if let Some(most) = looks
        .iter()
        .map(|look| look.crowded_share)
        .max_by(f64::total_cmp)
        && !crowded.is_empty()
    {
        reasons.0.push(Reason {
                severity: Verdict::Passed,
                what: format!(
                    "more than one person was in view, in up to {:.0} % of a sensor's frames; those on whom the sensors \
                     agree were used",
                    most * 100.0
                ),
                remedy: "for the best result let one person walk alone".to_owned(),
                sensors: crowded,
            });
    }
}
