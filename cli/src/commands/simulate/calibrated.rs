//! Where the sensors of a simulated room stand: as they truly do, or as a calibration from a walk finds.

use anyhow::bail;
use posefuse_fusion::Config;
use posefuse_simulator::World;
use posefuse_skeleton::Calibration;

use crate::offline::{from_simulated_walk, now_rfc3339};
use crate::progress;
use crate::views::CalibrationView;

/// Where the sensors truly stand.
pub(super) fn truly(world: &World) -> Calibration {
    Calibration {
        created: now_rfc3339(),
        ..world.true_calibration()
    }
}

/// Solves from one person's walk of `seconds` in the same room, before the take. A failed verdict is an error.
pub(super) fn from_walk(
    world: &World,
    seconds: f64,
    config: &Config,
) -> anyhow::Result<(Calibration, CalibrationView)> {
    let bar = progress::bar((seconds * 10.0) as u64, "walking");
    let solution = from_simulated_walk(world, seconds, config, &mut |done| {
        bar.set_position((done * 10.0) as u64);
    });
    bar.finish_and_clear();
    let solution = solution?;
    let view = CalibrationView::of_solution(&solution);
    if view.verdict == "failed" {
        let reasons = view.reasons.join("; ");
        bail!(
            "the calibration from the simulated walk failed: {reasons}; try --walk 90, or --true-calibration"
        );
    }
    Ok((solution.calibration, view))
}
