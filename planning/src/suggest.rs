//! Where one more sensor is of most use.
//!
//! Places around the area are tried, at several distances and heights, looking at its middle or at the floor a few metres
//! ahead. What counts most is how much of the area two sensors then see whole people in, then one, then three. A
//! direction that no other sensor looks in counts a little, since a person hides what is behind them; a pattern of dots
//! on another's costs a little. Sensors stand at least a metre apart and do not look into each other.

use std::f64::consts::FRAC_PI_2;

use posefuse_skeleton::{Position, Room};

use crate::coverage::sees_whole;
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
/// Sensors whose axes point at each other within this angle look into each other, cosine of 30 degrees.
const FACING: f64 = 0.866;
/// What is gained is worth telling from this share of the area on.
const WORTH: f64 = 0.005;

/// What a share of the area is worth that one, two and three sensors see.
const SHARES: [f64; 3] = [0.6, 1.0, 0.15];
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
}

impl Suggestion {
    /// What to do, in words.
    pub fn words(&self) -> String {
        let at = self.view.room_from_sensor.origin().vector();
        let to = self.looks_at.vector();
        let percent = |share: f64| (share * 100.0).round();
        let gain = |what: &str, index: usize| {
            format!(
                "{what} {} % to {} % of the area",
                percent(self.before[index]),
                percent(self.after[index])
            )
        };
        let gains = if percent(self.after[1]) > percent(self.before[1]) {
            gain("two or more sensors then see whole people in", 1).replace("in ", "in, from ")
        } else {
            gain("a sensor then sees whole people in", 0).replace("in ", "in, from ")
        };
        format!(
            "Place a {} at x {:.1} m, y {:.1} m, {:.1} m high, looking at x {:.1} m, y {:.1} m, {:.1} m high: {gains}.",
            self.view.model, at.x, at.y, at.z, to.x, to.y, to.z
        )
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
    let seen: Vec<u8> = cells
        .iter()
        .map(|cell| cones.iter().filter(|cone| sees_whole(cone, *cell)).count() as u8)
        .collect();
    let before = shares(&seen, |_| false);
    let mut best: Option<(f64, Suggestion)> = None;
    for (from, target) in candidates(area) {
        if !stands_free(from, target, views) {
            continue;
        }
        let Some(view) = planned(model, name, from, target) else {
            continue;
        };
        let cone = view.cone();
        let after = shares(&seen, |index| sees_whole(&cone, cells[index]));
        let gained = |index: usize| after[index] - before[index];
        if gained(0).max(gained(1)) < WORTH {
            continue;
        }
        let gain: f64 = (0..3).map(|index| SHARES[index] * gained(index)).sum();
        let score = gain + taste(&view, views, area);
        if best.as_ref().is_none_or(|(most, _)| score > *most + 1e-9) {
            let looks_at = target;
            best = Some((
                score,
                Suggestion {
                    view,
                    looks_at,
                    before,
                    after,
                },
            ));
        }
    }
    best.map(|(_, suggestion)| suggestion)
}

/// Share of the cells that one, two and three sensors see, where `too` says whether a further one sees a cell.
fn shares(seen: &[u8], too: impl Fn(usize) -> bool) -> [f64; 3] {
    let mut counts = [0_usize; 3];
    for (index, count) in seen.iter().enumerate() {
        let count = usize::from(*count) + usize::from(too(index));
        for enough in counts.iter_mut().take(count) {
            *enough += 1;
        }
    }
    counts.map(|count| count as f64 / seen.len().max(1) as f64)
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
fn stands_free(from: Position<Room>, target: Position<Room>, views: &[View]) -> bool {
    let Some(forward) = (target.vector() - from.vector()).try_normalize(1e-6) else {
        return false;
    };
    views.iter().all(|other| {
        let there = other.room_from_sensor.origin();
        let between = there.vector() - from.vector();
        let distance = between.norm();
        let facing = forward.dot(&between) > FACING * distance
            && -other.forward().dot(&between) > FACING * distance;
        distance >= APART_M && !facing
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
    let turned = nearest(&|other| {
        let angle = (bearing(view) - bearing(other)).abs() % std::f64::consts::TAU;
        angle.min(std::f64::consts::TAU - angle)
    });
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
            assert!(found.after[0] + found.after[1] > found.before[0] + found.before[1]);
        }
        let covered = Coverage::of(&views, &area).whole;
        assert!(covered.share(2) > 0.8, "{}", covered.share(2));
    }

    #[test]
    fn sensors_stand_apart_and_do_not_look_into_each_other() {
        for model in [&MODELS[0], &MODELS[1]] {
            let views = greedy(model, &Area::about(0.0, 0.0).unwrap(), 4);
            for (index, a) in views.iter().enumerate() {
                for b in &views[index + 1..] {
                    let (at, to) = (a.room_from_sensor.origin(), b.room_from_sensor.origin());
                    assert!(at.distance(to) >= APART_M - 1e-9);
                    let line = (to.vector() - at.vector()).normalize();
                    let facing =
                        a.forward().dot(&line) > FACING && -b.forward().dot(&line) > FACING;
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
            first.contains("a sensor then sees whole people in, from 0 % to"),
            "{first}"
        );
        views.truncate(1);
        let second = suggest(&views, &area, &MODELS[0], "b").unwrap().words();
        assert!(second.starts_with("Place a Kinect v2 at x "), "{second}");
        assert!(
            second.contains("two or more sensors then see whole people in, from 0 % to"),
            "{second}"
        );
    }
}
