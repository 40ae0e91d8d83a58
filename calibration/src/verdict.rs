//! Whether to trust a calibration: every check, its words and its remedy. Limits are those of
//! [`Thresholds`](crate::Thresholds), which also says why.

use posefuse_skeleton::FloorSource;

use crate::{FloorRow, Options, PairRow, Reason, SensorRow, Verdict};

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

/// The worst of all reasons, and the reasons, worst first. A lone sensor is judged by the floor and the person's way, and
/// told so.
pub(crate) fn judge(
    sensors: &[SensorRow],
    pairs: &[PairRow],
    floor: &FloorRow,
    options: &Options,
) -> (Verdict, Vec<Reason>) {
    let mut reasons = Reasons(Vec::new());
    for row in sensors {
        check_view(row, sensors.len() == 1, options, &mut reasons);
    }
    if let [alone] = sensors {
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
        for row in sensors {
            check_agreement(row, options, &mut reasons);
        }
    }
    for row in pairs.iter().filter(|row| row.in_tree) {
        check_pair(row, options, &mut reasons);
    }
    check_floor(floor, options, &mut reasons);
    let mut reasons = reasons.0;
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.severity));
    let verdict = reasons.first().map_or(Verdict::Passed, |r| r.severity);
    (verdict, reasons)
}

/// Whether a sensor saw enough of the walk.
fn check_view(row: &SensorRow, alone: bool, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    let name = row.name.as_str();
    let (seen, remedy) = if alone {
        ("saw somebody", "walk longer in front of this sensor")
    } else {
        (
            "and another sensor saw somebody together",
            "walk longer where this sensor and another see you at the same time",
        )
    };
    reasons.add(
        below(row.shared_s, limits.shared_s),
        &[name],
        format!("`{name}` {seen} for {:.1} s only", row.shared_s),
        remedy,
    );
    reasons.add(
        below(row.spread_m[0], limits.spread_long_m),
        &[name],
        format!(
            "the person hardly moved in the view of `{name}` (spread {:.2} m)",
            row.spread_m[0]
        ),
        "do not stand: walk through all of the room",
    );
    if row.spread_m[0] >= limits.spread_long_m[1] {
        reasons.add(
            below(row.spread_m[1], limits.spread_short_m),
            &[name],
            format!(
                "the person walked on one line in the view of `{name}` (spread across it {:.2} m)",
                row.spread_m[1]
            ),
            "walk circles or a figure of eight through all of the room",
        );
    }
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
        "check that the sensor stands still, sees whole bodies and is not mirrored, then repeat",
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
    let limit_ms = options.max_time_offset_s * 1e3;
    let late = row.time_offset_ms.abs();
    reasons.add(
        above(late, [limit_ms * 0.99, limit_ms * 1.4]),
        &[name],
        format!(
            "the clock of `{name}` seems {:.0} ms off, beyond what is searched",
            row.time_offset_ms
        ),
        "restart the agent so that its clock is measured again, then repeat",
    );
}

fn check_pair(row: &PairRow, options: &Options, reasons: &mut Reasons) {
    let limits = &options.thresholds;
    let pair = [row.a.as_str(), row.b.as_str()];
    let [a, b] = pair;
    reasons.add(
        below(row.agreeing_share, limits.agreeing_share),
        &pair,
        format!(
            "`{a}` and `{b}` agree on the person in {:.0} % of their shared frames only",
            row.agreeing_share * 100.0
        ),
        "let one person walk alone, keep the sensors still, and repeat",
    );
    reasons.add(
        below(row.singular_ratio, limits.singular_ratio),
        &pair,
        format!(
            "what `{a}` and `{b}` saw together is flat (ratio {:.3})",
            row.singular_ratio
        ),
        "turn around, reach out and walk through all of the room",
    );
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
