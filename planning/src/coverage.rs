//! How many sensors see each place.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use posefuse_skeleton::Position;

use crate::view::Cone;
use crate::{Area, View};

/// Heights at which places are looked at, metres above the floor: shins, hips, head.
pub const HEIGHTS_M: [f64; 3] = [0.2, 1.0, 1.8];
/// The ends of a standing person: ankle and crown.
const PERSON_M: [f64; 2] = [0.1, 1.8];

/// How many sensors see each cell of an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Metres above the floor; of whole persons, that of their head.
    pub height_m: f64,
    /// One count a cell, along x first.
    pub counts: Vec<u8>,
}

impl Layer {
    /// Share of the cells that at least so many sensors see.
    pub fn share(&self, sensors: u8) -> f64 {
        let enough = self.counts.iter().filter(|count| **count >= sensors);
        enough.count() as f64 / self.counts.len().max(1) as f64
    }
}

/// What the sensors of a room see of an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// At [`HEIGHTS_M`].
    pub layers: [Layer; 3],
    /// How many sensors see a person who stands there from head to foot.
    pub whole: Layer,
    /// Share of the cells where two of these look from different sides: directions at least 60 degrees apart.
    pub crossed_share: f64,
}

/// Directions so far apart show different sides of a person, radians.
pub(crate) const CROSSED_RAD: f64 = FRAC_PI_3;

impl Coverage {
    /// Looks from all `views` at all cells.
    pub fn of(views: &[View], area: &Area) -> Self {
        let cones: Vec<Cone> = views.iter().map(View::cone).collect();
        let count = |height_m: f64, sees: &dyn Fn(&Cone, [f64; 2]) -> bool| Layer {
            height_m,
            counts: area
                .cells()
                .map(|cell| cones.iter().filter(|cone| sees(cone, cell)).count() as u8)
                .collect(),
        };
        Self {
            layers: HEIGHTS_M.map(|height| {
                count(height, &|cone, [x, y]| {
                    cone.sees(Position::new(x, y, height))
                })
            }),
            whole: count(PERSON_M[1], &sees_whole),
            crossed_share: crossed_share(&cones, area),
        }
    }
}

fn crossed_share(cones: &[Cone], area: &Area) -> f64 {
    let crossed = area
        .cells()
        .filter(|cell| widest(&bearings(cones, *cell)) >= CROSSED_RAD);
    crossed.count() as f64 / (area.columns * area.rows) as f64
}

/// From where those look that see a whole person at a place: the angle of the way to each, radians.
pub(crate) fn bearings(cones: &[Cone], cell: [f64; 2]) -> Vec<f64> {
    let seeing = cones.iter().filter(|cone| sees_whole(cone, cell));
    seeing.map(|cone| cone.bearing_from(cell)).collect()
}

/// The largest angle between two of them, radians; 0 for fewer than two.
pub(crate) fn widest(bearings: &[f64]) -> f64 {
    let pairs = bearings
        .iter()
        .enumerate()
        .flat_map(|(index, a)| bearings[index + 1..].iter().map(move |b| angle(*a, *b)));
    pairs.fold(0.0, f64::max)
}

/// The angle between two bearings, 0 to pi.
pub(crate) fn angle(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(TAU);
    if turn > PI { TAU - turn } else { turn }
}

/// Whether a person who stands there is in view from head to foot.
pub(crate) fn sees_whole(cone: &Cone, [x, y]: [f64; 2]) -> bool {
    PERSON_M
        .iter()
        .all(|height| cone.sees(Position::new(x, y, *height)))
}

#[cfg(test)]
pub(crate) mod tests {
    use posefuse_skeleton::Room;

    use super::*;
    use crate::{MODELS, Model, look_at};

    pub(crate) fn view(name: &str, from: [f64; 3], target: [f64; 3]) -> View {
        view_of(&MODELS[0], name, from, target)
    }

    pub(crate) fn view_of(model: &Model, name: &str, from: [f64; 3], target: [f64; 3]) -> View {
        let [from, target] = [from, target].map(|[x, y, z]| Position::<Room>::new(x, y, z));
        View {
            name: name.to_owned(),
            model: model.name.to_owned(),
            planned: false,
            room_from_sensor: look_at(from, target).unwrap(),
            view_deg: model.view_deg,
            range_m: model.range_m,
            light: model.light,
            assumed: false,
        }
    }

    #[test]
    fn a_person_is_seen_whole_only_where_head_and_feet_are() {
        let area = Area::new([0.0, -0.25], [5.0, 0.25]).unwrap();
        let level = view("a", [0.0, 0.0, 1.0], [3.0, 0.0, 1.0]);
        let coverage = Coverage::of(&[level], &area);
        // 60 degrees up and down from 1 m: 0.9 m down to the ankle at 1.56 m, the far end at 4.5 m.
        let seen: Vec<f64> = area
            .cells()
            .zip(&coverage.whole.counts)
            .filter(|(_, count)| **count > 0)
            .map(|([x, _], _)| x)
            .collect();
        assert_eq!(seen.first(), Some(&1.625));
        assert_eq!(seen.last(), Some(&4.375));
        assert!(coverage.layers[1].share(1) > coverage.whole.share(1));
        assert_eq!(coverage.whole.share(2), 0.0);
    }

    #[test]
    fn two_sensors_side_by_side_show_one_side_only() {
        let area = Area::about(0.0, 0.0).unwrap();
        let target = [0.0, 0.0, 0.9];
        let south = view("a", [0.0, -2.5, 1.2], target);
        let beside = view("b", [1.0, -2.5, 1.2], target);
        let east = view("c", [2.5, 0.0, 1.2], target);
        // Of the floor that both see, how much they see from different sides.
        let crossed = |other: &View| {
            let coverage = Coverage::of(&[south.clone(), other.clone()], &area);
            coverage.crossed_share / coverage.whole.share(2)
        };
        let (side_by_side, across) = (crossed(&beside), crossed(&east));
        assert!(
            side_by_side < 0.05 && across > 0.6,
            "{side_by_side} {across}"
        );
        assert_eq!(Coverage::of(&[south], &area).crossed_share, 0.0);
        assert!((angle(3.0, -3.0) - (TAU - 6.0)).abs() < 1e-12);
    }

    #[test]
    fn shares_add_up_whatever_the_order_of_the_sensors() {
        let area = Area::about(0.0, 0.0).unwrap();
        let views = [
            view("a", [-3.0, 0.0, 1.2], [0.0, 0.0, 0.9]),
            view("b", [0.0, -3.0, 1.8], [0.0, 0.0, 0.9]),
            view("c", [2.0, 2.0, 1.2], [0.0, 0.0, 0.9]),
        ];
        let coverage = Coverage::of(&views, &area);
        let mut turned = views.clone();
        turned.reverse();
        assert_eq!(Coverage::of(&turned, &area), coverage);
        let alone: usize = views
            .iter()
            .map(|view| {
                let one = Coverage::of(std::slice::from_ref(view), &area);
                one.whole.counts.iter().filter(|c| **c > 0).count()
            })
            .sum();
        let together: usize = coverage.whole.counts.iter().map(|c| usize::from(*c)).sum();
        assert_eq!(together, alone);
        assert!(coverage.whole.share(1) >= coverage.whole.share(2));
    }
}
