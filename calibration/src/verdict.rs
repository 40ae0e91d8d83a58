//! Whether to trust a calibration: every check, its words and its remedy. Limits are those of
//! [`Thresholds`](crate::Thresholds), which also says why.

use posefuse_skeleton::FloorSource;

use crate::against::Against;
use crate::diagnose::Suspicion;
use crate::look::Look;
use crate::stats::median;
use crate::{Cause, FloorRow, Options, PairRow, Reason, SensorRow, Verdict};

/// Share of frames with more than one person from which that is said.
const CROWDED: f64 = 0.1;
/// A sensor whose last frame is older than this at the walk's end has left, seconds.
const GONE_S: f64 = 3.0;

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
        check_look(look, options, &mut reasons);
    }
    check_way(findings, options, &mut reasons);
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
        for row in findings.sensors {
            check_agreement(row, options, &mut reasons);
            check_sigma(row, options, &mut reasons);
        }
        check_scale(findings, options, &mut reasons);
        check_motion(findings, options, &mut reasons);
    }
    let crowded = findings
        .looks
        .iter()
        .any(|look| look.crowded_share > CROWDED);
    for row in findings.pairs {
        check_pair(row, crowded, options, &mut reasons);
    }
    note_crowd(findings.looks, &mut reasons);
    check_floor(findings.floor, options, &mut reasons);
    let mut reasons = reasons.0;
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.severity));
    let verdict = reasons.first().map_or(Verdict::Passed, |r| r.severity);
    (verdict, reasons)
}

/// Causes go before the effects that they explain.
fn add_causes(causes: &[Cause], reasons: &mut Reasons) {
    for cause in causes {
        let (sensor, remedy) = match cause {
            Cause::Mirrored { sensor } => (
                sensor,
                "turn mirroring off in its driver or agent, then repeat",
            ),
            Cause::Clock { sensor, .. } => (
                sensor,
                "restart its agent so that its clock is measured again, then repeat",
            ),
            Cause::Apart | Cause::Sparse { .. } | Cause::Strangers { .. } => continue,
        };
        let what = cause.to_string();
        let what = what.split(':').next().unwrap_or_default().to_owned();
        reasons.add(Verdict::Failed, &[sensor], what, remedy);
    }
}

/// What a sensor's own frames say.
fn check_look(look: &Look, options: &Options, reasons: &mut Reasons) {
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
            "`{name}` exchanges left and right: people who come towards it walk backwards in {:.0} % of its frames",
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
fn check_way(findings: &Findings<'_>, options: &Options, reasons: &mut Reasons) {
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

fn list(names: &[&str]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Whether a sensor agrees with the others.
fn check_agreement(row: &SensorRow, options: &Options, reasons: &mut Reasons) {
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
fn check_clocks(rows: &[SensorRow], options: &Options, reasons: &mut Reasons) {
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

/// Whether all sensors have the same metre: the one furthest off is told, as it drags the others along. Whether something was said.
fn check_scale(findings: &Findings<'_>, options: &Options, reasons: &mut Reasons) -> bool {
    let off = |against: &Against| against.scale.ln().abs();
    let all = findings.sensors.iter().zip(findings.against);
    let Some((row, worst)) = all.max_by(|x, y| off(x.1).total_cmp(&off(y.1))) else {
        return false;
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
    severity > Verdict::Passed
}

/// Whether a sensor moved: the one that moved most is told, as the others seem to have moved against it.
fn check_motion(findings: &Findings<'_>, options: &Options, reasons: &mut Reasons) {
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

fn check_pair(row: &PairRow, crowded: bool, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    // A pair that shared a moment only says little, and holds nothing unless it is in the tree.
    if !row.in_tree && row.shared_s < limits.shared_s[0] {
        return;
    }
    let pair = [row.a.as_str(), row.b.as_str()];
    let [a, b] = pair;
    reasons.add(
        below(row.agreeing_share, limits.agreeing_share),
        &pair,
        format!(
            "`{a}` and `{b}` agree on the person in {:.0} % of their shared frames only",
            row.agreeing_share * 100.0
        ),
        if crowded {
            "several people were in view, and these sensors do not agree who is who: let one person walk alone, then repeat"
        } else {
            "let one person walk alone, keep the sensors still, then repeat"
        },
    );
    if row.in_tree {
        reasons.add(
            below(row.singular_ratio, limits.singular_ratio),
            &pair,
            format!(
                "what `{a}` and `{b}` saw together is flat (ratio {:.3})",
                row.singular_ratio
            ),
            "turn around, reach out and walk through all of the room",
        );
    }
    let [first, second] = row.halves_mm;
    if first > 0.0 && second > 0.0 {
        reasons.add(
            above((first - second).abs(), limits.halves_mm),
            &pair,
            format!("`{a}` and `{b}` agree to {first:.0} mm in the first half of the walk and {second:.0} mm in the second"),
            "a sensor may have been moved during the walk: fix it in place and repeat",
        );
    }
}

/// Says that more than one person was seen, where the solver could tell them apart.
fn note_crowd(looks: &[Look], reasons: &mut Reasons) {
    let crowded: Vec<String> = looks
        .iter()
        .filter(|look| look.crowded_share > CROWDED)
        .map(|look| look.name.clone())
        .collect();
    if let Some(most) = looks
        .iter()
        .map(|look| look.crowded_share)
        .max_by(f64::total_cmp)
    {
        if !crowded.is_empty() {
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
}

fn check_floor(floor: &FloorRow, options: &Options, reasons: &mut Reasons) {
    let limits = options.thresholds.floor_share;
    match floor.source {
        FloorSource::Manual => return,
        FloorSource::Assumed => {
            let what = "too few standing feet were seen to find the floor: the root sensor is assumed level";
            let remedy = "walk where feet are in view, or set the floor by hand";
            reasons.add(Verdict::Weak, &[], what.to_owned(), remedy);
        }
        FloorSource::Walk => reasons.add(
            below(floor.share_in_band, limits),
            &[],
            format!(
                "only {:.0} % of standing ankles lie on the floor that was found",
                floor.share_in_band * 100.0
            ),
            "walk where feet are in view, on one level, or set the floor by hand",
        ),
    }
    reasons.add(
        below(floor.heads_up_share, limits),
        &[],
        format!(
            "heads are above ankles in {:.0} % of bodies only",
            floor.heads_up_share * 100.0
        ),
        "stay upright while walking; check that no sensor reports its axes turned",
    );
    let below: Vec<&str> = floor.sensors_below.iter().map(String::as_str).collect();
    if !below.is_empty() {
        let what = format!("below the floor would stand: {}", below.join(", "));
        let remedy = "repeat the walk with feet in view of these sensors, or set the floor by hand";
        reasons.add(Verdict::Failed, &below, what, remedy);
    }
}
