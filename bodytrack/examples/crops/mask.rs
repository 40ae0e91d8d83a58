//! Whose pixel is whose, with the faults of a real segmentation.

use posefuse_simulator::depth::{DepthCamera, DepthView};
use posefuse_skeleton::{DepthImage, Room, Sensor, Transform};

use crate::chance::Chance;

pub(crate) struct Mask {
    pixels: Vec<bool>,
    width: usize,
    number: u8,
}

impl Mask {
    pub(crate) fn of(view: &DepthView, number: u8) -> Self {
        Self {
            pixels: view.owners.iter().map(|owner| *owner == number).collect(),
            width: view.image.width as usize,
            number,
        }
    }

    pub(crate) fn holds(&self, at: usize) -> bool {
        self.pixels[at]
    }

    pub(crate) fn measured(&self, image: &DepthImage) -> usize {
        let both = self.pixels.iter().zip(&image.millimetres);
        both.filter(|(held, mm)| **held && **mm > 0).count()
    }

    /// Columns and rows that hold everything.
    pub(crate) fn extent(&self) -> [[usize; 2]; 2] {
        let mut extent = [[usize::MAX, 0]; 2];
        for at in (0..self.pixels.len()).filter(|at| self.pixels[*at]) {
            for (side, index) in extent.iter_mut().zip([at % self.width, at / self.width]) {
                *side = [side[0].min(index), side[1].max(index + 1)];
            }
        }
        extent
    }

    /// As a segmentation would have it.
    pub(crate) fn spoiled(
        mut self,
        view: &DepthView,
        camera: &DepthCamera,
        room_from_sensor: &Transform<Room, Sensor>,
        chance: &mut Chance,
    ) -> Self {
        if chance.with(0.25) {
            return self;
        }
        let place = |at: usize| {
            let mm = view.image.millimetres[at];
            let (u, v) = ((at % self.width) as f64, (at / self.width) as f64);
            (mm > 0).then(|| camera.intrinsics.point(u, v, f64::from(mm) * 1e-3))
        };
        let height = |at: usize| place(at).map(|p| room_from_sensor.apply(p).vector().z);
        let mut pixels = self.pixels.clone();
        if chance.with(0.35) {
            let ankle = chance.between(0.02, 0.14);
            let low = |at: usize| height(at).is_some_and(|height| height < ankle);
            (0..pixels.len()).for_each(|at| pixels[at] &= !low(at));
        }
        // Balls about pixels of the person: floor and others within are taken in, or a piece is lost.
        for (probability, radii, keep) in [
            (0.25, [0.08, 0.25], Some(0)),
            (0.3, [0.08, 0.35], None),
            (0.12, [0.06, 0.2], Some(self.number)),
        ] {
            let Some(centre) = chance.with(probability).then(|| self.some_pixel(chance)) else {
                continue;
            };
            let Some(centre) = centre.and_then(place) else {
                continue;
            };
            let radius = chance.between(radii[0], radii[1]);
            for (at, held) in pixels.iter_mut().enumerate() {
                let owner = view.owners[at];
                let concerns = keep.map_or(owner != self.number && owner > 0, |k| owner == k);
                if concerns && place(at).is_some_and(|p| p.distance(centre) < radius) {
                    *held = owner != self.number;
                }
            }
        }
        self.pixels = pixels;
        if chance.with(0.3) {
            self.grow(chance.with(0.5), &view.image);
        }
        self
    }

    fn some_pixel(&self, chance: &mut Chance) -> Option<usize> {
        (0..400)
            .map(|_| chance.below(self.pixels.len()))
            .find(|at| self.pixels[*at])
    }

    /// A pixel more all around (where distances go on), or one less.
    fn grow(&mut self, more: bool, image: &DepthImage) {
        let before = self.pixels.clone();
        let height = self.pixels.len() / self.width;
        for v in 1..height.saturating_sub(1) {
            for u in 1..self.width - 1 {
                let at = v * self.width + u;
                let next = [at - 1, at + 1, at - self.width, at + self.width];
                let joined = |other: &usize| {
                    let [a, b] = [at, *other].map(|i| i32::from(image.millimetres[i]));
                    before[*other] && (a - b).abs() < 100
                };
                if more {
                    self.pixels[at] |= next.iter().any(joined);
                } else {
                    self.pixels[at] &= next.iter().all(|other| before[*other]);
                }
            }
        }
    }
}
