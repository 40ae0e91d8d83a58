//! The figures that fusion is to reach in simulated rooms, and whether it does.
//!
//! `A` is Menard's mean with left and right put right ([`crate::REFERENCE`]), `B` the noise bound of the room
//! ([`crate::SimulatedTruth::noise_bound_m`]). Errors are without the bias of the body.

use serde::Serialize;

use crate::methods::REFERENCE;
use crate::metrics::Metrics;
use crate::report::Group;

/// One figure that is to be reached in one room.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Aim {
    /// The room.
    pub room: String,
    /// Which figure of which method.
    pub figure: String,
    /// What was measured.
    pub measured: Option<f64>,
    /// Its unit.
    pub unit: &'static str,
    /// The most it may be, in words.
    pub aim: String,
    /// What is compared with the aim: a ratio, or the figure itself.
    pub value: Option<f64>,
    /// The most (or for left and right the least) it may be.
    pub limit: f64,
    /// Whether it is reached. What was not measured is not reached.
    pub met: bool,
}

/// Aims as a table: the same figures in several rooms.
pub struct Matrix<'a> {
    /// The columns.
    pub rooms: Vec<&'a str>,
    /// The rows: a figure, and the most it may be.
    pub rows: Vec<(&'a str, &'a str)>,
}

/// The rooms and the figures of `aims`, each once, in order.
pub fn matrix(aims: &[Aim]) -> Matrix<'_> {
    let mut matrix = Matrix {
        rooms: Vec::new(),
        rows: Vec::new(),
    };
    for aim in aims {
        let (room, row) = (aim.room.as_str(), (aim.figure.as_str(), aim.aim.as_str()));
        if !matrix.rooms.contains(&room) {
            matrix.rooms.push(room);
        }
        if !matrix.rows.contains(&row) {
            matrix.rows.push(row);
        }
    }
    matrix
}

/// The aim in a room and a row of a [`Matrix`].
pub fn in_matrix<'a>(aims: &'a [Aim], room: &str, row: (&str, &str)) -> Option<&'a Aim> {
    let own = |aim: &&Aim| aim.room == room && (aim.figure.as_str(), aim.aim.as_str()) == row;
    aims.iter().find(own)
}

/// What a figure is compared with.
#[derive(Clone, Copy)]
enum Against {
    /// The same figure of A: at most this share of it.
    A(f64),
    /// The noise bound: at most this multiple of it.
    B(f64),
    /// Nothing: at least this.
    AtLeast(f64),
}

struct Wanted {
    method: &'static str,
    figure: &'static str,
    unit: &'static str,
    value: fn(&Metrics) -> Option<f64>,
    against: &'static [Against],
}

const WANTED: [Wanted; 8] = [
    Wanted {
        method: "kalman-0",
        figure: "error, at once",
        unit: "mm",
        value: |m| m.own_error.mean_mm,
        against: &[Against::A(0.55)],
    },
    Wanted {
        method: "kalman-1",
        figure: "error, one frame",
        unit: "mm",
        value: |m| m.own_error.mean_mm,
        against: &[Against::A(0.45), Against::B(1.6)],
    },
    Wanted {
        method: "offline",
        figure: "error, offline",
        unit: "mm",
        value: |m| m.own_error.mean_mm,
        against: &[Against::A(0.40)],
    },
    Wanted {
        method: "kalman-1",
        figure: "hidden joints, one frame",
        unit: "mm",
        value: |m| m.own_error_occluded.mean_mm,
        against: &[Against::A(0.45)],
    },
    Wanted {
        method: "kalman-1",
        figure: "jitter, one frame",
        unit: "m/s2",
        value: |m| m.jitter_mps2,
        against: &[Against::A(0.25)],
    },
    Wanted {
        method: "offline",
        figure: "jitter, offline",
        unit: "m/s2",
        value: |m| m.jitter_mps2,
        against: &[Against::A(0.12)],
    },
    Wanted {
        method: "kalman-1",
        figure: "spikes, one frame",
        unit: "/min",
        value: |m| m.spikes_per_min,
        against: &[Against::A(0.1)],
    },
    Wanted {
        method: "kalman-1",
        figure: "swaps found out",
        unit: "%",
        value: |m| m.swaps_right.map(|share| share * 100.0),
        against: &[Against::AtLeast(99.5)],
    },
];

/// The methods that the aims are about.
pub const METHODS: [&str; 4] = [REFERENCE, "kalman-0", "kalman-1", "offline"];

/// The aims in these rooms.
pub fn check(rooms: &[Group]) -> Vec<Aim> {
    let mut aims = Vec::new();
    for room in rooms {
        for wanted in &WANTED {
            let all = wanted.against.iter();
            aims.extend(all.map(|against| aim(room, wanted, *against)));
        }
    }
    aims
}

/// What repair is to do in these rooms, for each run with it.
pub fn check_repair(rooms: &[Group]) -> Vec<Aim> {
    let mut aims = Vec::new();
    for room in rooms {
        for run in &room.runs {
            let Some(effect) = &run.all.repair else {
                continue;
            };
            let ratio = effect.with_mm.zip(effect.without_mm);
            let ratio = ratio.map(|(with, without)| with / without);
            let aim = |what: &str, measured, value: Option<f64>, limit: f64, aim: &str| Aim {
                room: room.name.clone(),
                figure: format!("{}: {what}", run.method),
                measured,
                unit: "mm",
                aim: aim.to_owned(),
                value: value.filter(|value| value.is_finite()),
                limit,
                met: value.is_some_and(|value| value <= limit),
            };
            aims.extend([
                aim(
                    "hidden joints",
                    effect.with_mm,
                    ratio,
                    0.7,
                    "0.7 without it",
                ),
                aim(
                    "seen joints moved by",
                    effect.most_changed_mm,
                    effect.most_changed_mm,
                    0.1,
                    "0.1 mm",
                ),
            ]);
        }
    }
    aims
}

fn aim(room: &Group, wanted: &Wanted, against: Against) -> Aim {
    let figures = |method: &str| room.of(method).map(|run| &run.all);
    let measured = figures(wanted.method).and_then(wanted.value);
    let (reference, limit, aim) = match against {
        Against::A(limit) => {
            let a = figures(REFERENCE).and_then(wanted.value);
            (a, limit, format!("{limit} A"))
        }
        Against::B(limit) => {
            let b = figures(wanted.method).and_then(|m| m.noise_bound_mm);
            (b, limit, format!("{limit} B"))
        }
        Against::AtLeast(limit) => (Some(1.0), limit, format!("{limit} %")),
    };
    let value = measured
        .zip(reference)
        .map(|(measured, reference)| measured / reference)
        .filter(|value| value.is_finite());
    let met = value.is_some_and(|value| match against {
        Against::A(_) | Against::B(_) => value <= limit,
        Against::AtLeast(_) => value >= limit,
    });
    Aim {
        room: room.name.clone(),
        figure: wanted.figure.to_owned(),
        measured,
        unit: wanted.unit,
        aim,
        value,
        limit,
        met,
    }
}
