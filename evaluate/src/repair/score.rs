//! What is counted of a model on many gaps, and the figures that makes.

use serde::Serialize;

use crate::histogram::Histogram;
use crate::tally::Mean;

use super::gaps::BodyPart;
use super::split::Tests;

/// Counts and sums; [`Figures`] says what they mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Score {
    pub(super) gaps: u64,
    /// Distances of hidden joints from where they truly are, metres.
    pub(super) error: Histogram,
    /// How much a bone is too long or too short, metres.
    pub(super) bones: Mean,
    /// Squared accelerations.
    pub(super) entering: Mean,
    pub(super) leaving: Mean,
    pub(super) within: Mean,
    pub(super) filled: Mean,
    /// By pose, seconds.
    pub(super) busy_s: Mean,
}

impl Score {
    pub(super) fn merge(&mut self, other: &Self) {
        self.gaps += other.gaps;
        self.error.merge(&other.error);
        for (mine, theirs) in [
            (&mut self.bones, &other.bones),
            (&mut self.entering, &other.entering),
            (&mut self.leaving, &other.leaving),
            (&mut self.within, &other.within),
            (&mut self.filled, &other.filled),
            (&mut self.busy_s, &other.busy_s),
        ] {
            mine.merge(theirs);
        }
    }
}

/// One model on gaps of one length of one part of the body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Which recordings.
    pub tests: Tests,
    /// What was hidden.
    pub part: BodyPart,
    /// For how long, seconds.
    pub gap_s: f64,
    /// In how many gaps.
    pub gaps: u64,
    /// Mean distance of a hidden joint from where it truly is, mm. `None` where there was nothing, as in all others.
    pub mean_mm: Option<f64>,
    /// Nineteen of twenty are nearer than this, mm.
    pub p95_mm: Option<f64>,
    /// How much bones with a hidden end are too long or too short, mean, mm.
    pub bones_mm: Option<f64>,
    /// Second difference of the hidden joints at the step into the gap, root mean square, m/s^2.
    pub entering_mps2: Option<f64>,
    /// The same at the step out of it.
    pub leaving_mps2: Option<f64>,
    /// Share of joints no further off than their stated uncertainty lets 95 % of them be.
    pub within: Option<f64>,
    /// Share of the hidden joints that the model gave a place; the others count where they were last seen.
    pub filled: Option<f64>,
}

impl Figures {
    pub(super) fn new(tests: Tests, part: BodyPart, gap_s: f64, score: &Score) -> Self {
        let mm = |metres: Option<f64>| metres.map(|metres| metres * 1e3);
        let root = |squares: &Mean| squares.mean().map(f64::sqrt);
        Self {
            tests,
            part,
            gap_s,
            gaps: score.gaps,
            mean_mm: mm(score.error.mean_m()),
            p95_mm: mm(score.error.quantile_m(0.95)),
            bones_mm: mm(score.bones.mean()),
            entering_mps2: root(&score.entering),
            leaving_mps2: root(&score.leaving),
            within: score.within.mean(),
            filled: score.filled.mean(),
        }
    }
}
