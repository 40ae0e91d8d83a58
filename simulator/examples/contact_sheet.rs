//! Draws people in motion as an SVG: `cargo run -p posefuse-simulator --example contact_sheet > sheet.svg`.
//!
//! One row per kind of action, eight moments each, seen from the front left. Left limbs are red, right ones blue.

use std::collections::BTreeMap;

use posefuse_simulator::motion::{Action, Cast, Performance};
use posefuse_skeleton::{BONES, JointMap, Position, Room};

const CELL: f64 = 170.0;
const COLUMNS: usize = 10;

fn main() {
    let seed = std::env::args()
        .nth(1)
        .and_then(|seed| seed.parse().ok())
        .unwrap_or(6);
    let performance = Performance::procedural(Cast {
        seed,
        people: 2,
        area_m: 2.6,
        hugs: true,
    });
    let mut rows: BTreeMap<String, (f64, f64)> = BTreeMap::new();
    if let Some(script) = performance.script(0) {
        for timed in &script.actions {
            let longer = timed.action != Action::Walk || timed.duration > 2.5;
            if longer {
                rows.entry(format!("{:?}", timed.action))
                    .or_insert((timed.start, timed.duration));
            }
        }
    }
    let (width, height) = (CELL * COLUMNS as f64, CELL * rows.len() as f64);
    println!(r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}">"#);
    println!(r#"<rect width="{width}" height="{height}" fill="white"/>"#);
    for (row, (name, (start, duration))) in rows.iter().enumerate() {
        let top = CELL * row as f64;
        println!(
            r#"<text x="4" y="{}" font-size="13">{name} {start:.1}s</text>"#,
            top + 14.0
        );
        for column in 0..COLUMNS {
            let time = start + duration * (column as f64 + 0.5) / COLUMNS as f64;
            let people = if name.starts_with("Hug") { 2 } else { 1 };
            for person in 0..people {
                let centre = performance.pose(0, time);
                draw(
                    &performance.pose(person, time),
                    &centre,
                    CELL * column as f64,
                    top,
                );
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
