//! Checks of each pair of sensors that saw somebody together, in the tree or not.

use super::walk::CROWDED;
use super::{Findings, Reasons, above, below};
use crate::{Options, PairRow};

/// Checks all pairs.
pub(super) fn check(findings: &Findings<'_>, options: &Options, reasons: &mut Reasons) {
    let crowded = findings
        .looks
        .iter()
        .any(|look| look.crowded_share > CROWDED);
    for row in findings.pairs {
        check_pair(row, crowded, options, reasons);
    }
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
