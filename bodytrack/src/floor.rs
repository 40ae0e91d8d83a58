//! The floor: which way is up, and how high the sensor stands.
//!
//! The lowest large plane that is level enough, found by random samples (Fischler and Bolles 1981) and fitted to all points
//! near it. The sensor is taken to stand upright, tilted by at most [`MOST_TILT_DEG`].

use nalgebra::{Matrix3, SymmetricEigen};

use crate::lens::{Lens, V3, sigma_m};

/// A sensor hangs no more askew than this.
const MOST_TILT_DEG: f32 = 50.0;
/// Every so many pixels and rows a point is looked at.
const STRIDE: usize = 6;
/// Planes that are tried.
const TRIES: usize = 120;
/// A floor has at least this share of the points.
const LEAST_SHARE: f32 = 0.06;
/// What lies deeper than this below a plane speaks against its being the floor, metres, and how strongly.
const BELOW_M: f32 = 0.12;
const BELOW_WEIGHT: f32 = 3.0;
/// How often it is looked for again, images, and how much of what is found is taken over.
const EVERY: u32 = 45;
const TAKEN_OVER: f32 = 0.3;

/// Level axes in the sensor's own, and the height above the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level {
    /// Unit vector against gravity.
    pub(crate) up: V3,
    /// How high the sensor stands above the floor, metres; `None` while no floor was seen.
    pub(crate) above_m: Option<f32>,
}

impl Level {
    /// The sensor stands straight, who knows where.
    pub(crate) const UNKNOWN: Self = Self {
        up: V3::new(0.0, -1.0, 0.0),
        above_m: None,
    };

    /// Height above the floor, metres, where that is known.
    pub(crate) fn height_m(&self, point: &V3) -> Option<f32> {
        Some(self.up.dot(point) + self.above_m?)
    }

    /// A point's place along two level axes, metres: to the right and away from the sensor.
    pub(crate) fn plan(&self, point: &V3) -> [f32; 2] {
        let away = V3::z() - self.up * self.up.z;
        let away = away.try_normalize(1e-6).unwrap_or_else(V3::z);
        let right = away.cross(&self.up);
        [right.dot(point), away.dot(point)]
    }
}

/// Looks for the floor now and then.
pub(crate) struct Floor {
    level: Level,
    until_next: u32,
    points: Vec<V3>,
    random: u64,
}

impl Default for Floor {
    fn default() -> Self {
        Self {
            level: Level::UNKNOWN,
            until_next: 0,
            points: Vec::new(),
            random: 0x9e37_79b9_7f4a_7c15,
        }
    }
}

impl Floor {
    pub(crate) fn level(&self) -> Level {
        self.level
    }

    /// Takes in an image.
    pub(crate) fn update(&mut self, lens: &Lens, depth: &[u16]) {
        if self.until_next > 0 {
            self.until_next -= 1;
            return;
        }
        // Until there is one, in the third of the images.
        self.until_next = 2;
        self.collect(lens, depth);
        let Some(found) = self.search().and_then(|plane| self.fitted(plane)) else {
            return;
        };
        self.until_next = EVERY;
        self.level = match self.level.above_m {
            Some(above) if self.level.up.dot(&found.up) > 0.999 => {
                let new = found.above_m.unwrap_or(above);
                Level {
                    up: self.level.up.lerp(&found.up, TAKEN_OVER).normalize(),
                    above_m: Some(above + TAKEN_OVER * (new - above)),
                }
            }
            _ => found,
        };
    }

    fn collect(&mut self, lens: &Lens, depth: &[u16]) {
        self.points.clear();
        // The upper quarter of the image shows no floor.
        for v in (lens.height / 4..lens.height).step_by(STRIDE) {
            for u in (0..lens.width).step_by(STRIDE) {
                let index = v * lens.width + u;
                if depth[index] > 0 {
                    self.points.push(lens.point(index, depth[index]));
                }
            }
        }
    }

    fn search(&mut self) -> Option<Level> {
        if self.points.len() < 100 {
            return None;
        }
        let steepest = MOST_TILT_DEG.to_radians().cos();
        let mut best: Option<(f32, Level)> = None;
        for _ in 0..TRIES {
            let [a, b, c] = [(); 3].map(|()| self.any_point());
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-4) else {
                continue;
            };
            let up = if normal.y > 0.0 { -normal } else { normal };
            if -up.y < steepest {
                continue;
            }
            let plane = Level {
                up,
                above_m: Some(-up.dot(&a)),
            };
            let score = self.score(&plane);
            if best.as_ref().is_none_or(|(most, _)| score > *most) {
                best = Some((score, plane));
            }
        }
        let (score, plane) = best?;
        (score >= LEAST_SHARE * self.points.len() as f32).then_some(plane)
    }

    fn any_point(&mut self) -> V3 {
        // Xorshift (Marsaglia 2003): the same points each time the same images come.
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.points[(self.random % self.points.len() as u64) as usize]
    }

    fn score(&self, plane: &Level) -> f32 {
        let one = |point: &V3| {
            let height = plane.height_m(point).unwrap_or(f32::INFINITY);
            match height.abs() < near_m(point) {
                true => 1.0,
                false if height < -BELOW_M => -BELOW_WEIGHT,
                false => 0.0,
            }
        };
        self.points.iter().map(one).sum()
    }

    /// The plane through all points near `plane`.
    fn fitted(&self, plane: Level) -> Option<Level> {
        let near = |point: &&V3| {
            let height = plane.height_m(point).unwrap_or(f32::INFINITY);
            height.abs() < near_m(point)
        };
        let (mut weights, mut middle) = (0.0, V3::zeros());
        let weight = |point: &V3| 1.0 / sigma_m(point.z).max(0.002).powi(2);
        for point in self.points.iter().filter(near) {
            weights += weight(point);
            middle += point * weight(point);
        }
        middle /= weights;
        let mut spread = Matrix3::zeros();
        for point in self.points.iter().filter(near) {
            let off = point - middle;
            spread += off * off.transpose() * weight(point);
        }
        let eigen = SymmetricEigen::new(spread);
        let normal = eigen
            .eigenvectors
            .column(eigen.eigenvalues.imin())
            .into_owned();
        let up = if normal.y > 0.0 { -normal } else { normal };
        let above_m = -up.dot(&middle);
        // A plane through the sensor, or one that turned away in the fit, is none.
        let fits = up.dot(&plane.up) > 0.98 && (0.1..4.0).contains(&above_m);
        fits.then_some(Level {
            up,
            above_m: Some(above_m),
        })
    }
}

fn near_m(point: &V3) -> f32 {
    0.02 + 1.5 * sigma_m(point.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use posefuse_skeleton::Intrinsics;

    #[test]
    fn a_tilted_sensor_finds_the_floor_below_a_table_and_knows_its_height() {
        let camera = Intrinsics::from_view(320, 240, 1.0, 0.75);
        let lens = Lens::new(&camera, 320, [0.5, 8.0]);
        let (tilt, above) = (0.3f32, 1.4);
        let up = V3::new(0.0, -tilt.cos(), -tilt.sin());
        let mut depth = vec![0u16; 320 * 240];
        for (index, value) in depth.iter_mut().enumerate() {
            let ray = lens.point(index, 1000);
            let floor = -above / up.dot(&ray);
            let table = -(above - 0.8) / up.dot(&ray);
            let plan = ray.x * table;
            let z = match (-0.6..0.0).contains(&plan) && (1.0..1.8).contains(&table) {
                true => table,
                false => floor,
            };
            if z > 0.0 && z < 6.0 {
                *value = (z * 1e3) as u16;
            }
        }
        let mut floor = Floor::default();
        floor.update(&lens, &depth);
        let level = floor.level();
        assert!(level.up.dot(&up) > 0.9999, "{:?}", level.up);
        assert!((level.above_m.unwrap() - above).abs() < 0.01);
        let mut none = Floor::default();
        none.update(&lens, &vec![0; 320 * 240]);
        assert_eq!(none.level(), Level::UNKNOWN);
    }
}
