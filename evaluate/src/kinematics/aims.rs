//! What bodies are to reach, beside the people as fused.

use super::{AS_FUSED, BodiesRoom, BodiesRow, SHIPS};
use crate::aims::Aim;

/// A figure, its unit, and the most it may be.
struct Wanted {
    figure: &'static str,
    unit: &'static str,
    /// Of the same figure of the people as fused; else the figure itself.
    of_fused: bool,
    limit: f64,
    value: fn(&BodiesRow) -> Option<f64>,
}

const WANTED: [Wanted; 6] = [
    Wanted {
        figure: "MPJPE",
        unit: "mm",
        of_fused: true,
        limit: 1.05,
        value: |row| row.metrics.error.mean_mm,
    },
    Wanted {
        figure: "bones",
        unit: "mm",
        of_fused: false,
        limit: 1.0,
        value: |row| row.metrics.bone_sigma_mm,
    },
    Wanted {
        figure: "flips",
        unit: "/min",
        of_fused: false,
        limit: 0.0,
        value: |row| row.body.flips_per_min,
    },
    Wanted {
        figure: "skate",
        unit: "mm/s",
        of_fused: true,
        limit: 0.5,
        value: |row| row.body.skate_mm_per_s,
    },
    Wanted {
        figure: "jitter",
        unit: "m/s2",
        of_fused: true,
        limit: 1.0,
        value: |row| row.metrics.jitter_mps2,
    },
    Wanted {
        figure: "cost",
        unit: "us",
        of_fused: false,
        limit: 150.0,
        value: |row| row.body.us_per_person_frame,
    },
];

/// The aims of what ships, in rooms where it and the people as fused were tried.
pub(super) fn check(rooms: &[BodiesRoom]) -> Vec<Aim> {
    let mut aims = Vec::new();
    for room in rooms {
        let (Some(fused), Some(ships)) = (room.row(AS_FUSED), room.row(SHIPS)) else {
            continue;
        };
        aims.extend(WANTED.iter().map(|wanted| wanted.check(room, fused, ships)));
    }
    aims
}

impl Wanted {
    fn check(&self, room: &BodiesRoom, fused: &BodiesRow, ships: &BodiesRow) -> Aim {
        let measured = (self.value)(ships);
        let value = match self.of_fused {
            true => measured
                .zip((self.value)(fused))
                .map(|(ships, fused)| ships / fused),
            false => measured,
        };
        let value = value.filter(|value| value.is_finite());
        let of = if self.of_fused {
            " of as fused"
        } else {
            self.unit
        };
        Aim {
            room: room.name.clone(),
            figure: self.figure.to_owned(),
            measured,
            unit: self.unit,
            aim: format!("{} {}", self.limit, of.trim()),
            value,
            limit: self.limit,
            met: value.is_some_and(|value| value <= self.limit),
        }
    }
}
