//! What repair is to reach: the models that run unless told otherwise beside the best simple method of each kind of gap.

use crate::aims::Aim;

use super::gaps::{BodyPart, GAPS_S};
use super::split::Tests;
use super::{Figures, ModelRun};

/// Shorter gaps are left to any method.
const FROM_S: f64 = 0.5;
/// The most that the error may be of the best simple method's.
const LIMITS: [(Tests, f64); 2] = [(Tests::HeldOut, 0.8), (Tests::Unseen, 1.05)];

/// The aims, of the models that are the default and not simple themselves. Where there is none, the simple method stays
/// the default, and no aim is met.
pub(super) fn check(models: &[ModelRun]) -> Vec<Aim> {
    let mut aims = Vec::new();
    for live in [true, false] {
        let own = |model: &&ModelRun| model.live == live;
        let simple: Vec<&ModelRun> = models.iter().filter(own).filter(|m| m.simple).collect();
        let shipped = models.iter().filter(own).find(|m| m.default && !m.simple);
        if simple.is_empty() || models.iter().filter(own).all(|m| m.simple) {
            continue;
        }
        for (tests, limit) in LIMITS {
            for gap_s in GAPS_S.into_iter().filter(|gap_s| *gap_s >= FROM_S) {
                for part in BodyPart::ALL {
                    let error = |model: &ModelRun| {
                        let found: Option<&Figures> = model.of(tests, part, gap_s);
                        found.and_then(|figures| figures.mean_mm)
                    };
                    let best = simple.iter().filter_map(|model| error(model));
                    let best = best.reduce(f64::min);
                    let measured = shipped.and_then(error);
                    let value = measured.zip(best).map(|(own, best)| own / best);
                    let value = value.filter(|value| value.is_finite());
                    let kind = if live { "live" } else { "offline" };
                    aims.push(Aim {
                        room: part.name().to_owned(),
                        figure: format!("{kind}, {}, {gap_s} s", tests.name()),
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
