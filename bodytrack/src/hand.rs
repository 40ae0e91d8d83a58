//! A hand cut out of a depth image for the network that tells open ones from closed ones: at a fixed metric scale, at the image's
//! own resolution, turned so that the forearm comes from below and the thumb of a hand that shows its back is on one side.
//!
//! A crop is [`SIZE`] x [`SIZE`] cells over [`WINDOW_M`] metres about the hand, across the optical axis at its distance. Right hands
//! are mirrored. The training data is made by this same code.
//!
//! Two channels after each other, each row after row:
//! 1. how far behind the hand's middle the surface is, half of [`WINDOW_M`] being 1: -1 for what is before it, 1 for what is behind;
//! 2. how much of the cell is hand, or what is as near; -1 where nobody can tell (no distance, outside of the image).

use posefuse_skeleton::{DepthImage, Intrinsics, Position, Sensor};

use crate::lens::V3;

/// Cells in a row and in a column.
pub const SIZE: usize = 32;
/// Numbers of a cell.
pub const CHANNELS: usize = 2;
/// Side of the cube that is cut out, metres.
pub const WINDOW_M: f64 = 0.25;

const CELL_M: f32 = (WINDOW_M / SIZE as f64) as f32;
const HALF_M: f32 = (WINDOW_M / 2.0) as f32;
/// The tracked hand is moved to the middle of what is seen near it, weighed by a bell of this width, so often.
const NEAR_M: f32 = 0.05;
const MOVES: usize = 3;
/// It stays within this of where it was, metres.
const FAR_M: f32 = 0.10;
/// The middle and the end are found from about so many pixels in a row.
const FOR_MIDDLE: f32 = 14.0;
const FOR_END: f32 = 28.0;
/// Then it is moved along the forearm to this far before the arm's end, metres, if what is within this of the forearm's line ends
/// within this: in front of a trunk it may not.
const BEFORE_END_M: f32 = 0.06;
const ARM_M: f32 = 0.065;
const LONGEST_M: f32 = 0.20;
/// The end is looked for in steps of this, metres.
const STEP_M: f32 = 0.02;
/// With fewer pixels than this to a cell's side a hand has no shape: a palm would be five pixels broad.
const LEAST_SHARP: f32 = 0.45;
/// With less than this of the window's middle measured there is nothing to look at, cells.
const LEAST_CELLS: f32 = 30.0;
/// Most samples in a row of a cell.
const MOST_SAMPLES: f32 = 3.0;

/// Where a hand and its arm are, as tracked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Of the elbow, the wrist and the hand.
    pub joints: [Position<Sensor>; 3],
    /// Whether it is a left one.
    pub is_left: bool,
}

/// A hand that was cut out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandCut {
    /// Its middle.
    pub middle: Position<Sensor>,
    /// How sharply it is seen: pixels to a cell's side.
    pub sharp: f32,
}

/// Cuts a hand out of `image` and appends [`CHANNELS`] x [`SIZE`] x [`SIZE`] numbers to `into`. `None`, and nothing appended,
/// if it is too far away, out of the image, or nothing is measured there.
pub fn cut(
    image: &DepthImage,
    camera: &Intrinsics,
    arm: &Arm,
    into: &mut Vec<f32>,
) -> Option<HandCut> {
    let eye = Eye { image, camera };
    let [elbow, wrist, hand] = arm.joints.map(|joint| joint.vector().cast::<f32>());
    let middle = eye.middle(hand)?;
    let middle = eye.before_the_end(middle, hand - elbow);
    let sharp = camera.fx as f32 / middle.z * CELL_M;
    if sharp < LEAST_SHARP {
        return None;
    }
    let [right, down] = axes(&elbow, &wrist, &hand, arm.is_left);
    let start = into.len();
    into.resize(start + CHANNELS * SIZE * SIZE, 0.0);
    let (depths, seen) = into[start..].split_at_mut(SIZE * SIZE);
    let samples = sharp.round().clamp(1.0, MOST_SAMPLES) as usize;
    let mut held = 0.0;
    for cell in 0..SIZE * SIZE {
        let corner = [(cell % SIZE) as f32, (cell / SIZE) as f32];
        let tally = eye.cell(&middle, corner, [right, down], samples);
        (depths[cell], seen[cell]) = tally.numbers(samples);
        held += seen[cell].max(0.0);
    }
    if held < LEAST_CELLS {
        into.truncate(start);
        return None;
    }
    Some(HandCut {
        middle: Position::from_vector(middle.cast()),
        sharp,
    })
}

/// The crop's axes to the right and down, in the image.
fn axes(elbow: &V3, wrist: &V3, hand: &V3, is_left: bool) -> [[f32; 2]; 2] {
    // An arm that points at the sensor has its direction from whatever is left of it.
    let ways = [wrist - elbow, hand - elbow, hand - wrist];
    let flat = |way: &V3| way.xy().norm();
    let way = ways.iter().max_by(|a, b| flat(a).total_cmp(&flat(b)));
    let up = way.and_then(|way| way.xy().try_normalize(1e-3));
    let [x, y] = up.map_or([0.0, -1.0], |up| [up.x, up.y]);
    let mirror = if is_left { 1.0 } else { -1.0 };
    [[-y * mirror, x * mirror], [-x, -y]]
}

struct Eye<'a> {
    image: &'a DepthImage,
    camera: &'a Intrinsics,
}

impl Eye<'_> {
    /// The distance at a pixel, metres; `None` outside of the image or where there is none.
    fn at(&self, u: f32, v: f32) -> Option<f32> {
        let (width, height) = (self.image.width as usize, self.image.height as usize);
        if !(u >= -0.5 && v >= -0.5) {
            return None;
        }
        let (u, v) = ((u + 0.5) as usize, (v + 0.5) as usize);
        if u >= width || v >= height {
            return None;
        }
        let mm = self.image.millimetres.get(v * width + u).copied()?;
        (mm > 0).then(|| f32::from(mm) * 1e-3)
    }

    fn pixel(&self, at: &V3) -> [f32; 2] {
        let camera = self.camera;
        [
            at.x / at.z * camera.fx as f32 + camera.cx as f32,
            at.y / at.z * camera.fy as f32 + camera.cy as f32,
        ]
    }

    /// Mean shift (Fukunaga and Hostetler 1975) from where the hand is tracked to what is seen there.
    fn middle(&self, hand: V3) -> Option<V3> {
        let mut middle = hand;
        for _ in 0..MOVES {
            if middle.z < 0.2 {
                return None;
            }
            let (mut sum, mut weights) = (V3::zeros(), 0.0);
            self.around(&middle, 2.0 * NEAR_M, FOR_MIDDLE, |point| {
                let far = (point - middle).norm_squared() / (2.0 * NEAR_M * NEAR_M);
                if far < 6.0 {
                    let weight = (-far).exp();
                    sum += point * weight;
                    weights += weight;
                }
            });
            if weights < 1e-3 {
                return None;
            }
            middle = sum / weights;
            let off = middle - hand;
            middle = hand + off * (FAR_M / off.norm().max(FAR_M));
        }
        Some(middle)
    }

    /// `middle` moved along the forearm (direction `along`) until the arm ends as far behind it as a hand does.
    fn before_the_end(&self, middle: V3, along: V3) -> V3 {
        const STEPS: usize = (LONGEST_M / STEP_M) as usize;
        let Some(along) = along.try_normalize(1e-3) else {
            return middle;
        };
        let mut held = [false; STEPS];
        self.around(&middle, LONGEST_M, FOR_END, |point| {
            let off = point - middle;
            let far = off.dot(&along);
            if far >= 0.0 && (off - along * far).norm_squared() < ARM_M * ARM_M {
                let step = (far / STEP_M) as usize;
                held.iter_mut()
                    .skip(step)
                    .take(1)
                    .for_each(|held| *held = true);
            }
        });
        // A step without a point may lie between two rows of pixels; two do not.
        let ends = (0..STEPS).find(|&step| !held[step] && !held.get(step + 1).is_some_and(|h| *h));
        match ends {
            Some(step) => middle + along * (step as f32 * STEP_M - BEFORE_END_M),
            None => middle,
        }
    }

    /// Points that are seen within a square about a place, whose side is `reach` each way, metres.
    fn around(&self, middle: &V3, reach: f32, pixels: f32, mut take: impl FnMut(V3)) {
        let camera = self.camera;
        let [u, v] = self.pixel(middle);
        let reach = reach * camera.fx as f32 / middle.z;
        let step = (2.0 * reach / pixels).max(1.0);
        let half = (reach / step) as i32;
        for row in -half..=half {
            for column in -half..=half {
                let at = [u + column as f32 * step, v + row as f32 * step];
                if let Some(z) = self.at(at[0], at[1]) {
                    take(V3::new(
                        (at[0] - camera.cx as f32) / camera.fx as f32 * z,
                        (at[1] - camera.cy as f32) / camera.fy as f32 * z,
                        z,
                    ));
                }
            }
        }
    }

    /// What is seen in the cell whose corner is so many cells from the crop's.
    fn cell(
        &self,
        middle: &V3,
        corner: [f32; 2],
        [right, down]: [[f32; 2]; 2],
        samples: usize,
    ) -> Tally {
        let mut tally = Tally::default();
        for sample in 0..samples * samples {
            let within = [sample % samples, sample / samples];
            let [x, y] = [0, 1].map(|axis| {
                let part = (within[axis] as f32 + 0.5) / samples as f32;
                (corner[axis] + part - SIZE as f32 / 2.0) * CELL_M
            });
            let off = V3::new(x * right[0] + y * down[0], x * right[1] + y * down[1], 0.0);
            let [u, v] = self.pixel(&(middle + off));
            match self.at(u, v).map(|z| z - middle.z) {
                None => tally.unknown += 1,
                Some(behind) if behind > HALF_M => tally.behind += 1,
                Some(behind) if behind < -HALF_M => tally.before += 1,
                Some(behind) => {
                    tally.held += 1;
                    tally.sum += behind;
                }
            }
        }
        tally
    }
}

/// The samples of a cell.
#[derive(Default)]
struct Tally {
    held: u32,
    sum: f32,
    behind: u32,
    before: u32,
    unknown: u32,
}

impl Tally {
    fn numbers(&self, samples: usize) -> (f32, f32) {
        let all = (samples * samples) as f32;
        if self.held > 0 {
            let depth = self.sum / self.held as f32 / HALF_M;
            return (depth, self.held as f32 / all);
        }
        let depth = if self.before > self.behind { -1.0 } else { 1.0 };
        match self.before + self.behind {
            0 => (1.0, -1.0),
            _ => (depth, 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    /// An arm that comes from the lower left, with a thumb to the left of its end, before nothing: `z` metres away.
    fn image(width: u32, z: f64, right_hand: bool) -> (DepthImage, Intrinsics, Arm) {
        let camera = Intrinsics::from_view(width, width * 3 / 4, 1.0, 0.77);
        let mut image = DepthImage::empty(camera.width, camera.height);
        let mirror = if right_hand { -1.0 } else { 1.0 };
        for v in 0..camera.height {
            for u in 0..camera.width {
                let at = camera.point(f64::from(u), f64::from(v), z).vector();
                let (along, aside) = along_and_aside(at.x * mirror, at.y);
                let arm = (-0.4..0.08).contains(&along) && aside.abs() < 0.04;
                let thumb = (-0.02..0.02).contains(&along) && (-0.09..0.0).contains(&aside);
                if arm || thumb {
                    image.millimetres[(v * camera.width + u) as usize] = (z * 1e3) as u16;
                }
            }
        }
        let place = |along: f64| {
            let half = std::f64::consts::FRAC_1_SQRT_2;
            Position::new(along * half * mirror, -along * half, z)
        };
        let arm = Arm {
            joints: [place(-0.3), place(-0.08), place(0.03)],
            is_left: !right_hand,
        };
        (image, camera, arm)
    }

    /// Along an arm that points to the upper right, and across it to the right.
    fn along_and_aside(x: f64, y: f64) -> (f64, f64) {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        ((x - y) * half, (x + y) * half)
    }

    fn held(crop: &[f32], [x, y]: [f64; 2]) -> bool {
        let cell = |metres: f64| ((metres / WINDOW_M + 0.5) * SIZE as f64) as usize;
        crop[SIZE * SIZE + cell(y) * SIZE + cell(x)] > 0.5
    }

    #[test]
    fn a_hand_looks_the_same_left_and_right_near_and_far_with_few_and_many_pixels() {
        for (width, z) in [(320, 1.0), (320, 2.0), (640, 1.0), (640, 3.0)] {
            for right_hand in [false, true] {
                let (image, camera, arm) = image(width, z, right_hand);
                let mut crop = Vec::new();
                let found = cut(&image, &camera, &arm, &mut crop).unwrap();
                assert_eq!(crop.len(), CHANNELS * SIZE * SIZE);
                let off = found.middle.vector() - Vector3::new(0.0, 0.0, z);
                assert!(off.norm() < 0.05, "{off}");
                // The arm comes from below and ends 6 cm above the middle.
                assert!(held(&crop, [0.0, 0.11]) && held(&crop, [0.0, -0.03]));
                assert!(!held(&crop, [0.0, -0.10]), "{width} {z}");
                let beside = [-0.06, 0.06].map(|x| {
                    let rows =
                        (0..8).filter(|row| held(&crop, [x, -0.02 + 0.01 * f64::from(*row)]));
                    rows.count()
                });
                assert!(beside[0] >= 2 && beside[1] == 0, "{beside:?}: {width} {z}");
            }
        }
    }

    #[test]
    fn what_is_too_far_or_not_measured_is_no_hand() {
        let (there, camera, arm) = image(160, 3.5, false);
        let mut crop = Vec::new();
        assert_eq!(cut(&there, &camera, &arm, &mut crop), None);
        let (_, camera, arm) = image(320, 1.0, false);
        let nothing = DepthImage::empty(320, 240);
        assert_eq!(cut(&nothing, &camera, &arm, &mut crop), None);
        assert!(crop.is_empty());
        let behind = arm.joints.map(|at| Position::from_vector(-at.vector()));
        let behind = Arm {
            joints: behind,
            ..arm
        };
        let (there, ..) = image(320, 1.0, false);
        assert_eq!(cut(&there, &camera, &behind, &mut crop), None);
    }
}
