//! What bodies are made of: the smooth hull of two balls, pressed flat along one direction or two.
//!
//! A pressed shape is a round one in space scaled along those directions; scaling keeps straight lines and how far along a
//! ray its points are, so a ray meets the pressed shape where the scaled ray meets the round one.

use nalgebra::{Matrix3, Vector3};

pub(super) type V3 = Vector3<f32>;

/// The hull of two balls in a sensor's frame, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// From the sensor's space to that in which the shape is round.
    round_from_flat: Matrix3<f32>,
    /// Middles and radii of the balls, in the sensor's space before pressing.
    ends: [(V3, f32); 2],
}

impl Shape {
    /// Balls of radius `ra` around `a` and `rb` around `b`, and what lies between.
    pub(super) fn limb(a: V3, b: V3, ra: f32, rb: f32) -> Self {
        Self {
            round_from_flat: Matrix3::identity(),
            ends: [(a, ra), (b, rb)],
        }
    }

    /// A ball.
    pub(super) fn ball(at: V3, radius: f32) -> Self {
        Self::limb(at, at, radius, radius)
    }

    /// `share` (below 1) as thick as before along the unit vector `along`. A second pressing must be across the first.
    pub(super) fn pressed(mut self, along: V3, share: f32) -> Self {
        let stretch = 1.0 / share.max(0.05) - 1.0;
        self.round_from_flat += along * along.transpose() * stretch;
        self
    }

    /// Both balls in the sensor's space: the shape is inside of their hull.
    pub(super) fn bounds(&self) -> [(V3, f32); 2] {
        self.ends
    }

    /// What rays from the origin need.
    pub(super) fn ready(&self) -> Ready {
        let [(a, ra), (b, rb)] = self.ends;
        let (a, b) = (self.round_from_flat * a, self.round_from_flat * b);
        let axis = b - a;
        let narrowing = ra - rb;
        Ready {
            a,
            axis,
            squares: [a.norm_squared() - ra * ra, b.norm_squared() - rb * rb],
            b,
            spread: axis.norm_squared() - narrowing * narrowing,
            offset: -axis.dot(&a) - ra * narrowing,
            bigger: usize::from(rb > ra),
            matrix: self.round_from_flat,
        }
    }
}

/// A shape with all that does not depend on the ray worked out.
pub(super) struct Ready {
    matrix: Matrix3<f32>,
    a: V3,
    b: V3,
    axis: V3,
    /// Squared distance from the origin less squared radius, for both balls.
    squares: [f32; 2],
    /// Squared length of the axis less the squared difference of the radii; not above 0 if one ball holds the other.
    spread: f32,
    offset: f32,
    bigger: usize,
}

impl Ready {
    /// A direction of the sensor's space as the shape needs it.
    pub(super) fn direction(&self, direction: V3) -> V3 {
        self.matrix * direction
    }

    /// How many times `d` (from [`Ready::direction`]) it is to the shape.
    ///
    /// A point is in the hull of the balls between if, for some s, it is nearer than ra + s (rb - ra) to a + s axis. Where
    /// the best s has just that distance a quadratic in the length along the ray vanishes; outside of 0..1 the ball at
    /// that end is the hull's border.
    #[inline]
    pub(super) fn hit(&self, d: V3) -> Option<f32> {
        let length = d.norm_squared();
        if self.spread <= 1e-9 {
            return self.hit_ball(d, length, self.bigger);
        }
        let along = self.axis.dot(&d);
        let k2 = self.spread * length - along * along;
        let k1 = -self.spread * self.a.dot(&d) - along * self.offset;
        let k0 = self.spread * self.squares[0] - self.offset * self.offset;
        if k2 < 1e-4 * self.spread * length {
            return self.hit_along(d, length);
        }
        let root = k1 * k1 - k0 * k2;
        if root < 0.0 {
            return None;
        }
        let t = (-k1 - root.sqrt()) / k2;
        let s = along * t + self.offset;
        if s < 0.0 {
            self.hit_ball(d, length, 0)
        } else if s > self.spread {
            self.hit_ball(d, length, 1)
        } else {
            Some(t)
        }
    }

    /// Which of the rays `first`, `first + step` ... (`count` of them) can hit: from, to before. What is under the root in
    /// [`Ready::hit`] is a parabola over a row of the image; three values give it.
    pub(super) fn span(&self, first: V3, step: V3, count: usize) -> [usize; 2] {
        let middle = (count / 2).max(1) as f32;
        let values = [0.0, middle, 2.0 * middle].map(|index| self.under_root(first + step * index));
        let [Some(left), Some(centre), Some(right)] = values else {
            return [0, count];
        };
        let bend = 0.5 * (left + right) - centre;
        let tilt = 0.5 * (right - left);
        let below = tilt * tilt - 4.0 * bend * centre;
        if bend >= 0.0 {
            return [0, count];
        }
        if below < 0.0 {
            return [0, 0];
        }
        let roots = [1.0, -1.0].map(|sign| (-tilt + sign * below.sqrt()) / (2.0 * bend));
        let pixel = |root: f64| ((root + 1.0) * f64::from(middle)).clamp(-2.0, count as f64 + 2.0);
        let from = (pixel(roots[0]) - 1.0).max(0.0) as usize;
        let to = (pixel(roots[1]) + 2.0).clamp(0.0, count as f64) as usize;
        [from.min(to), to]
    }

    /// `None` where the parabola does not say what is hit.
    fn under_root(&self, d: V3) -> Option<f64> {
        if self.spread <= 1e-9 {
            let (d, at) = (
                d.cast::<f64>(),
                [&self.a, &self.b][self.bigger].cast::<f64>(),
            );
            let q = d.dot(&at);
            return Some(q * q - d.norm_squared() * f64::from(self.squares[self.bigger]));
        }
        let (d, a, axis) = (
            d.cast::<f64>(),
            self.a.cast::<f64>(),
            self.axis.cast::<f64>(),
        );
        let (spread, offset) = (f64::from(self.spread), f64::from(self.offset));
        let along = axis.dot(&d);
        let k2 = spread * d.norm_squared() - along * along;
        let k1 = -spread * a.dot(&d) - along * offset;
        let k0 = spread * f64::from(self.squares[0]) - offset * offset;
        (k2 >= 1e-3 * spread * d.norm_squared()).then_some(k1 * k1 - k0 * k2)
    }

    /// Looking down the axis the balls at the ends are all there is to see.
    fn hit_along(&self, d: V3, length: f32) -> Option<f32> {
        let hits = [self.hit_ball(d, length, 0), self.hit_ball(d, length, 1)];
        hits.into_iter().flatten().reduce(f32::min)
    }

    #[inline]
    fn hit_ball(&self, d: V3, length: f32, end: usize) -> Option<f32> {
        let centre = if end == 0 { &self.a } else { &self.b };
        let q = d.dot(centre);
        let root = q * q - length * self.squares[end];
        (root >= 0.0).then(|| (q - root.sqrt()) / length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a point is inside, by looking at many places along the axis.
    fn inside(p: V3, [(a, ra), (b, rb)]: [(V3, f32); 2]) -> bool {
        (0..=100).any(|step| {
            let s = step as f32 / 100.0;
            (p - a.lerp(&b, s)).norm() < ra + s * (rb - ra)
        })
    }

    #[test]
    fn rays_end_on_the_surface_and_miss_what_is_not_in_their_way() {
        let ends = [
            (V3::new(-0.2, 0.1, 2.0), 0.12),
            (V3::new(0.3, -0.1, 2.3), 0.05),
        ];
        let shape = Shape::limb(ends[0].0, ends[1].0, ends[0].1, ends[1].1).ready();
        let (mut hits, mut misses) = (0, 0);
        for (v, u) in (-14..14).flat_map(|v| (-14..14).map(move |u| (v, u))) {
            let d = V3::new(u as f32 * 0.012, v as f32 * 0.012, 1.0);
            let mut way = (0..300).map(|step| 1.7 + 0.003 * step as f32);
            let nearest = way.find(|t| inside(d * *t, ends));
            match (shape.hit(shape.direction(d)), nearest) {
                (Some(t), Some(expected)) => {
                    hits += 1;
                    assert!((t - expected).abs() < 8e-3, "{t} {expected} at {u} {v}");
                }
                (None, None) => misses += 1,
                // At the rim the search walks past.
                (Some(t), None) => assert!(!inside(d * (t + 0.02), ends)),
                (None, Some(t)) => panic!("nothing hit at {u} {v}, expected {t}"),
            }
        }
        assert!(hits > 150 && misses > 300, "{hits} {misses}");
    }

    #[test]
    fn pressing_makes_a_ball_thin_in_one_direction_only() {
        let at = V3::new(0.0, 0.0, 2.0);
        let hit = |shape: Shape, x: f32| {
            let ready = shape.ready();
            ready.hit(ready.direction(V3::new(x, 0.0, 1.0)))
        };
        let flat = Shape::ball(at, 0.2).pressed(V3::z(), 0.5);
        assert!((hit(flat, 0.0).unwrap() - 1.9).abs() < 1e-4);
        assert!(hit(flat, 0.19 / 2.0).is_some() && hit(flat, 0.21 / 2.0).is_none());
        let narrow = Shape::ball(at, 0.2).pressed(V3::x(), 0.5);
        assert!((hit(narrow, 0.0).unwrap() - 1.8).abs() < 1e-4);
        assert!(hit(narrow, 0.11 / 2.0).is_none());
    }

    #[test]
    fn a_ball_within_the_other_changes_nothing() {
        let at = V3::new(0.0, 0.0, 2.0);
        let shape = Shape::limb(at, at + V3::x() * 0.05, 0.2, 0.1).ready();
        let t = shape.hit(V3::z()).unwrap();
        assert!((t - 1.8).abs() < 1e-5);
    }
}
