//! What stood there before anybody came: for each pixel the furthest distance that was seen for long enough, and which
//! surfaces are alive.
//!
//! A pixel's background is learned while nothing moves there, at once where one sees further than before, and never
//! where a person is followed. A person breathes and sways: the mean distance of a patch of clothes
//! moves by millimetres within a second or two, that of a chair does not.

use crate::lens::{Lens, sigma_m};

/// Time is counted in steps of this, ns.
const TICK_NS: i64 = 33_000_000;
/// How long a distance stays to be the background, ticks: where nothing was known, where it lies before what was known, and
/// where it lies behind.
const NEW_TICKS: u8 = 15;
const NEARER_TICKS: u8 = 60;
const FURTHER_TICKS: u8 = 2;
/// What has been somewhere for a shorter time has just moved, ticks.
const FRESH_TICKS: u8 = 5;
/// Side of a patch, pixels.
pub(crate) const PATCH: usize = 8;
/// How many of a patch's pixels must have a distance, and how deep it may be, mm.
const PATCH_LEAST: u32 = 54;
const PATCH_DEPTH_MM: u16 = 200;
/// A patch moved if its mean did by this, metres, and so many times the spread of a distance.
const MOVED_M: f32 = 0.008;
const MOVED_SIGMAS: f32 = 0.35;
/// How fast its mean follows, per image, and after how many images it is held against later ones.
const FOLLOWS: f32 = 0.25;
const SETTLED: u8 = 6;

/// Everything learned, pixel by pixel.
pub(crate) struct Background {
    /// The background, mm; 0: not known.
    far: Vec<u16>,
    /// What is seen now, smoothed, mm.
    now: Vec<u16>,
    /// For how long, ticks.
    stays: Vec<u8>,
    patches: Vec<Patch>,
    patches_wide: usize,
    last_ns: Option<i64>,
}

#[derive(Clone, Copy, Default)]
struct Patch {
    /// Smoothed mean distance, metres; 0: not one surface.
    mean: f32,
    /// The same when it had settled.
    anchor: f32,
    /// Images since it became one surface, up to [`SETTLED`].
    age: u8,
}

impl Background {
    pub(crate) fn new(lens: &Lens) -> Self {
        let pixels = lens.width * lens.height;
        let (wide, high) = (lens.width / PATCH, lens.height / PATCH);
        Self {
            far: vec![0; pixels],
            now: vec![0; pixels],
            stays: vec![0; pixels],
            patches: vec![Patch::default(); wide * high],
            patches_wide: wide,
            last_ns: None,
        }
    }

    /// Whether something stands before the background at this pixel; `None`: the background is not known.
    pub(crate) fn is_before(&self, lens: &Lens, index: usize, mm: u16) -> Option<bool> {
        let far = self.far[index];
        (far > 0).then(|| mm < far.saturating_sub(lens.apart_mm(far)))
    }

    /// Takes in an image. Where `owners` is not 0, a person is.
    pub(crate) fn learn(&mut self, lens: &Lens, depth: &[u16], owners: &[u8], at_ns: i64) {
        let since_ns = self
            .last_ns
            .map_or(TICK_NS, |last| at_ns.saturating_sub(last));
        self.last_ns = Some(at_ns);
        let ticks = ((since_ns + TICK_NS / 2) / TICK_NS).clamp(1, 30) as u8;
        for (index, &mm) in depth.iter().enumerate() {
            if mm == 0 {
                continue;
            }
            let (now, far) = (self.now[index], self.far[index]);
            if now.abs_diff(mm) > lens.apart_mm(mm) {
                (self.now[index], self.stays[index]) = (mm, 0);
                continue;
            }
            let followed = i32::from(now) + (i32::from(mm) - i32::from(now)) / 4;
            self.now[index] = followed as u16;
            self.stays[index] = self.stays[index].saturating_add(ticks);
            let apart = lens.apart_mm(far.max(1));
            let needs = if far > 0 && mm > far.saturating_add(apart) {
                FURTHER_TICKS
            } else if owners[index] > 0 {
                continue;
            } else if far == 0 {
                NEW_TICKS
            } else if mm < far.saturating_sub(apart) {
                NEARER_TICKS
            } else {
                NEW_TICKS
            };
            if self.stays[index] >= needs {
                self.far[index] = self.now[index];
            }
        }
    }

    /// Makes what is seen now the background at the pixels that `is_one` says.
    pub(crate) fn absorb(&mut self, is_one: impl Fn(usize) -> bool) {
        for index in 0..self.far.len() {
            if self.now[index] > 0 && is_one(index) {
                self.far[index] = self.now[index];
            }
        }
    }

    /// Looks at each patch of the image.
    pub(crate) fn look(&mut self, lens: &Lens, depth: &[u16]) {
        for (number, patch) in self.patches.iter_mut().enumerate() {
            let (column, row) = (number % self.patches_wide, number / self.patches_wide);
            let first = row * PATCH * lens.width + column * PATCH;
            let mean = (0..PATCH).map(|line| &depth[first + line * lens.width..][..PATCH]);
            patch.take(patch_mean(mean));
        }
    }

    /// How many patches are (mostly) of the owner `number`, and how many of these moved.
    pub(crate) fn alive(&self, lens: &Lens, owners: &[u8], number: u8) -> [u32; 2] {
        let mut counts = [0; 2];
        for (place, patch) in self.patches.iter().enumerate() {
            if patch.mean == 0.0 {
                continue;
            }
            let (column, row) = (place % self.patches_wide, place / self.patches_wide);
            let first = row * PATCH * lens.width + column * PATCH;
            // Four pixels are enough to see whose it is.
            let quarter = PATCH / 4;
            let at = |u: usize, v: usize| first + v * lens.width + u;
            let (near, far) = (quarter, PATCH - 1 - quarter);
            let probes = [at(near, near), at(far, near), at(near, far), at(far, far)];
            if probes.iter().all(|&pixel| owners[pixel] == number) {
                let fresh = probes
                    .iter()
                    .filter(|&&pixel| self.stays[pixel] < FRESH_TICKS);
                counts[0] += 1;
                counts[1] += u32::from(patch.moved() || fresh.count() >= 2);
            }
        }
        counts
    }
}

/// The mean of a patch, metres; 0 if it is not one surface.
fn patch_mean<'a>(lines: impl Iterator<Item = &'a [u16]>) -> f32 {
    let (mut count, mut sum, mut least, mut most) = (0u32, 0u32, u16::MAX, 0u16);
    for &mm in lines.flatten() {
        if mm > 0 {
            count += 1;
            sum += u32::from(mm);
            least = least.min(mm);
            most = most.max(mm);
        }
    }
    if count < PATCH_LEAST || most - least > PATCH_DEPTH_MM {
        return 0.0;
    }
    sum as f32 / count as f32 * 1e-3
}

impl Patch {
    fn take(&mut self, mean: f32) {
        if mean == 0.0 {
            *self = Self::default();
            return;
        }
        if self.age == 0 {
            (self.mean, self.anchor, self.age) = (mean, mean, 1);
            return;
        }
        self.mean += FOLLOWS * (mean - self.mean);
        if self.age < SETTLED {
            self.age += 1;
            self.anchor = self.mean;
        }
    }

    fn moved(&self) -> bool {
        let by = (self.mean - self.anchor).abs();
        by > MOVED_M + MOVED_SIGMAS * sigma_m(self.mean)
    }
}
