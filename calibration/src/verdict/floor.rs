//! Checks of the floor.

use posefuse_skeleton::FloorSource;

use super::{Reasons, below};
use crate::{FloorRow, Options, Verdict};

/// Checks it.
pub(super) fn check(floor: &FloorRow, options: &Options, reasons: &mut Reasons) {
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
