//! Figures as rows of text.

use crate::metrics::Metrics;

/// A column: its heading, what it means in one line, and how a run's figure is written in it.
pub struct Column {
    /// The heading.
    pub name: &'static str,
    /// The unit; empty for a count or share.
    pub unit: &'static str,
    /// What it means, for a person who has not read a paper about it.
    pub about: &'static str,
    /// Whether smaller is better.
    pub smaller_is_better: bool,
    /// The figure; `None` where a run has none.
    pub value: fn(&Metrics) -> Option<f64>,
    /// Digits after the point.
    pub digits: usize,
}

const fn column(
    name: &'static str,
    unit: &'static str,
    about: &'static str,
    digits: usize,
    value: fn(&Metrics) -> Option<f64>,
) -> Column {
    Column {
        name,
        unit,
        about,
        smaller_is_better: true,
        value,
        digits,
    }
}

/// The columns of runs with truth.
pub const WITH_TRUTH: [Column; 19] = [
    column(
        "error",
        "mm",
        "mean distance of a joint from where it truly is, but for the part that no sensor can see (where a tracker takes a joint to lie in the body)",
        1,
        |m| m.own_error.mean_mm,
    ),
    column(
        "p95",
        "mm",
        "nineteen of twenty joints are nearer than this",
        1,
        |m| m.own_error.p95_mm,
    ),
    column(
        "visible",
        "mm",
        "the error of joints that at least one sensor truly sees",
        1,
        |m| m.own_error_visible.mean_mm,
    ),
    column(
        "hidden",
        "mm",
        "the error of joints that no sensor sees, so that they must be guessed",
        1,
        |m| m.own_error_occluded.mean_mm,
    ),
    column(
        "MPJPE",
        "mm",
        "the error with everything in it: what a marker system beside ours would measure",
        1,
        |m| m.error.mean_mm,
    ),
    column(
        "lag",
        "ms",
        "how much older the motion is than it says",
        0,
        |m| m.lag_ms,
    ),
    column(
        "ahead",
        "ms",
        "how long a frame waits for newer ones before it comes out; a choice",
        0,
        |m| m.look_ahead_ms,
    ),
    column(
        "jitter",
        "m/s2",
        "how much a joint shakes: false acceleration, root mean square",
        1,
        |m| m.jitter_mps2,
    ),
    column(
        "bones",
        "mm",
        "how much the length of a bone changes over the take (standard deviation)",
        1,
        |m| m.bone_sigma_mm,
    ),
    column(
        "wrist",
        "cm",
        "mean distance of a wrist from where it truly is (Menard's absolute difference)",
        1,
        |m| m.wrist_absolute_cm,
    ),
    column(
        "nearest",
        "cm",
        "the same to the nearest place where it truly was within 0.2 s (Menard's shortest distance)",
        1,
        |m| m.wrist_shortest_cm,
    ),
    column(
        "spikes",
        "/min",
        "how often a joint jumps by 10 cm within four frames and should not",
        1,
        |m| m.spikes_per_min,
    ),
    column(
        "strays",
        "/min",
        "how often a joint stays 20 cm off for a third of a second (Menard's deviations)",
        1,
        |m| m.deviations_per_min,
    ),
    column("ids", "", "how often a person got another number", 0, |m| {
        Some(m.id_switches as f64)
    }),
    column(
        "missed",
        "%",
        "people in sight whom nobody follows, share of their frames",
        2,
        |m| m.people_missed.map(|share| share * 100.0),
    ),
    column(
        "extra",
        "%",
        "people who are not there, share of all that are shown",
        2,
        |m| m.tracks_extra.map(|share| share * 100.0),
    ),
    Column {
        smaller_is_better: false,
        ..column(
            "sides",
            "%",
            "frames in which left and right of the fused person are right",
            2,
            |m| m.sides_right.map(|share| share * 100.0),
        )
    },
    Column {
        smaller_is_better: false,
        ..column(
            "swaps",
            "%",
            "bodies in sensors' frames whose exchanged left and right were found out, or rightly left alone",
            2,
            |m| m.swaps_right.map(|share| share * 100.0),
        )
    },
    column("engine", "us", "what one frame costs on one core", 0, |m| {
        m.engine_us_per_frame
    }),
];

/// The columns of runs without truth.
pub const ALONE: [Column; 9] = [
    column(
        "left out",
        "mm",
        "how far a sensor's own joints are from what the other sensors make of them: median, mean over the sensors",
        1,
        |m| m.left_out_median_mm,
    ),
    column(
        "rms",
        "mm",
        "the same as root mean square: gross errors count for more",
        1,
        |m| m.left_out.rms_mm,
    ),
    column(
        "p95",
        "mm",
        "nineteen of twenty joints are nearer than this",
        1,
        |m| m.left_out.p95_mm,
    ),
    Column {
        smaller_is_better: false,
        ..column(
            "sides",
            "%",
            "bodies on whose left and right a left-out sensor and the others agree",
            1,
            |m| m.left_out_sides.map(|share| share * 100.0),
        )
    },
    column(
        "jitter",
        "m/s2",
        "how much a joint shakes: acceleration that its smooth motion over 0.4 s does not explain",
        1,
        |m| m.jitter_mps2,
    ),
    column(
        "bones",
        "mm",
        "how much the length of a bone changes over the take (standard deviation)",
        1,
        |m| m.bone_sigma_mm,
    ),
    column(
        "spikes",
        "/min",
        "how often a joint goes out by 10 cm and back within four frames",
        1,
        |m| m.spikes_per_min,
    ),
    column(
        "ahead",
        "ms",
        "how long a frame waits for newer ones before it comes out; a choice",
        0,
        |m| m.look_ahead_ms,
    ),
    column("engine", "us", "what one frame costs on one core", 0, |m| {
        m.engine_us_per_frame
    }),
];

/// The columns of what repair does, of runs with it.
pub const REPAIR: [Column; 11] = [
    column(
        "hidden",
        "",
        "joints hidden from every sensor that are there with repair and without it",
        0,
        |m| Some(m.repair.as_ref()?.hidden as f64),
    ),
    column("without", "mm", "their mean error without repair", 1, |m| {
        m.repair.as_ref()?.without_mm
    }),
    column("with", "mm", "their mean error with repair", 1, |m| {
        m.repair.as_ref()?.with_mm
    }),
    column(
        "p95 without",
        "mm",
        "nineteen of twenty of them are nearer than this without repair",
        0,
        |m| m.repair.as_ref()?.without_p95_mm,
    ),
    column("p95 with", "mm", "the same with repair", 0, |m| {
        m.repair.as_ref()?.with_p95_mm
    }),
    column(
        "only with",
        "",
        "hidden joints that are there only with repair",
        0,
        |m| Some(m.repair.as_ref()?.only_with as f64),
    ),
    column("their error", "mm", "their mean error", 1, |m| {
        m.repair.as_ref()?.only_with_mm
    }),
    column(
        "claimed",
        "",
        "of the hidden joints those that a tracker took for seen: they count as measured",
        0,
        |m| Some(m.repair.as_ref()?.claimed as f64),
    ),
    column(
        "seen, changed",
        "%",
        "joints that a sensor sees and that were measured, moved by repair by more than 0.1 mm",
        3,
        |m| m.repair.as_ref()?.changed.map(|share| share * 100.0),
    ),
    column(
        "settled",
        "%",
        "the same of those that have been seen and measured for half a second and longer",
        2,
        |m| {
            let share = m.repair.as_ref()?.settled_changed;
            share.map(|share| share * 100.0)
        },
    ),
    column(
        "by at most",
        "mm",
        "the furthest that one of these was moved",
        2,
        |m| m.repair.as_ref()?.most_changed_mm,
    ),
];

/// The rows of a table, headings and units first: `labels` name each row.
pub fn rows<'a>(
    columns: &[Column],
    label: &str,
    runs: impl IntoIterator<Item = (&'a str, &'a Metrics)>,
) -> Vec<Vec<String>> {
    let heading = |text: fn(&Column) -> &str, first: &str| {
        std::iter::once(first.to_owned())
            .chain(columns.iter().map(|column| text(column).to_owned()))
            .collect::<Vec<_>>()
    };
    let mut rows = vec![heading(|c| c.name, label), heading(|c| c.unit, "")];
    for (name, metrics) in runs {
        let cells = columns.iter().map(|column| cell(column, metrics));
        rows.push(std::iter::once(name.to_owned()).chain(cells).collect());
    }
    rows
}

/// The figure as text; `-` where there is none.
pub fn cell(column: &Column, metrics: &Metrics) -> String {
    (column.value)(metrics).map_or_else(
        || "-".to_owned(),
        |value| {
            let rounded = format!("{value:.*}", column.digits);
            // Minus nothing reads oddly.
            match rounded
                .trim_start_matches('-')
                .chars()
                .all(|c| "0.".contains(c))
            {
                true => rounded.trim_start_matches('-').to_owned(),
                false => rounded,
            }
        },
    )
}
