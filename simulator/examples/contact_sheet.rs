//! Draws people in motion as an SVG: `cargo run -p posefuse-simulator --example contact_sheet > sheet.svg`.
//!
//! One row per kind of action, ten moments each, seen from the front left. Left limbs are red, right ones blue.
//! With a number as argument: another seed. With paths of motion files: one row per file, its first four seconds.

use std::collections::BTreeMap;
use std::path::Path;

use posefuse_simulator::load::{LoadError, load};
use posefuse_simulator::motion::{Action, Cast, Performance, Situation};
use posefuse_skeleton::{BONES, JointMap, Position, Room};

const CELL: f64 = 170.0;
const COLUMNS: usize = 10;

fn main() -> Result<(), LoadError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let files: Vec<&String> = arguments
        .iter()
        .filter(|a| a.parse::<u64>().is_err())
        .collect();
    if files.is_empty() {
        let seed = arguments
            .first()
            .and_then(|seed| seed.parse().ok())
            .unwrap_or(6);
        actions(seed);
    } else {
        let rows: Result<Vec<_>, LoadError> =
            files.iter().map(|file| row(Path::new(file))).collect();
        sheet(&rows?);
    }
    Ok(())
}

/// A name and, for each moment, the people to draw.
type Row = (String, Vec<Vec<JointMap<Position<Room>>>>);

fn actions(seed: u64) {
    let performance = Performance::procedural(Cast {
        seed,
        people: 2,
        area_m: 2.6,
        hugs: true,
        situation: Situation::Everyday,
        away_s: 0.0,
    });
    let mut rows: BTreeMap<String, Row> = BTreeMap::new();
    for timed in performance
        .script(0)
        .map(|script| script.actions.as_slice())
        .unwrap_or_default()
    {
        let name = format!("{:?}", timed.action);
        let people = if name.starts_with("Hug") { 2 } else { 1 };
        let moments = (0..COLUMNS).map(|column| {
            let time = timed.start + timed.duration * (column as f64 + 0.5) / COLUMNS as f64;
            (0..people)
                .map(|person| performance.pose(person, time))
                .collect()
        });
        if timed.action != Action::Walk || timed.duration > 2.5 {
            rows.entry(name.clone())
                .or_insert_with(|| (name, moments.collect()));
        }
    }
    sheet(&rows.into_values().collect::<Vec<_>>());
}

fn row(path: &Path) -> Result<Row, LoadError> {
    let clip = load(path)?;
    let step = clip.duration_s().min(4.0) / COLUMNS as f64;
    let moments = (0..COLUMNS)
        .map(|column| vec![clip.pose(column as f64 * step)])
        .collect();
    Ok((clip.name().to_owned(), moments))
}

fn sheet(rows: &[Row]) {
    let (width, height) = (CELL * COLUMNS as f64, CELL * rows.len() as f64);
    println!(r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}">"#);
    println!(r#"<rect width="{width}" height="{height}" fill="white"/>"#);
    for (row, (name, moments)) in rows.iter().enumerate() {
        let top = CELL * row as f64;
        println!(
            r#"<text x="4" y="{}" font-size="13">{name}</text>"#,
            top + 14.0
        );
        for (column, people) in moments.iter().enumerate() {
            for person in people {
                draw(person, &people[0], CELL * column as f64, top);
            }
        }
    }
    println!("</svg>");
}

fn draw(pose: &JointMap<Position<Room>>, centre: &JointMap<Position<Room>>, left: f64, top: f64) {
    let Some((_, middle)) = centre.iter().next() else {
        return;
    };
    let (sin, cos) = 50f64.to_radians().sin_cos();
    let flat = |position: Position<Room>| {
        let p = position.vector() - middle.vector();
        let across = p.x * sin - p.y * cos;
        let depth = p.x * cos + p.y * sin;
        let z = position.vector().z;
        (
            left + CELL * 0.5 + 75.0 * across,
            top + CELL - 8.0 - 75.0 * z - 15.0 * depth.clamp(-0.7, 0.7),
        )
    };
    for bone in BONES {
        let (Some(a), Some(b)) = (pose[bone.parent], pose[bone.child]) else {
            continue;
        };
        let ((x1, y1), (x2, y2)) = (flat(a), flat(b));
        let colour = match bone.child.name() {
            name if name.contains("Left") => "crimson",
            name if name.contains("Right") => "royalblue",
            _ => "black",
        };
        println!(
            r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" stroke="{colour}" stroke-width="2"/>"#
        );
    }
}
