//! The figures as rows of text: ways to make bodies below each other; and Menard's table of the same.

use super::{AS_FUSED, BodiesRoom, BodiesRow};

/// A figure, and how it is shown.
pub struct Figure {
    /// Short.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it is, for a person who has not read a paper about it.
    pub about: &'static str,
    /// Digits after the point.
    pub digits: usize,
    /// It.
    pub value: fn(&BodiesRow) -> Option<f64>,
}

/// The columns of a room's table.
pub const FIGURES: [Figure; 11] = [
    Figure {
        name: "MPJPE",
        unit: "mm",
        about: "mean distance of a joint from where it truly is; joints that were not fused are not counted",
        digits: 1,
        value: |row| row.metrics.error.mean_mm,
    },
    Figure {
        name: "error",
        unit: "mm",
        about: "the same without the bias of the body that no sensor can see",
        digits: 1,
        value: |row| row.metrics.own_error.mean_mm,
    },
    Figure {
        name: "bones",
        unit: "mm",
        about: "how much the length of a bone varies, one standard deviation",
        digits: 2,
        value: |row| row.metrics.bone_sigma_mm,
    },
    Figure {
        name: "elbow",
        unit: "deg",
        about: "how much the bend of elbows is off, root mean square",
        digits: 1,
        value: |row| row.body.elbow_deg,
    },
    Figure {
        name: "knee",
        unit: "deg",
        about: "the same of knees",
        digits: 1,
        value: |row| row.body.knee_deg,
    },
    Figure {
        name: "shoulder",
        unit: "deg",
        about: "between where upper arms point in the trunk's axes and where they truly do, root mean square",
        digits: 1,
        value: |row| row.body.shoulder_deg,
    },
    Figure {
        name: "hip",
        unit: "deg",
        about: "the same of upper legs",
        digits: 1,
        value: |row| row.body.hip_deg,
    },
    Figure {
        name: "flips",
        unit: "/min",
        about: "the axis about which an elbow or knee bends turns by more than a right angle from one frame to the next, and truly does not",
        digits: 1,
        value: |row| row.body.flips_per_min,
    },
    Figure {
        name: "skate",
        unit: "mm/s",
        about: "how far ankles and feet that truly stand move over the floor, per second of standing",
        digits: 0,
        value: |row| row.body.skate_mm_per_s,
    },
    Figure {
        name: "jitter",
        unit: "m/s2",
        about: "acceleration of the error, root mean square",
        digits: 1,
        value: |row| row.metrics.jitter_mps2,
    },
    Figure {
        name: "cost",
        unit: "us",
        about: "time to solve one person in one frame, mean; by the clock, so other work counts",
        digits: 0,
        value: |row| row.body.us_per_person_frame,
    },
];

/// Menard's (2014) figures.
pub const MENARD: [Figure; 4] = [
    Figure {
        name: "absolute",
        unit: "cm",
        about: "Menard's mean absolute difference: of a wrist from where it truly is",
        digits: 2,
        value: |row| row.metrics.wrist_absolute_cm,
    },
    Figure {
        name: "shortest",
        unit: "cm",
        about: "Menard's shortest distance: of a wrist from the nearest place where it was within 0.2 s either way",
        digits: 2,
        value: |row| row.metrics.wrist_shortest_cm,
    },
    Figure {
        name: "spikes",
        unit: "/min",
        about: "Menard's spikes: a joint's error changes by more than 10 cm within four frames",
        digits: 1,
        value: |row| row.metrics.spikes_per_min,
    },
    Figure {
        name: "deviations",
        unit: "/min",
        about: "Menard's deviations: a joint stays more than 20 cm off for a third of a second or longer",
        digits: 1,
        value: |row| row.metrics.deviations_per_min,
    },
];

/// The rows of a room's table, headings and units first.
pub fn rows(room: &BodiesRoom) -> Vec<Vec<String>> {
    let heading = |text: fn(&Figure) -> &str, first: &str| {
        let cells = FIGURES.iter().map(|figure| text(figure).to_owned());
        std::iter::once(first.to_owned()).chain(cells).collect()
    };
    let mut rows: Vec<Vec<String>> = vec![heading(|f| f.name, "body"), heading(|f| f.unit, "")];
    for row in &room.rows {
        let cells = FIGURES.iter().map(|figure| shown(figure, row));
        rows.push(std::iter::once(row.name.clone()).chain(cells).collect());
    }
    rows
}

/// Menard's table: his four figures, and by how many percent each way to make bodies changes them.
pub fn menard_rows(room: &BodiesRoom) -> Vec<Vec<String>> {
    let mut rows = vec![vec!["body".to_owned()], vec![String::new()]];
    for figure in &MENARD {
        rows[0].extend([figure.name.to_owned(), String::new()]);
        rows[1].extend([figure.unit.to_owned(), "change, %".to_owned()]);
    }
    let fused = room.row(AS_FUSED);
    for row in &room.rows {
        let mut cells = vec![row.name.clone()];
        for figure in &MENARD {
            let (now, before) = ((figure.value)(row), fused.and_then(figure.value));
            let change = now
                .zip(before)
                .map(|(now, before)| 100.0 * (now / before - 1.0))
                .filter(|change| change.is_finite() && row.name != AS_FUSED);
            cells.push(shown(figure, row));
            cells.push(change.map_or_else(|| "-".to_owned(), |change| format!("{change:+.0}")));
        }
        rows.push(cells);
    }
    rows
}

fn shown(figure: &Figure, row: &BodiesRow) -> String {
    let value = (figure.value)(row);
    value.map_or_else(
        || "-".to_owned(),
        |value| format!("{value:.*}", figure.digits),
    )
}
