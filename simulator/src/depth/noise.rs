//! What a depth sensor makes of exact distances.
//!
//! Spread along and across the ray as Nguyen, Izadi and Lovell (2012) measured it on Kinect v1; steps of an eighth of a
//! pixel of disparity; nothing where the light's projector cannot shine (beside what is nearer), at grazing angles, on dark
//! hair and out of range.

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::canvas::{Canvas, HAIR};
use crate::random::scrambled;

/// A depth sensor's errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthNoise {
    /// Spread along the ray against that of Kinect v1: 1 is 0.0012 + 0.0019 (z - 0.4)^2 metres and more at an angle.
    pub along: f64,
    /// Spread across the ray, pixels of an image 640 wide (Kinect v1: 0.8).
    pub across_px: f64,
    /// From the camera to the projector of structured light, metres to the right; it makes shadows and steps. 0: the
    /// sensor measures time of flight.
    pub baseline_m: f64,
    /// How likely pixels are lost at grazing angles, at edges and on hair: 1 as usual, 0 never.
    pub holes: f64,
    /// Nearest and furthest distance that is measured, metres.
    pub range_m: [f64; 2],
}

impl Default for DepthNoise {
    fn default() -> Self {
        Self::structured_light()
    }
}

impl DepthNoise {
    /// Kinect v1, Xtion, Astra.
    pub fn structured_light() -> Self {
        Self {
            along: 1.0,
            across_px: 0.8,
            baseline_m: 0.075,
            holes: 1.0,
            range_m: [0.5, 8.0],
        }
    }

    /// Kinect v2, Azure Kinect, Femto.
    pub fn time_of_flight() -> Self {
        Self {
            along: 0.5,
            across_px: 0.5,
            baseline_m: 0.0,
            holes: 0.6,
            range_m: [0.4, 5.5],
        }
    }

    /// Exact distances.
    pub fn none() -> Self {
        Self {
            along: 0.0,
            across_px: 0.0,
            baseline_m: 0.0,
            holes: 0.0,
            range_m: [0.05, 60.0],
        }
    }
}

/// Share of pixels that are lost for no reason.
const SPECKLES: f32 = 0.001;
/// Tangents of the angle to the ray at which pixels begin to be lost, and at which none is left.
const GRAZING: [f32; 2] = [2.5, 7.0];
/// Neighbours further from each other than this share of their distance are an edge.
const EDGE_SHARE: f32 = 0.04;
/// How many pixels at an edge are lost.
const LOST_AT_EDGES: f32 = 0.25;
/// How much of the spread along the ray neighbouring pixels have in common, and how much is each pixel's own (squares
/// sum to 1): sensors match blocks.
const IN_COMMON: f32 = 0.775;
const OWN: f32 = 0.632;
/// Steps in a pixel of disparity, in an image 640 wide.
const STEPS: f32 = 8.0;

/// Millimetres as the sensor gives them. `hair_holes`: for each owner what share of their hair is lost.
pub(super) fn measured(
    canvas: &Canvas,
    noise: &DepthNoise,
    hair_holes: &[f32],
    seed: u64,
) -> Vec<u16> {
    let mut millimetres = vec![0; canvas.depth.len()];
    let sensor = Measuring::new(canvas, noise, hair_holes, seed);
    let mut shadow = vec![false; canvas.width];
    for (v, row) in millimetres.chunks_exact_mut(canvas.width).enumerate() {
        sensor.shadows(v, &mut shadow);
        let luck = Luck::of_row(sensor.seed, v);
        for (u, here) in row.iter_mut().enumerate() {
            if !shadow[u] {
                *here = sensor.pixel(u, v, &luck);
            }
        }
    }
    millimetres
}

struct Measuring<'a> {
    canvas: &'a Canvas,
    hair_holes: &'a [f32],
    seed: u64,
    along: f32,
    across: f32,
    holes: f32,
    /// Pixels (of this image) times metres: disparity is this over the distance.
    disparity: f32,
    steps: f32,
    range: [f32; 2],
}

impl<'a> Measuring<'a> {
    fn new(canvas: &'a Canvas, noise: &DepthNoise, hair_holes: &'a [f32], seed: u64) -> Self {
        let wide = canvas.width as f32 / 640.0;
        Self {
            canvas,
            hair_holes,
            seed: scrambled(seed),
            along: noise.along as f32,
            across: noise.across_px as f32 * wide,
            holes: noise.holes as f32,
            disparity: canvas.focal[0] * noise.baseline_m as f32,
            steps: STEPS / wide,
            range: noise.range_m.map(|range| range as f32),
        }
    }

    /// Where row `v` gets no light: what the projector sees in the other order is behind something.
    fn shadows(&self, v: usize, shadow: &mut [bool]) {
        shadow.fill(false);
        if self.disparity == 0.0 {
            return;
        }
        let row = &self.canvas.depth[v * self.canvas.width..][..self.canvas.width];
        let last = row.len() - 1;
        let mut furthest = f32::INFINITY;
        for step in 0..row.len() {
            // From the projector's side; mirrored if it is on the left.
            let u = if self.disparity > 0.0 {
                last - step
            } else {
                step
            };
            let sees = u as f32 - self.disparity / row[u];
            let sees = if self.disparity > 0.0 { sees } else { -sees };
            shadow[u] = sees > furthest + 0.5;
            furthest = furthest.min(sees);
        }
    }

    fn pixel(&self, u: usize, v: usize, luck: &Luck) -> u16 {
        if self.canvas.depth[v * self.canvas.width + u] == f32::INFINITY {
            return 0;
        }
        let across = [luck.normal(RIGHT, u), luck.normal(DOWN, u)].map(|n| n * self.across);
        let (common, own) = (luck.normal(COMMON, u / 2), luck.normal(ALONE, u));
        let chance = luck.unit(u);
        let u = shifted(u, across[0], self.canvas.width);
        let v = shifted(v, across[1], self.canvas.height);
        let at = v * self.canvas.width + u;
        let z = self.canvas.depth[at];
        if !(self.range[0]..=self.range[1]).contains(&z) {
            return 0;
        }
        let (slope2, edge) = self.slope(u, v, z);
        if self.is_lost(chance, at, slope2, edge, (u, v)) {
            return 0;
        }
        let off = common * IN_COMMON + own * OWN;
        let z = self.stepped(z + self.along * spread(z, slope2) * off);
        if !(self.range[0]..=self.range[1]).contains(&z) {
            return 0;
        }
        (z * 1000.0 + 0.5).clamp(1.0, 65_535.0) as u16
    }

    /// Squared tangent of the angle between surface normal and optical axis, and whether a neighbour is far behind or before.
    fn slope(&self, u: usize, v: usize, z: f32) -> (f32, bool) {
        let (width, depth) = (self.canvas.width, &self.canvas.depth);
        let at = v * width + u;
        let left = if u > 0 { depth[at - 1] } else { z };
        let right = if u + 1 < width { depth[at + 1] } else { z };
        let above = if v > 0 { depth[at - width] } else { z };
        let below = if v + 1 < self.canvas.height {
            depth[at + width]
        } else {
            z
        };
        let edge = [left, right, above, below]
            .iter()
            .any(|near| (near - z).abs() > EDGE_SHARE * z);
        // At an edge the flatter side tells how the surface lies.
        let flatter = |a: f32, b: f32| (a - z).abs().min((b - z).abs()).min(z);
        let x = flatter(left, right) * self.canvas.focal[0];
        let y = flatter(above, below) * self.canvas.focal[1];
        ((x * x + y * y) / (z * z), edge)
    }

    fn is_lost(&self, chance: f32, at: usize, slope2: f32, edge: bool, uv: (usize, usize)) -> bool {
        if self.holes == 0.0 {
            return false;
        }
        let [begin, end] = GRAZING.map(|tangent| tangent * tangent);
        let steep = ((slope2 - begin) / (end - begin)).clamp(0.0, 1.0);
        let mut lost = SPECKLES + steep + if edge { LOST_AT_EDGES } else { 0.0 };
        let tag = self.canvas.tags[at];
        if tag & HAIR != 0 {
            // In tufts that stay where they are, not pixel by pixel.
            let tuft =
                scrambled(u64::from(tag) << 40 ^ ((uv.1 / 3) as u64) << 20 ^ (uv.0 / 3) as u64);
            let share = self.hair_holes.get(usize::from(tag & !HAIR)).copied();
            let share = share.unwrap_or(0.0);
            let thin = if unit(tuft as u32) < share {
                0.9
            } else {
                0.1 * share
            };
            lost += thin;
        }
        chance < lost * self.holes
    }

    fn stepped(&self, z: f32) -> f32 {
        if self.disparity == 0.0 || z <= 0.0 {
            return z;
        }
        let by = self.disparity.abs() * self.steps;
        by / ((by / z + 0.5) as u32).max(1) as f32
    }
}

/// Spread along the ray at distance `z` on a surface whose normal is at the angle with this tangent, metres. Nguyen's ratio
/// of the angle to what is left to 90 degrees is nearly the tangent; his factor 1e-4 / sqrt(z) is taken for 2 m.
fn spread(z: f32, squared_tangent: f32) -> f32 {
    let flat = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
    flat + 7e-5 * squared_tangent.min(400.0)
}

fn shifted(at: usize, by: f32, count: usize) -> usize {
    ((at as f32 + by + 0.5).max(0.0) as usize).min(count - 1)
}

fn unit(random: u32) -> f32 {
    (random >> 8) as f32 / (1u32 << 24) as f32
}

/// Which of a row's streams of random numbers.
const RIGHT: usize = 0;
const DOWN: usize = 1;
const ALONE: usize = 2;
const COMMON: usize = 3;
const CHANCE: usize = 4;

/// The random numbers of one row of one image: stretches of two tables, from places that the seed chooses. A number of its
/// own for each pixel would cost more than all the rest.
struct Luck {
    starts: [usize; 5],
    tables: &'static Tables,
}

struct Tables {
    normal: Vec<f32>,
    unit: Vec<f32>,
}

/// A power of two; far longer than a row, small enough for the processor's memory of recent things.
const TABLE: usize = 1 << 14;

impl Luck {
    fn of_row(seed: u64, row: usize) -> Self {
        static TABLES: OnceLock<Tables> = OnceLock::new();
        let start = |stream: usize| {
            // Blocks that have noise in common are two rows high.
            let row = if stream == COMMON { row / 2 } else { row };
            scrambled(seed ^ (stream as u64) << 40 ^ row as u64) as usize
        };
        Self {
            starts: std::array::from_fn(start),
            tables: TABLES.get_or_init(Tables::new),
        }
    }

    fn normal(&self, stream: usize, index: usize) -> f32 {
        self.tables.normal[self.starts[stream].wrapping_add(index) % TABLE]
    }

    fn unit(&self, index: usize) -> f32 {
        self.tables.unit[self.starts[CHANCE].wrapping_add(index) % TABLE]
    }
}

impl Tables {
    fn new() -> Self {
        let random = |index: usize, salt: u64| scrambled(salt << 32 | index as u64);
        // Twelve uniform numbers less their mean have spread 1.
        let normal = |index: usize| {
            let parts = (0..12).map(|part| unit(random(index, 1 + part) as u32));
            parts.sum::<f32>() - 6.0
        };
        Self {
            normal: (0..TABLE).map(normal).collect(),
            unit: (0..TABLE).map(|i| unit(random(i, 99) as u32)).collect(),
        }
    }
}
