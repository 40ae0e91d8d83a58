//! Ways of the body over the floor: turning on the spot, walking a curve, stepping forwards or backwards.

use nalgebra::Vector2;

use super::curve::{eased_distance, eased_duration, ramp, unwrapped};
use super::steps::Place;

/// One movement over the floor, from its start (time 0) to its end.
#[derive(Clone, Debug)]
pub(crate) enum Route {
    /// Turning on the spot by an angle, radians.
    Turn { from: Place, by: f64 },
    /// Forwards (or backwards, if negative) without turning, metres.
    Shuffle { from: Place, by: f64 },
    /// Along a curve, facing where one goes.
    Walk { curve: Curve, speed: f64 },
}

/// Seconds over which a walk gains and loses its speed.
const EASE: f64 = 0.7;

impl Route {
    /// Seconds from start to end.
    pub(crate) fn duration(&self) -> f64 {
        match self {
            Self::Turn { by, .. } => 0.6 + by.abs() / 1.6,
            Self::Shuffle { by, .. } => 0.8 + by.abs() / 0.5,
            Self::Walk { curve, speed } => eased_duration(curve.length(), *speed, EASE),
        }
    }

    /// Where the body is `time` seconds after the start.
    pub(crate) fn at(&self, time: f64) -> Place {
        match self {
            Self::Turn { from, by } => Place {
                heading: from.heading + by * ramp(time / self.duration()),
                ..*from
            },
            Self::Shuffle { from, by } => from.shifted(by * ramp(time / self.duration()), 0.0),
            Self::Walk { curve, speed } => {
                curve.at(eased_distance(time, curve.length(), *speed, EASE))
            }
        }
    }

    /// Where it ends.
    pub(crate) fn end(&self) -> Place {
        self.at(self.duration())
    }

    /// A walk from `from`, first ahead, then by `corners` to the last of them. The speed is lowered until short
    /// ways are not rushed. `None` if the curve is too tight for that speed, or if there is no way to go.
    pub(crate) fn walk(from: Place, corners: &[Vector2<f64>], speed: f64) -> Option<Self> {
        let curve = Curve::new(from, corners)?;
        let speed = speed.min(curve.length() / (1.6 * EASE));
        let fastest_turn = 2.0;
        (curve.sharpest * speed <= fastest_turn).then_some(Self::Walk { curve, speed })
    }
}

/// A turn on the spot, the short way round; `None` if one already faces there.
pub(crate) fn turn(from: Place, heading: f64) -> Option<Route> {
    let by = unwrapped(heading, from.heading) - from.heading;
    (by.abs() > 1e-9).then_some(Route::Turn { from, by })
}

/// Turning towards the first corner where needed, then walking. `None` if corners are too close or a bend too tight.
pub(crate) fn ways(here: Place, corners: &[Vector2<f64>], speed: f64) -> Option<Vec<Route>> {
    let starts = std::iter::once(&here.at).chain(corners);
    if starts.zip(corners).any(|(a, b)| (a - b).norm() < 0.45) {
        return None;
    }
    let first = corners.first()? - here.at;
    let towards = first.y.atan2(first.x);
    let mut routes: Vec<Route> = turn(here, towards)
        .filter(|_| (unwrapped(towards, here.heading) - here.heading).abs() > 0.5)
        .into_iter()
        .collect();
    let from = routes.last().map_or(here, Route::end);
    routes.push(Route::walk(from, corners, speed)?);
    Some(routes)
}

/// A plane curve, tabulated by the distance along it: a uniform cubic B-spline with straight ends.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    points: Vec<(f64, Place)>,
    sharpest: f64,
}

impl Curve {
    fn new(from: Place, corners: &[Vector2<f64>]) -> Option<Self> {
        let last = *corners.last()?;
        let lead = 0.35f64.min(0.4 * (corners[0] - from.at).norm());
        let mut hull = vec![
            from.at - from.ahead() * lead,
            from.at,
            from.at + from.ahead() * lead,
        ];
        hull.extend_from_slice(corners);
        hull.push(last * 2.0 - hull[hull.len() - 2]);
        let mut points: Vec<(f64, Place)> = Vec::new();
        let mut sharpest = 0.0f64;
        const PER_SPAN: usize = 40;
        for span in hull.windows(4) {
            for k in 0..PER_SPAN {
                let (at, tangent) = bspline(span, k as f64 / PER_SPAN as f64);
                let (mut distance, mut near) = (0.0, from.heading);
                if let Some((so_far, before)) = points.last() {
                    let gone = (at - before.at).norm();
                    (distance, near) = (so_far + gone, before.heading);
                }
                let heading = unwrapped(tangent.y.atan2(tangent.x), near);
                if distance > 0.0 {
                    let gone = distance - points[points.len() - 1].0;
                    sharpest = sharpest.max((heading - near).abs() / gone.max(1e-6));
                }
                points.push((distance, Place { at, heading }));
            }
        }
        let (so_far, before) = *points.last()?;
        points.push((
            so_far + (last - before.at).norm(),
            Place { at: last, ..before },
        ));
        (so_far > 1e-3).then_some(Self { points, sharpest })
    }

    fn length(&self) -> f64 {
        self.points[self.points.len() - 1].0
    }

    fn at(&self, distance: f64) -> Place {
        let after = self
            .points
            .partition_point(|(d, _)| *d < distance)
            .clamp(1, self.points.len() - 1);
        let ((d0, a), (d1, b)) = (self.points[after - 1], self.points[after]);
        if distance >= d1 {
            return b;
        }
        let share = ((distance - d0) / (d1 - d0)).max(0.0);
        Place {
            at: a.at + (b.at - a.at) * share,
            heading: a.heading + (b.heading - a.heading) * share,
        }
    }
}

/// Point and tangent of one span of a uniform cubic B-spline.
fn bspline(hull: &[Vector2<f64>], u: f64) -> (Vector2<f64>, Vector2<f64>) {
    let v = 1.0 - u;
    let at = hull[0] * (v * v * v)
        + hull[1] * (3.0 * u * u * u - 6.0 * u * u + 4.0)
        + hull[2] * (-3.0 * u * u * u + 3.0 * u * u + 3.0 * u + 1.0)
        + hull[3] * (u * u * u);
    let tangent = hull[0] * (-v * v)
        + hull[1] * (3.0 * u * u - 4.0 * u)
        + hull[2] * (-3.0 * u * u + 2.0 * u + 1.0)
        + hull[3] * (u * u);
    (at / 6.0, tangent)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origin() -> Place {
        Place {
            at: Vector2::zeros(),
            heading: 0.3,
        }
    }

    #[test]
    fn a_walk_starts_here_facing_ahead_and_ends_at_the_last_corner() {
        let goal = Vector2::new(1.5, 1.0);
        let route = Route::walk(origin(), &[Vector2::new(0.9, 0.3), goal], 0.8).unwrap();
        let start = route.at(0.0);
        assert!(start.at.norm() < 1e-9 && (start.heading - 0.3).abs() < 1e-9);
        assert!((route.end().at - goal).norm() < 1e-9);
    }

    #[test]
    fn a_walk_never_outruns_its_speed() {
        let route = Route::walk(
            origin(),
            &[Vector2::new(1.0, 0.2), Vector2::new(2.0, 0.8)],
            0.8,
        )
        .unwrap();
        let step = 0.01;
        let mut time = 0.0;
        while time < route.duration() {
            let moved = (route.at(time + step).at - route.at(time).at).norm();
            assert!(moved <= 0.82 * step, "{moved} in {step} s");
            time += step;
        }
    }

    #[test]
    fn hairpins_are_refused() {
        assert!(Route::walk(origin(), &[Vector2::new(-0.5, 0.0)], 0.9).is_none());
    }
}
