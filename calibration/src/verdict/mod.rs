//! Whether to trust a calibration: every check, its words and its remedy. Limits are those of
//! [`Thresholds`](crate::Thresholds), which also says why.

mod floor;
mod pairs;
mod sensors;
mod walk;

use crate::against::Against;
use crate::diagnose::Suspicion;
use crate::look::Look;
use crate::{Cause, FloorRow, Options, PairRow, Reason, SensorRow, Verdict};

/// Which side of a pair of limits a value is on; larger is worse.
fn above(value: f64, limits: [f64; 2]) -> Verdict {
    if value > limits[1] {
        Verdict::Failed
    } else if value > limits[0] {
        Verdict::Weak
    } else {
        Verdict::Passed
    }
}

/// The same where smaller is worse.
fn below(value: f64, limits: [f64; 2]) -> Verdict {
    above(-value, limits.map(|limit| -limit))
}

struct Reasons(Vec<Reason>);

impl Reasons {
    fn add(&mut self, severity: Verdict, sensors: &[&str], what: String, remedy: &str) {
        if severity != Verdict::Passed {
            self.0.push(Reason {
                severity,
                what,
                remedy: remedy.to_owned(),
                sensors: sensors.iter().map(|s| (*s).to_owned()).collect(),
            });
        }
    }
}

/// Everything that is known of a solution.
pub(crate) struct Findings<'f> {
    pub(crate) sensors: &'f [SensorRow],
    pub(crate) pairs: &'f [PairRow],
    pub(crate) floor: &'f FloorRow,
    /// By sensor, as the next one.
    pub(crate) looks: &'f [Look],
    pub(crate) against: &'f [Against],
    /// How much the person turned: 0 not at all, 1 evenly all around.
    pub(crate) turned: f64,
    /// What explains sensors that do not agree.
    pub(crate) causes: &'f [Cause],
}

/// The pairs of sensors that disagree so much that a cause should be looked for: the suspect is the one that
/// disagrees more with all others.
pub(crate) fn suspicions(
    sensors: &[SensorRow],
    pairs: &[PairRow],
    options: &Options,
) -> Vec<Suspicion> {
    let limits = &options.thresholds;
    let index = |name: &str| sensors.iter().position(|row| row.name == name);
    let at_odds = |row: &&PairRow| {
        row.shared_s >= limits.shared_s[1]
            && (row.agreeing_share < limits.agreeing_share[1]
                || row.median_mm > limits.median_mm[1])
    };
    let mut odd: Vec<Suspicion> = pairs
        .iter()
        .filter(at_odds)
        .filter_map(|row| {
            let (a, b) = (index(&row.a)?, index(&row.b)?);
            let worse = sensors[a].median_mm > sensors[b].median_mm;
            let (suspect, other) = if worse { (a, b) } else { (b, a) };
            Some(Suspicion { suspect, other })
        })
        .collect();
    // One accuser for each suspect is enough.
    odd.sort_by_key(|suspicion| (suspicion.suspect, suspicion.other));
    odd.dedup_by_key(|suspicion| suspicion.suspect);
    odd
}

/// The worst of all reasons, and the reasons, worst first. A lone sensor is judged by the floor and the person's way, and
/// told so.
pub(crate) fn judge(findings: &Findings<'_>, options: &Options) -> (Verdict, Vec<Reason>) {
    let mut reasons = Reasons(Vec::new());
    add_causes(findings.causes, &mut reasons);
    for look in findings.looks {
        walk::check_look(look, options, &mut reasons);
    }
    walk::check_way(findings, options, &mut reasons);
    if let [alone] = findings.sensors {
        reasons.0.push(Reason {
            severity: Verdict::Passed,
            what: format!(
                "`{}` is the only sensor: it is laid on the floor, and nothing says how far off its joints are",
                alone.name
            ),
            remedy: "start a second agent and calibrate again, to see people from more than one side".to_owned(),
            sensors: vec![alone.name.clone()],
        });
    } else {
        sensors::check_agreement(findings, options, &mut reasons);
        // What a mirrored picture or a wrong clock does to clocks, scales and motions needs no telling.
        if findings.causes.is_empty() {
            sensors::check_clocks(findings.sensors, options, &mut reasons);
            if sensors::check_scale(findings, options, &mut reasons) == Verdict::Passed {
                sensors::check_motion(findings, options, &mut reasons);
            }
            pairs::check(findings, options, &mut reasons);
        }
    }
    walk::note_crowd(findings.looks, &mut reasons);
    floor::check(findings.floor, options, &mut reasons);
    let mut reasons = reasons.0;
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.severity));
    let verdict = reasons.first().map_or(Verdict::Passed, |r| r.severity);
    (verdict, reasons)
}

/// Causes go before the effects that they explain.
fn add_causes(causes: &[Cause], reasons: &mut Reasons) {
    for cause in causes {
        let (sensors, remedy) = match cause {
            Cause::Mirrored { sensors } => (
                sensors.iter().map(String::as_str).collect(),
                "turn mirroring off in its driver or agent, then repeat",
            ),
            Cause::Clock { sensor, .. } => (
                vec![sensor.as_str()],
                "restart its agent so that its clock is measured again, then repeat",
            ),
            Cause::Apart | Cause::Sparse { .. } | Cause::Strangers { .. } => continue,
        };
        let text = cause.to_string();
        let what = text
            .rsplit_once(": ")
            .map_or(text.as_str(), |(what, _)| what);
        reasons.add(Verdict::Failed, &sensors, what.to_owned(), remedy);
    }
}

fn list(names: &[&str]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}
