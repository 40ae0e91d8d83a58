//! The image while it is drawn: exact distances, and whose they are.

use posefuse_skeleton::Intrinsics;

use super::shape::{Shape, V3};

/// Set in a tag beside the owner's number where what is seen is hair.
pub(super) const HAIR: u8 = 0x80;

/// Nearer than this nothing is drawn, metres.
const NEAREST_M: f32 = 0.05;

pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) focal: [f32; 2],
    centre: [f32; 2],
    /// Along the optical axis, metres; infinite where there is nothing.
    pub(super) depth: Vec<f32>,
    /// 0: the room; else the owner's number, with [`HAIR`].
    pub(super) tags: Vec<u8>,
}

impl Canvas {
    pub(super) fn new(camera: &Intrinsics) -> Self {
        let pixels = camera.width as usize * camera.height as usize;
        Self {
            width: camera.width as usize,
            height: camera.height as usize,
            focal: [camera.fx as f32, camera.fy as f32],
            centre: [camera.cx as f32, camera.cy as f32],
            depth: vec![f32::INFINITY; pixels],
            tags: vec![0; pixels],
        }
    }

    /// The direction through a pixel, 1 along the optical axis.
    pub(super) fn ray(&self, u: usize, v: usize) -> V3 {
        V3::new(
            (u as f32 - self.centre[0]) / self.focal[0],
            (v as f32 - self.centre[1]) / self.focal[1],
            1.0,
        )
    }

    pub(super) fn draw(&mut self, shape: &Shape, tag: u8) {
        let Some([columns, rows]) = self.extent(&shape.bounds()) else {
            return;
        };
        let ready = shape.ready();
        let step = ready.direction(V3::new(1.0 / self.focal[0], 0.0, 0.0));
        for v in rows[0]..rows[1] {
            let first = ready.direction(self.ray(columns[0], v));
            let span = ready.span(first, step, columns[1] - columns[0]);
            let first = first + step * span[0] as f32;
            let at = v * self.width + columns[0];
            let depth = &mut self.depth[at + span[0]..at + span[1]];
            let tags = &mut self.tags[at + span[0]..at + span[1]];
            for (index, (depth, tag_here)) in depth.iter_mut().zip(tags).enumerate() {
                if let Some(z) = ready.hit(first + step * index as f32)
                    && z > NEAREST_M
                    && z < *depth
                {
                    (*depth, *tag_here) = (z, tag);
                }
            }
        }
    }

    /// Draws where `hit` says that a ray ends, within the columns and rows.
    pub(super) fn draw_where(
        &mut self,
        [columns, rows]: [[usize; 2]; 2],
        tag: u8,
        hit: impl Fn(V3) -> Option<f32>,
    ) {
        for v in rows[0]..rows[1] {
            for u in columns[0]..columns[1] {
                let at = v * self.width + u;
                if let Some(z) = hit(self.ray(u, v))
                    && z > NEAREST_M
                    && z < self.depth[at]
                {
                    (self.depth[at], self.tags[at]) = (z, tag);
                }
            }
        }
    }

    /// Columns and rows (from, to before) that the hull of balls can cover; `None` where it is out of view.
    pub(super) fn extent(&self, balls: &[(V3, f32)]) -> Option<[[usize; 2]; 2]> {
        if balls.iter().all(|(at, radius)| at.z + radius < NEAREST_M) {
            return None;
        }
        let side = |axis: usize, pixels: usize| {
            let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
            for (at, radius) in balls {
                let [l, h] = tangents(at[axis], at.z, *radius);
                (low, high) = (low.min(l), high.max(h));
            }
            let pixel = |tangent: f32| tangent * self.focal[axis] + self.centre[axis];
            let from = pixel(low).floor().clamp(0.0, pixels as f32) as usize;
            let to = (pixel(high) + 1.0).ceil().clamp(0.0, pixels as f32) as usize;
            (from < to).then_some([from, to])
        };
        Some([side(0, self.width)?, side(1, self.height)?])
    }
}

/// Between which tangents (x over z) a circle at (x, z) is seen from the origin; everything if the origin's line along
/// x goes through it or it lies behind.
fn tangents(x: f32, z: f32, radius: f32) -> [f32; 2] {
    let below = z * z - radius * radius;
    if z <= radius || below < 1e-6 {
        return [f32::NEG_INFINITY, f32::INFINITY];
    }
    let root = radius * (x * x + below).max(0.0).sqrt();
    [(x * z - root) / below, (x * z + root) / below]
}
