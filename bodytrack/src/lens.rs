//! The thinned camera, and what its distances are worth.

use nalgebra::Vector3;
use posefuse_skeleton::{DepthImage, Intrinsics};

/// A vector in the sensor's optical axes, metres.
pub(crate) type V3 = Vector3<f32>;

/// Distances are looked up in steps of so many millimetres.
const TABLE_STEP_MM: usize = 16;

/// The camera of thinned images with what follows from it.
pub(crate) struct Lens {
    /// Of the thinned images.
    pub(crate) camera: Intrinsics,
    /// Which pixels and rows are kept: each `step`-th.
    pub(crate) step: u32,
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Metres to the right of the axis at one metre, for each column.
    right: Vec<f32>,
    /// The same downwards, for each row.
    down: Vec<f32>,
    /// By distance: how far from the background something is no noise, mm.
    apart: Vec<u16>,
    /// By distance: how far apart neighbouring pixels of one surface may be, mm.
    joined: Vec<u16>,
    range_mm: [u16; 2],
}

impl Lens {
    /// `width`: about how many pixels in a row are wanted.
    pub(crate) fn new(camera: &Intrinsics, width: u32, range_m: [f64; 2]) -> Self {
        let step = ((f64::from(camera.width) / f64::from(width)).round() as u32).max(1);
        let thin = camera.every(step);
        let at = |index: u32, centre: f64, focal: f64| ((f64::from(index) - centre) / focal) as f32;
        let table = |share: f32, least: f32| {
            let millimetres = (0..=usize::from(u16::MAX)).step_by(TABLE_STEP_MM);
            let apart = |mm: usize| 1e3 * (least + share * sigma_m(mm as f32 * 1e-3));
            millimetres.map(|mm| apart(mm).min(6e4) as u16).collect()
        };
        Self {
            right: (0..thin.width).map(|u| at(u, thin.cx, thin.fx)).collect(),
            down: (0..thin.height).map(|v| at(v, thin.cy, thin.fy)).collect(),
            width: thin.width as usize,
            height: thin.height as usize,
            apart: table(3.0, 0.025),
            joined: table(3.5, 0.04),
            range_mm: range_m.map(|metres| (metres * 1e3).round() as u16),
            camera: thin,
            step,
        }
    }

    /// Thins an image into `into`; distances out of range become 0.
    pub(crate) fn thin(&self, image: &DepthImage, into: &mut Vec<u16>) {
        let [near, far] = self.range_mm;
        let (wide, step) = (image.width as usize, self.step as usize);
        into.clear();
        for v in (0..image.height as usize).step_by(step) {
            let row = &image.millimetres[v * wide..(v + 1) * wide];
            let kept = row.iter().step_by(step);
            into.extend(kept.map(|&mm| if (near..=far).contains(&mm) { mm } else { 0 }));
        }
    }

    /// Where the pixel `index` lies that is so far away.
    pub(crate) fn point(&self, index: usize, mm: u16) -> V3 {
        let (u, v) = (index % self.width, index / self.width);
        let z = f32::from(mm) * 1e-3;
        V3::new(self.right[u] * z, self.down[v] * z, z)
    }

    /// Where a point falls, pixels; outside of the image, too.
    pub(crate) fn pixel(&self, point: &V3) -> Option<[f32; 2]> {
        let camera = &self.camera;
        (point.z > 0.05).then(|| {
            [
                point.x / point.z * camera.fx as f32 + camera.cx as f32,
                point.y / point.z * camera.fy as f32 + camera.cy as f32,
            ]
        })
    }

    /// What one pixel covers on a surface across the ray, square metres.
    pub(crate) fn area_m2(&self, mm: u16) -> f32 {
        let z = f32::from(mm) * 1e-3;
        z * z / (self.camera.fx * self.camera.fy) as f32
    }

    /// How far from a surface that far away something is no noise, mm.
    pub(crate) fn apart_mm(&self, mm: u16) -> u16 {
        self.apart[usize::from(mm) / TABLE_STEP_MM]
    }

    /// How far apart neighbouring pixels of one surface may be, mm.
    pub(crate) fn joined_mm(&self, mm: u16) -> u16 {
        self.joined[usize::from(mm) / TABLE_STEP_MM]
    }
}

/// Spread of a cheap sensor's distances, metres: Kinect v1 after Nguyen, Izadi and Lovell (2012); later ones are better.
pub(crate) fn sigma_m(z: f32) -> f32 {
    0.0012 + 0.0019 * (z - 0.4).powi(2)
}
