//! What repair is to reach: the network that runs unless told otherwise beside the best simple method of each kind of gap.

use crate::aims::Aim;

use super::gaps::{BodyPart, GAPS_S};
use super::split::Tests;
use super::{Figures, ModelRun};

/// Shorter gaps are left to any method.
const FROM_S: f64 = 0.5;
/// The most that the error may be of the best simple method's.
const LIMITS: [(Tests, f64); 2] = [(Tests::HeldOut, 0.8), (Tests::Unseen, 1.05)];

/// The aims, of the networks that are the default. Where a simple method is, of the network with the least error on
/// held-out clips: whether it should be the default instead.
pub(super) fn check(models: &[ModelRun]) -> Vec<Aim> {
    let mut aims = Vec::new();
    for live in [true, false] {
        let own = |model: &&ModelRun| model.live == live;
        let simple: Vec<&ModelRun> = models.iter().filter(own).filter(|m| m.simple).collect();
        let networks = || models.iter().filter(own).filter(|m| !m.simple);
        let best = || networks().min_by(|a, b| held_out_mm(a).total_cmp(&held_out_mm(b)));
        let Some(network) = networks().find(|m| m.default).or_else(best) else {
            continue;
        };
        for (tests, limit) in LIMITS {
            for gap_s in GAPS_S.into_iter().filter(|gap_s| *gap_s >= FROM_S) {
                for part in BodyPart::ALL {
                    let error = |model: &ModelRun| {
                        let found: Option<&Figures> = model.of(tests, part, gap_s);
                        found.and_then(|figures| figures.mean_mm)
                    };
                    let best = simple.iter().filter_map(|model| error(model));
                    let best = best.reduce(f64::min);
                    let measured = error(network);
                    let value = measured.zip(best).map(|(own, best)| own / best);
                    let value = value.filter(|value| value.is_finite());
                    let kind = if live { "live" } else { "offline" };
                    aims.push(Aim {
                        room: part.name().to_owned(),
                        figure: format!("{kind}, {}: {}, {gap_s} s", network.name, tests.name()),
                        measured,
                        unit: "mm",
                        aim: format!("{limit} of the best simple one"),
                        value,
                        limit,
                        met: value.is_some_and(|value| value <= limit),
                    });
                }
            }
        }
    }
    aims
}

/// Mean error over all held-out gaps, mm.
fn held_out_mm(model: &ModelRun) -> f64 {
    let own = model.figures.iter().filter(|f| f.tests == Tests::HeldOut);
    let errors: Vec<f64> = own.filter_map(|f| f.mean_mm).collect();
    match errors.is_empty() {
        true => f64::INFINITY,
        false => errors.iter().sum::<f64>() / errors.len() as f64,
    }
}
