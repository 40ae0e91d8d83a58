//! What a depth sensor sees: distances along the optical axis, and the pinhole camera behind them.
//!
//! Axes are the sensor's optical ones (x right, y down, z forward). Pixel centres have whole numbers, the first pixel
//! of the first row is (0, 0), rows run downwards. Images are not mirrored.

use serde::{Deserialize, Serialize};

use crate::{Position, Sensor};

/// A pinhole camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intrinsics {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal lengths, pixels.
    pub fx: f64,
    /// Of the rows.
    pub fy: f64,
    /// Where the optical axis meets the image, pixels.
    pub cx: f64,
    /// Of the rows.
    pub cy: f64,
}

impl Intrinsics {
    /// A camera that looks straight ahead with these whole fields of view, in radians.
    pub fn from_view(width: u32, height: u32, horizontal: f64, vertical: f64) -> Self {
        let focal = |pixels: u32, view: f64| f64::from(pixels) / 2.0 / (view / 2.0).tan();
        Self {
            width,
            height,
            fx: focal(width, horizontal),
            fy: focal(height, vertical),
            cx: (f64::from(width) - 1.0) / 2.0,
            cy: (f64::from(height) - 1.0) / 2.0,
        }
    }

    /// Where a pixel (u, v) that is `depth_m` away along the optical axis lies.
    pub fn point(&self, u: f64, v: f64, depth_m: f64) -> Position<Sensor> {
        Position::new(
            (u - self.cx) / self.fx * depth_m,
            (v - self.cy) / self.fy * depth_m,
            depth_m,
        )
    }

    /// Where a point falls, pixels; may be outside of the image. `None`: it is not in front of the camera.
    pub fn pixel(&self, point: &Position<Sensor>) -> Option<[f64; 2]> {
        let at = point.vector();
        let (x, y, z) = (at.x, at.y, at.z);
        (z > 0.0).then(|| [x / z * self.fx + self.cx, y / z * self.fy + self.cy])
    }

    /// The camera of an image of which only each `step`-th pixel and row is kept, from the first on.
    pub fn every(&self, step: u32) -> Self {
        let by = f64::from(step);
        Self {
            width: self.width.div_ceil(step),
            height: self.height.div_ceil(step),
            fx: self.fx / by,
            fy: self.fy / by,
            cx: self.cx / by,
            cy: self.cy / by,
        }
    }

    /// Whole horizontal and vertical field of view, radians.
    pub fn view(&self) -> [f64; 2] {
        let side = |pixels: u32, focal: f64, centre: f64| {
            ((centre + 0.5) / focal).atan() + ((f64::from(pixels) - 0.5 - centre) / focal).atan()
        };
        [
            side(self.width, self.fx, self.cx),
            side(self.height, self.fy, self.cy),
        ]
    }
}

/// One image of a depth sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DepthImage {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Distance along the optical axis, millimetres, row after row; 0 where the sensor has none.
    pub millimetres: Vec<u16>,
}

impl DepthImage {
    /// An image in which nothing is seen.
    pub fn empty(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            millimetres: vec![0; width as usize * height as usize],
        }
    }

    /// The image of each `step`-th pixel and row; goes with [`Intrinsics::every`].
    ///
    /// # Panics
    /// If `step` is 0 or there are fewer distances than `width` x `height`.
    pub fn every(&self, step: u32) -> Self {
        let (width, step) = (self.width as usize, step as usize);
        let rows = (0..self.height as usize).step_by(step);
        let row = |v: usize| &self.millimetres[v * width..(v + 1) * width];
        Self {
            width: self.width.div_ceil(step as u32),
            height: self.height.div_ceil(step as u32),
            millimetres: rows
                .flat_map(|v| row(v).iter().copied().step_by(step))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_pixels_are_each_others_inverse_and_thinning_keeps_both() {
        let camera = Intrinsics::from_view(640, 480, 1.0, 0.75);
        let [horizontal, vertical] = camera.view();
        assert!((horizontal - 1.0).abs() < 1e-12 && (vertical - 0.75).abs() < 1e-12);
        let point = camera.point(100.0, 40.0, 2.0);
        let [u, v] = camera.pixel(&point).unwrap();
        assert!((u - 100.0).abs() < 1e-9 && (v - 40.0).abs() < 1e-9);
        let thin = camera.every(4).point(25.0, 10.0, 2.0);
        assert!((thin.vector() - point.vector()).norm() < 1e-12);
        assert_eq!(camera.pixel(&camera.point(3.0, 3.0, -1.0)), None);
    }

    #[test]
    fn thinning_keeps_the_first_pixel_of_each_block() {
        let mut image = DepthImage::empty(5, 3);
        image.millimetres[0] = 7;
        image.millimetres[2 * 5 + 4] = 9;
        let thin = image.every(2);
        assert_eq!((thin.width, thin.height), (3, 2));
        assert_eq!(thin.millimetres, [7, 0, 0, 0, 0, 9]);
    }
}
