//! Where one more sensor is of most use.
//!
//! Places around the area are tried, at several distances and heights, looking at its middle or at the floor a few metres
//! ahead. What counts most is how much of the area two sensors then see whole people in; then one, and two from different
//! sides, since a person hides what is behind them; then two from nearly opposite sides, and three. A direction and a
//! height of its own count a little, a pattern of dots on another's costs a little. Sensors stand at least a metre apart
//! and do not look into each other.

use std::f64::consts::FRAC_PI_2;

use posefuse_skeleton::{Position, Room};

use crate::coverage::{CROSSED_RAD, angle, bearings, sees_whole, widest};
use crate::interference::overlap;
use crate::view::Cone;
use crate::{Area, Light, Model, View, look_at};

/// Sensors stand so far apart at least, metres.
const APART_M: f64 = 1.0;
/// How far outside of the area places are tried, metres.
const MARGINS_M: [f64; 4] = [0.0, 0.5, 1.0, 1.5];
/// How high, metres.
const HEIGHTS_M: [f64; 4] = [0.8, 1.3, 1.8, 2.3];
/// The height that is looked at, metres.
const HIPS_M: f64 = 0.9;
/// How far ahead the floor is looked at in an area too large to be seen across, metres.
const AHEAD_M: f64 = 2.5;
/// Between places along the area's edge, metres, and most of them.
const STEP_M: f64 = 0.5;
const MOST_PLACES: f64 = 64.0;
/// What is gained is worth telling from this share of the area on.
const WORTH: f64 = 0.005;

/// What a share of the area is worth that one, two and three sensors see.
const SHARES: [f64; 3] = [0.6, 1.0, 0.15];
/// What a share of the area is worth that two see from different sides, and from nearly opposite ones.
const SIDES: [f64; 2] = [0.4, 0.2];
/// Nearly opposite, radians.
const OPPOSITE_RAD: f64 = 2.0 * CROSSED_RAD;
/// What a new direction is worth, what dots on all of another's view cost, and what a height of its own is worth.
const DIRECTION: f64 = 0.06;
const DOTS: f64 = 0.15;
const HEIGHT: f64 = 0.015;

/// One more sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// The sensor, planned.
    pub view: View,
    /// The point that it looks at.
    pub looks_at: Position<Room>,
    /// Share of the area where at least one, two and three sensors see a whole person, without it.
    pub before: [f64; 3],
    /// And with it.
    pub after: [f64; 3],
    /// Share where two see them from different sides, without and with it.
    pub crossed: [f64; 2],
}

impl Suggestion {
    /// What to do, in words.
    pub fn words(&self) -> String {
        let at = self.view.room_from_sensor.origin().vector();
        let to = self.looks_at.vector();
        let percent = |share: f64| (share * 100.0).round();
        let shares = |index: usize| [self.before[index], self.after[index]].map(percent);
        let (who, [before, after]) = if shares(1)[1] > shares(1)[0] {
            ("two or more sensors see", shares(1))
        } else if shares(0)[1] > shares(0)[0] {
            ("a sensor sees", shares(0))
        } else {
            (
                "two sensors see from different sides",
                self.crossed.map(percent),
            )
        };
        format!(
            "Place the next sensor ({}) at x {:.1} m, y {:.1} m, {:.1} m high, looking at x {:.1} m, y {:.1} m, {:.1} m high. With it \
             {who} a whole person in {after} % of the area instead of {before} %.",
            self.view.model, at.x, at.y, at.z, to.x, to.y, to.z
        )
    }
}

/// What is seen, cell by cell.
struct Seen {
    /// From where those look that see a whole person there.
    bearings: Vec<Vec<f64>>,
}

/// Shares of the area: one, two and three see; two from different and from nearly opposite sides.
struct Shares {
    counts: [f64; 3],
    sides: [f64; 2],
}

impl Seen {
    /// With a further sensor, if there is one.
    fn shares(&self, cells: &[[f64; 2]], further: Option<&Cone>) -> Shares {
        let (mut counts, mut sides) = ([0_usize; 3], [0_usize; 2]);
        for (cell, bearings) in cells.iter().zip(&self.bearings) {
            let seen = further.filter(|cone| sees_whole(cone, *cell));
            let from = seen.map(|cone| cone.bearing_from(*cell));
            for enough in counts
                .iter_mut()
                .take(bearings.len() + usize::from(from.is_some()))
            {
                *enough += 1;
            }
            let new = from.map_or(0.0, |from| {
                bearings.iter().map(|b| angle(*b, from)).fold(0.0, f64::max)
            });
            let wide = new.max(widest(bearings));
            for (enough, least) in sides.iter_mut().zip([CROSSED_RAD, OPPOSITE_RAD]) {
                *enough += usize::from(wide >= least);
            }
        }
        let share = |count: usize| count as f64 / cells.len().max(1) as f64;
        Shares {
            counts: counts.map(share),
            sides: sides.map(share),
        }
    }
}

/// The best place for one more sensor of this model; `None`: none adds anything to speak of.
pub(crate) fn suggest(
    views: &[View],
    area: &Area,
    model: &Model,
    name: &str,
) -> Option<Suggestion> {
    let cells: Vec<[f64; 2]> = area.cells().collect();
    let cones: Vec<Cone> = views.iter().map(View::cone).collect();
    let seen = Seen {
        bearings: cells.iter().map(|cell| bearings(&cones, *cell)).collect(),
    };
    let before = seen.shares(&cells, None);
    let mut best: Option<(f64, Suggestion)> = None;
    for (from, target) in candidates(area) {
        let view = planned(model, name, from, target);
        let Some(view) = view.filter(|view| stands_free(view, views)) else {
            continue;
        };
        let after = seen.shares(&cells, Some(&view.cone()));
        let counts = [0, 1, 2].map(|index| after.counts[index] - before.counts[index]);
        let sides = [0, 1].map(|index| after.sides[index] - before.sides[index]);
        if counts[0].max(counts[1]).max(sides[0]) < WORTH {
            continue;
        }
        let worth = |gains: &[f64], weights: &[f64]| -> f64 {
            gains
                .iter()
                .zip(weights)
                .map(|(gain, weight)| gain * weight)
                .sum()
        };
        let score = worth(&counts, &SHARES) + worth(&sides, &SIDES) + taste(&view, views, area);
        if best.as_ref().is_none_or(|(most, _)| score > *most + 1e-9) {
            let found = Suggestion {
                view,
                looks_at: target,
                before: before.counts,
                after: after.counts,
                crossed: [before.sides[0], after.sides[0]],
            };
            best = Some((score, found));
        }
    }
    best.map(|(_, suggestion)| suggestion)
}

/// Places to try, and where each looks.
fn candidates(area: &Area) -> impl Iterator<Item = (Position<Room>, Position<Room>)> {
    let middle = area.middle();
    let area = *area;
    MARGINS_M.into_iter().flat_map(move |margin| {
        edge(&area, margin).into_iter().flat_map(move |[x, y]| {
            let [dx, dy] = [middle[0] - x, middle[1] - y];
            let distance = dx.hypot(dy).max(1e-6);
            let share = (AHEAD_M / distance).min(1.0);
            let ahead = [x + dx * share, y + dy * share];
            // In a small area both are the same.
            let targets = if share < 1.0 {
                vec![middle, ahead]
            } else {
                vec![middle]
            };
            HEIGHTS_M.into_iter().flat_map(move |height| {
                let from = Position::new(x, y, height);
                let looks = move |[x, y]: [f64; 2]| (from, Position::new(x, y, HIPS_M));
                targets.clone().into_iter().map(looks)
            })
        })
    })
}

/// Places along the area's edge, so far outside of it.
fn edge(area: &Area, margin: f64) -> Vec<[f64; 2]> {
    let min = area.min.map(|v| v - margin);
    let max = area.max.map(|v| v + margin);
    let sides = [max[0] - min[0], max[1] - min[1]];
    let around = 2.0 * (sides[0] + sides[1]);
    let step = STEP_M.max(around / MOST_PLACES);
    let places = |length: f64| (length / step).round().max(1.0) as usize;
    let mut found = Vec::new();
    for (from, to) in [
        (min, [max[0], min[1]]),
        ([max[0], min[1]], max),
        (max, [min[0], max[1]]),
        ([min[0], max[1]], min),
    ] {
        let count = places((to[0] - from[0]).hypot(to[1] - from[1]));
        found.extend((0..count).map(|index| {
            let share = index as f64 / count as f64;
            [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
        }));
    }
    found
}

/// Whether nobody stands there already and nobody looks into it.
fn stands_free(view: &View, views: &[View]) -> bool {
    let here = view.room_from_sensor.origin();
    views.iter().all(|other| {
        let there = other.room_from_sensor.origin();
        here.distance(there) >= APART_M && !(view.stares_at(there) && other.stares_at(here))
    })
}

fn planned(
    model: &Model,
    name: &str,
    from: Position<Room>,
    target: Position<Room>,
) -> Option<View> {
    Some(View {
        name: name.to_owned(),
        model: model.name.to_owned(),
        planned: true,
        room_from_sensor: look_at(from, target)?,
        view_deg: model.view_deg,
        range_m: model.range_m,
        light: model.light,
        assumed: false,
    })
}

/// What speaks for a place beside the area that is seen.
fn taste(view: &View, others: &[View], area: &Area) -> f64 {
    let [mx, my] = area.middle();
    let bearing = |view: &View| {
        let at = view.room_from_sensor.origin().vector();
        (at.y - my).atan2(at.x - mx)
    };
    let height = |view: &View| view.room_from_sensor.origin().vector().z;
    let nearest =
        |distance: &dyn Fn(&View) -> f64| others.iter().map(distance).fold(f64::INFINITY, f64::min);
    let turned = nearest(&|other| angle(bearing(view), bearing(other)));
    let apart = nearest(&|other| (height(view) - height(other)).abs());
    let dots = |other: &View| match (view.light, other.light) {
        (Light::Structured, Light::Structured) => overlap(view, other),
        _ => 0.0,
    };
    let worst = others.iter().map(dots).fold(0.0, f64::max);
    DIRECTION * (turned / FRAC_PI_2).min(1.0) + HEIGHT * (apart / 0.5).min(1.0) - DOTS * worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Coverage, MODELS};

    fn greedy(model: &Model, area: &Area, count: usize) -> Vec<View> {
        let mut views = Vec::new();
        for number in 0..count {
            let found = suggest(&views, area, model, &format!("plan-{number}")).unwrap();
            views.push(found.view);
        }
        views
    }

    #[test]
    fn each_sensor_more_gains_and_what_is_promised_is_what_one_gets() {
        let area = Area::about(1.0, -0.5).unwrap();
        let mut views: Vec<View> = Vec::new();
        for number in 0..4 {
            let found = suggest(&views, &area, &MODELS[0], &format!("plan-{number}")).unwrap();
            let before = Coverage::of(&views, &area).whole;
            assert_eq!(found.before, [1, 2, 3].map(|n| before.share(n)));
            views.push(found.view.clone());
            let after = Coverage::of(&views, &area).whole;
            assert_eq!(found.after, [1, 2, 3].map(|n| after.share(n)));
            let crossed = Coverage::of(&views, &area).crossed_share;
            assert_eq!(found.crossed[1], crossed);
            assert!(found.after[0] + found.after[1] > found.before[0] + found.before[1]);
        }
        let covered = Coverage::of(&views, &area).whole;
        assert!(covered.share(2) > 0.8, "{}", covered.share(2));
        let crossed = Coverage::of(&views, &area).crossed_share;
        assert!(crossed > 0.7, "{crossed}");
    }

    #[test]
    fn sensors_stand_apart_and_do_not_look_into_each_other() {
        for model in [&MODELS[0], &MODELS[1]] {
            let views = greedy(model, &Area::about(0.0, 0.0).unwrap(), 4);
            for (index, a) in views.iter().enumerate() {
                for b in &views[index + 1..] {
                    let (at, to) = (a.room_from_sensor.origin(), b.room_from_sensor.origin());
                    assert!(at.distance(to) >= APART_M - 1e-9);
                    let facing = a.stares_at(to) && b.stares_at(at);
                    assert!(!facing, "{} faces {}", a.name, b.name);
                }
            }
        }
    }

    #[test]
    fn where_everything_is_seen_nothing_is_suggested() {
        let area = Area::new([-0.5, -0.5], [0.5, 0.5]).unwrap();
        let views = greedy(&MODELS[0], &area, 2);
        assert_eq!(Coverage::of(&views, &area).whole.share(2), 1.0);
        assert_eq!(suggest(&views, &area, &MODELS[0], "more"), None);
    }

    #[test]
    fn the_words_name_the_place_and_the_gain() {
        let area = Area::about(0.0, 0.0).unwrap();
        let mut views = greedy(&MODELS[0], &area, 1);
        let first = suggest(&[], &area, &MODELS[0], "a").unwrap().words();
        assert!(
            first.contains("With it a sensor sees a whole person in"),
            "{first}"
        );
        assert!(first.ends_with("% of the area instead of 0 %."), "{first}");
        views.truncate(1);
        let second = suggest(&views, &area, &MODELS[0], "b").unwrap().words();
        assert!(
            second.starts_with("Place the next sensor (Kinect v2) at x "),
            "{second}"
        );
        assert!(
            second.contains("two or more sensors see a whole person in"),
            "{second}"
        );
    }
}
