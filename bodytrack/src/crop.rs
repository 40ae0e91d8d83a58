//! A person cut out of a depth image for the network: at a fixed metric scale, seen along the line of sight to them.
//!
//! The crop's axes start at the person's middle: z away from the sensor, x right, y down. It is an orthographic view of the
//! person's measured points, [`SIZE`] x [`SIZE`] cells over [`WINDOW_M`] metres, so that a distance in it is the same
//! whether somebody stands at 1 m or at 4 m, in the image's middle or at its edge. The training data is made by this same code.
//!
//! Two channels after each other, each row after row:
//! 1. how far behind the middle the surface is, [`DEPTH_M`] metres being 1, within -1..1; 0 where nothing is;
//! 2. 1 where the person is seen; -1 where nobody can tell (outside of the image, or behind something nearer);
//!    0 where the person is not.

use nalgebra::{Matrix3, Rotation3, Vector3};
use posefuse_skeleton::{DepthImage, Intrinsics, Position, Sensor};

/// Cells in a row and in a column.
pub const SIZE: usize = 64;
/// Numbers of a cell.
pub const CHANNELS: usize = 2;
/// Side of the square that is cut out, metres.
pub const WINDOW_M: f64 = 2.24;
/// What 1 means in the first channel, metres.
pub const DEPTH_M: f64 = 1.0;

const CELLS: usize = SIZE * SIZE;
const CELL_M: f64 = WINDOW_M / SIZE as f64;
/// With fewer measured pixels than this nobody is made out.
const LEAST_PIXELS: usize = 30;
/// The middle is found from about this many pixels.
const FOR_MIDDLE: usize = 1200;
/// In a cell, what is further behind the nearest point than this is another surface, metres.
const SURFACE_M: f32 = 0.08;
/// Who is this much nearer than the middle hides it, metres.
const BEFORE_M: f32 = 0.35;

/// Where a crop lies: between the sensor's frame and the crop's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CropFrame {
    middle: Vector3<f64>,
    sensor_from_crop: Rotation3<f64>,
}

impl CropFrame {
    /// Around a person's middle (not the sensor's own place), seen along the line of sight to it.
    fn around(middle: Vector3<f64>) -> Option<Self> {
        let z = middle.try_normalize(1e-6)?;
        let x = Vector3::y().cross(&z).try_normalize(1e-6)?;
        let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
        Some(Self {
            middle,
            sensor_from_crop: Rotation3::from_matrix_unchecked(axes),
        })
    }

    /// The person's middle.
    pub fn middle(&self) -> Position<Sensor> {
        Position::from_vector(self.middle)
    }

    /// A point of the crop (metres from its middle, its axes) in the sensor's frame.
    pub fn to_sensor(&self, point: [f64; 3]) -> Position<Sensor> {
        Position::from_vector(self.sensor_from_crop * Vector3::from(point) + self.middle)
    }

    /// The inverse of [`CropFrame::to_sensor`].
    pub fn to_crop(&self, point: Position<Sensor>) -> [f64; 3] {
        let away = self.sensor_from_crop.inverse() * (point.vector() - self.middle);
        away.into()
    }
}

/// The crops of one image; keeps its memory from person to person.
#[derive(Clone, Debug, Default)]
pub struct Cropper {
    coordinates: [Vec<f32>; 3],
    nearest: Vec<f32>,
    sums: Vec<[f32; 2]>,
}

impl Cropper {
    /// Cuts out the person whose pixels `belongs` names (by their index into the image) and appends [`CHANNELS`] x [`SIZE`] x
    /// [`SIZE`] numbers to `into`. `columns` and `rows` (from, to before) must hold all of these pixels; the
    /// tighter they are, the quicker and the steadier.
    ///
    /// `None`, and nothing appended, if hardly anything is measured of them.
    pub fn cut(
        &mut self,
        image: &DepthImage,
        camera: &Intrinsics,
        [columns, rows]: [[usize; 2]; 2],
        belongs: impl Fn(usize) -> bool,
        into: &mut Vec<f32>,
    ) -> Option<CropFrame> {
        let (width, height) = (image.width as usize, image.height as usize);
        let [columns, rows] = [
            [columns[0], columns[1].min(width)],
            [rows[0], rows[1].min(height)],
        ];
        let pixels = Pixels {
            image,
            camera: Camera::of(camera),
            columns,
            rows,
            belongs,
        };
        let middle = self.middle(&pixels)?;
        let frame = CropFrame::around(middle.cast())?;
        self.splat(&pixels, &frame);
        self.write(&pixels, &frame, into);
        Some(frame)
    }

    /// The median of each coordinate over the person's pixels.
    fn middle(&mut self, pixels: &Pixels<'_, impl Fn(usize) -> bool>) -> Option<Vector3<f32>> {
        self.coordinates.iter_mut().for_each(Vec::clear);
        let [columns, rows] = [pixels.columns, pixels.rows].map(|[a, b]| b.saturating_sub(a));
        // A person fills about a third of the box around them.
        let step = ((columns * rows) as f32 / (3 * FOR_MIDDLE) as f32).sqrt();
        for step in [step.max(1.0) as usize, 1] {
            self.coordinates.iter_mut().for_each(Vec::clear);
            pixels.each(step, |point| {
                for (axis, coordinates) in self.coordinates.iter_mut().enumerate() {
                    coordinates.push(point[axis]);
                }
            });
            if self.coordinates[0].len() >= LEAST_PIXELS {
                break;
            }
        }
        let count = self.coordinates[0].len();
        let mut middle = Vector3::zeros();
        for (axis, coordinates) in self.coordinates.iter_mut().enumerate() {
            if count < LEAST_PIXELS {
                return None;
            }
            middle[axis] = *coordinates
                .select_nth_unstable_by(count / 2, f32::total_cmp)
                .1;
        }
        Some(middle)
    }

    /// For each cell the mean of what is seen of its nearest surface.
    fn splat(&mut self, pixels: &Pixels<'_, impl Fn(usize) -> bool>, frame: &CropFrame) {
        self.nearest.clear();
        self.nearest.resize(CELLS, f32::INFINITY);
        self.sums.clear();
        self.sums.resize(CELLS, [0.0; 2]);
        let middle = frame.middle.cast::<f32>();
        let crop_from_sensor = frame.sensor_from_crop.inverse().matrix().cast::<f32>();
        let cell = |point: Vector3<f32>| {
            let at = crop_from_sensor * (point - middle);
            let index = |metres: f32| {
                let index = metres / CELL_M as f32 + SIZE as f32 / 2.0;
                (0.0..SIZE as f32)
                    .contains(&index)
                    .then_some(index as usize)
            };
            Some((index(at.y)? * SIZE + index(at.x)?, at.z))
        };
        // Two to three pixels a cell and row are enough.
        let between = middle.z.max(0.1) / pixels.camera.focal[0];
        let step = ((CELL_M as f32 / 2.5 / between) as usize).max(1);
        pixels.each(step, |point| {
            if let Some((cell, z)) = cell(point) {
                self.nearest[cell] = self.nearest[cell].min(z);
            }
        });
        pixels.each(step, |point| {
            if let Some((cell, z)) = cell(point)
                && z < self.nearest[cell] + SURFACE_M
            {
                let [sum, count] = &mut self.sums[cell];
                *sum += z;
                *count += 1.0;
            }
        });
    }

    fn write(
        &self,
        pixels: &Pixels<'_, impl Fn(usize) -> bool>,
        frame: &CropFrame,
        into: &mut Vec<f32>,
    ) {
        let start = into.len();
        into.resize(start + CHANNELS * CELLS, 0.0);
        let (depths, seen) = into[start..].split_at_mut(CELLS);
        let sensor_from_crop = frame.sensor_from_crop.matrix().cast::<f32>();
        let middle = frame.middle.cast::<f32>();
        let across = |index: usize| (index as f32 + 0.5 - SIZE as f32 / 2.0) * CELL_M as f32;
        for (cell, [sum, count]) in self.sums.iter().enumerate() {
            if *count > 0.0 {
                depths[cell] = (sum / count / DEPTH_M as f32).clamp(-1.0, 1.0);
                seen[cell] = 1.0;
                continue;
            }
            let at = Vector3::new(across(cell % SIZE), across(cell / SIZE), 0.0);
            if pixels.unknown(sensor_from_crop * at + middle) {
                seen[cell] = -1.0;
            }
        }
    }
}

/// A pinhole camera in single precision.
struct Camera {
    focal: [f32; 2],
    centre: [f32; 2],
}

impl Camera {
    fn of(camera: &Intrinsics) -> Self {
        Self {
            focal: [camera.fx as f32, camera.fy as f32],
            centre: [camera.cx as f32, camera.cy as f32],
        }
    }
}

struct Pixels<'a, B> {
    image: &'a DepthImage,
    camera: Camera,
    columns: [usize; 2],
    rows: [usize; 2],
    belongs: B,
}

impl<B: Fn(usize) -> bool> Pixels<'_, B> {
    /// Every `step`th pixel and row of the person's that has a distance, in sensor coordinates.
    fn each(&self, step: usize, mut take: impl FnMut(Vector3<f32>)) {
        let width = self.image.width as usize;
        let Camera { focal, centre } = &self.camera;
        let [right, down] = focal.map(|focal| 1.0 / focal);
        for v in (self.rows[0]..self.rows[1]).step_by(step) {
            let y = (v as f32 - centre[1]) * down;
            for u in (self.columns[0]..self.columns[1]).step_by(step) {
                let at = v * width + u;
                let mm = self.image.millimetres.get(at).copied().unwrap_or(0);
                if mm > 0 && (self.belongs)(at) {
                    let z = f32::from(mm) * 1e-3;
                    take(Vector3::new((u as f32 - centre[0]) * right * z, y * z, z));
                }
            }
        }
    }

    /// Whether the image does not tell what is at this place: it is outside, or something nearer is before it.
    fn unknown(&self, point: Vector3<f32>) -> bool {
        if point.z <= 0.05 {
            return true;
        }
        let Camera { focal, centre } = &self.camera;
        let u = point.x / point.z * focal[0] + centre[0] + 0.5;
        let v = point.y / point.z * focal[1] + centre[1] + 0.5;
        let (width, height) = (self.image.width, self.image.height);
        if !(u >= 0.0 && v >= 0.0 && u < width as f32 && v < height as f32) {
            return true;
        }
        let at = v as usize * width as usize + u as usize;
        let mm = self.image.millimetres.get(at).copied().unwrap_or(0);
        mm > 0 && f32::from(mm) * 1e-3 < point.z - BEFORE_M && !(self.belongs)(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Intrinsics {
        Intrinsics::from_view(320, 240, 1.0, 0.77)
    }

    /// A wall of `size` metres at `at`, facing the sensor, drawn into an otherwise empty image.
    fn panel(image: &mut DepthImage, at: [f64; 3], size: [f64; 2]) {
        let camera = camera();
        for v in 0..image.height {
            for u in 0..image.width {
                let point = camera.point(f64::from(u), f64::from(v), at[2]).vector();
                let inside = (0..2).all(|axis| (point[axis] - at[axis]).abs() < size[axis] / 2.0);
                if inside {
                    let index = (v * image.width + u) as usize;
                    image.millimetres[index] = (at[2] * 1000.0) as u16;
                }
            }
        }
    }

    fn cut(image: &DepthImage, belongs: impl Fn(usize) -> bool) -> Option<(CropFrame, Vec<f32>)> {
        let mut numbers = Vec::new();
        let mut extent = [[usize::MAX, 0]; 2];
        let held = |at: &usize| image.millimetres[*at] > 0 && belongs(*at);
        for at in (0..image.millimetres.len()).filter(held) {
            for (side, index) in extent.iter_mut().zip([at % 320, at / 320]) {
                *side = [side[0].min(index), side[1].max(index + 1)];
            }
        }
        let mut cropper = Cropper::default();
        let frame = cropper.cut(image, &camera(), extent, belongs, &mut numbers)?;
        Some((frame, numbers))
    }

    fn area_m2(crop: &[f32]) -> f64 {
        let cells = crop[CELLS..].iter().filter(|seen| **seen == 1.0).count();
        cells as f64 * CELL_M * CELL_M
    }

    #[test]
    fn a_person_is_as_big_near_and_far_and_at_the_images_edge() {
        for at in [[0.0, 0.0, 1.8], [0.0, 0.0, 4.0], [1.2, 0.3, 4.0]] {
            let mut image = DepthImage::empty(320, 240);
            panel(&mut image, at, [0.5, 1.0]);
            let (frame, crop) = cut(&image, |_| true).unwrap();
            assert!((frame.middle().vector() - Vector3::from(at)).norm() < 0.05);
            assert_eq!(crop.len(), CHANNELS * CELLS);
            let area = area_m2(&crop);
            assert!((0.44..0.58).contains(&area), "{area} at {at:?}");
            let worst = crop[..CELLS]
                .iter()
                .fold(0.0f32, |worst, z| worst.max(z.abs()));
            // Beside the axis the panel is not square to the line of sight.
            assert!(worst < 0.12, "{worst} at {at:?}");
        }
    }

    #[test]
    fn points_go_to_the_crop_and_back() {
        let frame = CropFrame::around(Vector3::new(0.8, -0.4, 2.5)).unwrap();
        let point = Position::new(0.3, 0.2, 2.9);
        let back = frame.to_sensor(frame.to_crop(point));
        assert!(back.distance(point) < 1e-12);
        let away = frame.to_crop(Position::from_vector(frame.middle * 1.2));
        assert!(away[0].abs() < 1e-9 && away[1].abs() < 1e-9 && away[2] > 0.4);
    }

    #[test]
    fn what_cannot_be_known_is_told_from_what_is_not_there() {
        let mut image = DepthImage::empty(320, 240);
        panel(&mut image, [0.9, 0.0, 2.5], [0.4, 0.8]);
        let mut before = DepthImage::empty(320, 240);
        panel(&mut before, [0.15, 0.0, 1.2], [0.15, 0.3]);
        let person = image.clone();
        for (here, nearer) in image.millimetres.iter_mut().zip(&before.millimetres) {
            *here = if *nearer > 0 { *nearer } else { *here };
        }
        let belongs = |at: usize| person.millimetres[at] > 0 && before.millimetres[at] == 0;
        let (frame, crop) = cut(&image, belongs).unwrap();
        let cell = |at: [f64; 3]| {
            let [x, y, _] = frame.to_crop(Position::from_vector(Vector3::from(at)));
            let index = |m: f64| (m / CELL_M + SIZE as f64 / 2.0) as usize;
            crop[CELLS + index(y) * SIZE + index(x)]
        };
        assert_eq!(cell([0.9, 0.0, 2.5]), 1.0, "the person");
        assert_eq!(cell([0.9, 0.7, 2.5]), 0.0, "nothing there");
        assert_eq!(cell([0.3, 0.0, 2.5]), -1.0, "behind something nearer");
        assert_eq!(cell([1.7, 0.0, 2.5]), -1.0, "outside of the image");
    }

    #[test]
    fn hardly_anything_is_nobody() {
        let image = DepthImage::empty(320, 240);
        assert_eq!(cut(&image, |_| true), None);
        let mut image = DepthImage::empty(320, 240);
        image.millimetres[..20].fill(2000);
        assert_eq!(cut(&image, |_| true), None);
    }
}
