//! Surfaces: pixels before the background that hang together.

use crate::background::Background;
use crate::floor::Level;
use crate::lens::{Lens, V3};

/// Every so many pixels and rows a point of a surface is kept.
pub(crate) const STRIDE: usize = 6;
/// A surface of fewer pixels is noise.
const LEAST_PIXELS: u32 = 14;
/// Where the background is not known, what is lower than this is floor, metres.
const FLOOR_M: f32 = 0.04;
const FLOOR_SIGMAS: f32 = 1.5;

/// A surface.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    /// Of its surface across the rays, square metres.
    pub(crate) area_m2: f32,
    /// Its samples.
    pub(crate) samples: std::ops::Range<usize>,
    /// Least and greatest column and row.
    pub(crate) columns: [u16; 2],
    pub(crate) rows: [u16; 2],
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) segment: u32,
    pub(crate) at: V3,
    /// What it stands for, square metres.
    pub(crate) area_m2: f32,
}

/// All surfaces of an image. Kept from image to image for its memory.
#[derive(Default)]
pub(crate) struct Segments {
    /// For each pixel the number of its surface from 1 on; 0: none.
    pub(crate) labels: Vec<u32>,
    pub(crate) segments: Vec<Segment>,
    /// In the order of the segments.
    pub(crate) samples: Vec<Sample>,
    parents: Vec<u32>,
    numbers: Vec<u32>,
    loose: Vec<Sample>,
}

impl Segments {
    /// Finds the surfaces of an image.
    pub(crate) fn find(&mut self, lens: &Lens, level: &Level, back: &Background, depth: &[u16]) {
        self.mark(lens, level, back, depth);
        self.join(lens, depth);
        self.measure(lens, depth);
        self.sample(lens, depth);
    }

    /// Labels 1 for what stands before the background.
    fn mark(&mut self, lens: &Lens, level: &Level, back: &Background, depth: &[u16]) {
        self.labels.clear();
        self.labels.resize(depth.len(), 0);
        for (index, &mm) in depth.iter().enumerate() {
            if mm == 0 {
                continue;
            }
            let before = back.is_before(lens, index, mm).unwrap_or_else(|| {
                let point = lens.point(index, mm);
                let floor = FLOOR_M + FLOOR_SIGMAS * crate::lens::sigma_m(point.z);
                level.height_m(&point).is_none_or(|height| height > floor)
            });
            self.labels[index] = u32::from(before);
        }
    }

    /// Replaces the labels by numbers of surfaces, some of which are the same by `parents`.
    fn join(&mut self, lens: &Lens, depth: &[u16]) {
        let width = lens.width;
        self.parents.clear();
        self.parents.push(0);
        for index in 0..depth.len() {
            if self.labels[index] == 0 {
                continue;
            }
            let (mm, column) = (depth[index], index % width);
            let joined = lens.joined_mm(mm);
            let mut label = 0;
            // Over one pixel without distance, too: hair and edges are full of them.
            let left = (column > 0).then(|| index - 1);
            let left = left.map(|one| {
                if depth[one] == 0 && column > 1 {
                    one - 1
                } else {
                    one
                }
            });
            let above = index.checked_sub(width);
            let above = above.map(|one| match (depth[one], one.checked_sub(width)) {
                (0, Some(two)) => two,
                _ => one,
            });
            for near in [left, above].into_iter().flatten() {
                if self.labels[near] == 0 || depth[near].abs_diff(mm) > joined {
                    continue;
                }
                let other = root(&mut self.parents, self.labels[near]);
                if label == 0 {
                    label = other;
                } else if other != label {
                    let (low, high) = (other.min(label), other.max(label));
                    self.parents[high as usize] = low;
                    label = low;
                }
            }
            if label == 0 {
                label = self.parents.len() as u32;
                self.parents.push(label);
            }
            self.labels[index] = label;
        }
    }

    /// Numbers the surfaces that are large enough from 1 on and measures them.
    fn measure(&mut self, lens: &Lens, depth: &[u16]) {
        self.numbers.clear();
        self.numbers.resize(self.parents.len(), 0);
        for label in &mut self.labels {
            if *label > 0 {
                *label = root(&mut self.parents, *label);
                self.numbers[*label as usize] += 1;
            }
        }
        self.segments.clear();
        for count in &mut self.numbers {
            let pixels = *count;
            *count = 0;
            if pixels >= LEAST_PIXELS {
                self.segments.push(Segment {
                    area_m2: 0.0,
                    samples: 0..0,
                    columns: [u16::MAX, 0],
                    rows: [u16::MAX, 0],
                });
                *count = self.segments.len() as u32;
            }
        }
        for (index, label) in self.labels.iter_mut().enumerate() {
            if *label == 0 {
                continue;
            }
            *label = self.numbers[*label as usize];
            if *label > 0 {
                let segment = &mut self.segments[*label as usize - 1];
                let at = ((index % lens.width) as u16, (index / lens.width) as u16);
                segment.area_m2 += lens.area_m2(depth[index]);
                segment.columns = [segment.columns[0].min(at.0), segment.columns[1].max(at.0)];
                segment.rows = [segment.rows[0].min(at.1), segment.rows[1].max(at.1)];
            }
        }
    }

    /// Keeps a grid of points, and one of each surface that the grid misses.
    fn sample(&mut self, lens: &Lens, depth: &[u16]) {
        self.loose.clear();
        self.numbers.clear();
        self.numbers.resize(self.segments.len(), 0);
        for v in (STRIDE / 2..lens.height).step_by(STRIDE) {
            for u in (STRIDE / 2..lens.width).step_by(STRIDE) {
                self.keep(lens, depth, v * lens.width + u);
            }
        }
        for number in 0..self.segments.len() {
            if self.numbers[number] == 0 {
                let row = usize::from(self.segments[number].rows[0]);
                let mut pixels = row * lens.width..self.labels.len();
                let first = pixels.find(|&pixel| self.labels[pixel] == number as u32 + 1);
                first
                    .into_iter()
                    .for_each(|pixel| self.keep(lens, depth, pixel));
            }
        }
        // By counting: where each segment's samples begin.
        let mut start = 0;
        for (segment, count) in self.segments.iter_mut().zip(&mut self.numbers) {
            segment.samples = start..start + *count as usize;
            start += std::mem::replace(count, start as u32) as usize;
        }
        self.samples.clear();
        let Some(any) = self.loose.first() else {
            return;
        };
        self.samples.resize(self.loose.len(), *any);
        for sample in &self.loose {
            let place = &mut self.numbers[sample.segment as usize];
            let segment = &self.segments[sample.segment as usize];
            self.samples[*place as usize] = Sample {
                area_m2: segment.area_m2 / segment.samples.len() as f32,
                ..*sample
            };
            *place += 1;
        }
    }

    fn keep(&mut self, lens: &Lens, depth: &[u16], pixel: usize) {
        let label = self.labels[pixel];
        if label > 0 {
            self.numbers[label as usize - 1] += 1;
            self.loose.push(Sample {
                segment: label - 1,
                at: lens.point(pixel, depth[pixel]),
                area_m2: 0.0,
            });
        }
    }
}

fn root(parents: &mut [u32], mut label: u32) -> u32 {
    while parents[label as usize] != label {
        let parent = parents[label as usize];
        parents[label as usize] = parents[parent as usize];
        label = parent;
    }
    label
}
