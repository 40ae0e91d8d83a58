//! The figures as rows of text: models below each other, gaps beside each other.

use super::gaps::{BodyPart, GAPS_S};
use super::score::Figures;
use super::split::Tests;
use super::{ModelRun, RepairReport};

/// A figure that has a table of its own.
pub struct Figure {
    /// What it is, with the unit.
    pub name: &'static str,
    /// The same for a person who has not read a paper about it.
    pub about: &'static str,
    /// Digits after the point.
    pub digits: usize,
    /// It.
    pub value: fn(&Figures) -> Option<f64>,
    /// Whether the truth has it, too.
    pub of_truth: bool,
}

/// The tables of a report, in order.
pub const FIGURES: [Figure; 7] = [
    Figure {
        name: "mean error, mm",
        about: "mean distance of a hidden joint from where it truly is",
        digits: 0,
        value: |f| f.mean_mm,
        of_truth: false,
    },
    Figure {
        name: "p95, mm",
        about: "nineteen of twenty hidden joints are nearer than this",
        digits: 0,
        value: |f| f.p95_mm,
        of_truth: false,
    },
    Figure {
        name: "bones, mm",
        about: "how much bones with a hidden end are too long or too short",
        digits: 0,
        value: |f| f.bones_mm,
        of_truth: false,
    },
    Figure {
        name: "seam in, m/s2",
        about: "acceleration of the hidden joints at the step into the gap, root mean square, before anything is blended",
        digits: 0,
        value: |f| f.entering_mps2,
        of_truth: true,
    },
    Figure {
        name: "seam out, m/s2",
        about: "the same at the step out of the gap",
        digits: 0,
        value: |f| f.leaving_mps2,
        of_truth: true,
    },
    Figure {
        name: "within, %",
        about: "hidden joints within the uncertainty that the model states for 95 % of them",
        digits: 0,
        value: |f| f.within.map(|share| share * 100.0),
        of_truth: false,
    },
    Figure {
        name: "filled, %",
        about: "hidden joints that the model gave a place; the others count where they were last seen",
        digits: 0,
        value: |f| f.filled.map(|share| share * 100.0),
        of_truth: false,
    },
];

/// The rows of a table, the headings first: parts of the body, then lengths of gaps in seconds. Live models come before
/// offline ones, and what the truth does last.
pub fn rows(report: &RepairReport, tests: Tests, figure: &Figure) -> Vec<Vec<String>> {
    let kinds = || {
        let gaps = |part: BodyPart| GAPS_S.into_iter().map(move |gap_s| (part, gap_s));
        BodyPart::ALL.into_iter().flat_map(gaps)
    };
    let heading = |(part, gap_s): (BodyPart, f64)| match gap_s == GAPS_S[0] {
        true => part.name().to_owned(),
        false => String::new(),
    };
    let first = |text: &str| std::iter::once(text.to_owned());
    let mut rows: Vec<Vec<String>> = vec![
        first(figure.name).chain(kinds().map(heading)).collect(),
        first("")
            .chain(kinds().map(|(_, s)| format!("{s} s")))
            .collect(),
    ];
    let shown = |found: Option<&Figures>| {
        let value = found.and_then(figure.value);
        value.map_or_else(
            || "-".to_owned(),
            |value| format!("{value:.*}", figure.digits),
        )
    };
    let mut models: Vec<&ModelRun> = report.models.iter().collect();
    models.sort_by_key(|model| !model.live);
    for model in models {
        let cells = kinds().map(|(part, gap_s)| shown(model.of(tests, part, gap_s)));
        rows.push(first(&label(model)).chain(cells).collect());
    }
    if figure.of_truth {
        let truth = |(part, gap_s): (BodyPart, f64)| {
            let own = |f: &&Figures| (f.tests, f.part, f.gap_s) == (tests, part, gap_s);
            shown(report.truth.iter().find(own))
        };
        rows.push(first("(truth)").chain(kinds().map(truth)).collect());
    }
    rows
}

/// A model's name and what it is: offline, the default.
fn label(model: &ModelRun) -> String {
    let offline = if model.live { "" } else { " (offline)" };
    let default = if model.default { " *" } else { "" };
    format!("{}{offline}{default}", model.name)
}
