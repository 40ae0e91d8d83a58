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

/// What a figure is compared with.
#[derive(Clone, Copy)]
enum Against {
    /// The same figure of A.
    A,
    /// The noise bound.
    B,
    /// Nothing: at least this.
    AtLeast,
}

struct Wanted {
    method: &'static str,
    figure: &'static str,
    unit: &'static str,
    value: fn(&Metrics) -> Option<f64>,
    against: Against,
    limit: f64,
}

const fn wanted(
    method: &'static str,
    figure: &'static str,
    unit: &'static str,
    value: fn(&Metrics) -> Option<f64>,
    against: Against,
    limit: f64,
) -> Wanted {
    Wanted {
        method,
        figure,
        unit,
        value,
        against,
        limit,
    }
}

fn error(m: &Metrics) -> Option<f64> {
    m.own_error.mean_mm
}

fn hidden(m: &Metrics) -> Option<f64> {
    m.own_error_occluded.mean_mm
}

fn jitter(m: &Metrics) -> Option<f64> {
    m.jitter_mps2
}

const WANTED: [Wanted; 9] = [
    wanted("kalman-0", "error, at once", "mm", error, Against::A, 0.55),
    wanted(
        "kalman-1",
        "error, one frame",
        "mm",
        error,
        Against::A,
        0.45,
    ),
    wanted("kalman-1", "error, one frame", "mm", error, Against::B, 1.6),
    wanted("offline", "error, offline", "mm", error, Against::A, 0.40),
    wanted(
        "kalman-1",
        "hidden joints, one frame",
        "mm",
        hidden,
        Against::A,
        0.45,
    ),
    wanted(
        "kalman-1",
        "jitter, one frame",
        "m/s2",
        jitter,
        Against::A,
        0.25,
    ),
    wanted(
        "offline",
        "jitter, offline",
        "m/s2",
        jitter,
        Against::A,
        0.12,
    ),
    wanted(
        "kalman-1",
        "spikes, one frame",
        "/min",
        |m| m.spikes_per_min,
        Against::A,
        0.1,
    ),
    wanted(
        "kalman-1",
        "swaps found out",
        "%",
        |m| m.swaps_right.map(|share| share * 100.0),
        Against::AtLeast,
        99.5,
    ),
];

/// The methods that the aims are about.
pub const METHODS: [&str; 4] = [REFERENCE, "kalman-0", "kalman-1", "offline"];

/// The aims in these rooms.
pub fn check(rooms: &[Group]) -> Vec<Aim> {
    let room = |room: &Group| {
        let aims = WANTED.iter().map(|wanted| aim(room, wanted));
        aims.collect::<Vec<_>>()
    };
    rooms.iter().flat_map(room).collect()
}

fn aim(room: &Group, wanted: &Wanted) -> Aim {
    let figures = |method: &str| room.of(method).map(|run| &run.all);
    let measured = figures(wanted.method).and_then(wanted.value);
    let reference = match wanted.against {
        Against::A => figures(REFERENCE).and_then(wanted.value),
        Against::B => figures(wanted.method).and_then(|m| m.noise_bound_mm),
        Against::AtLeast => Some(1.0),
    };
    let value = measured
        .zip(reference)
        .map(|(measured, reference)| measured / reference)
        .filter(|value| value.is_finite());
    let limit = wanted.limit;
    let (aim, met) = match wanted.against {
        Against::A => (format!("{limit} A"), value.is_some_and(|v| v <= limit)),
        Against::B => (format!("{limit} B"), value.is_some_and(|v| v <= limit)),
        Against::AtLeast => (format!("{limit} %"), value.is_some_and(|v| v >= limit)),
    };
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
