//! What is seen of somebody and what the network says of them, in numbers.

use posefuse_skeleton::Joint;

use crate::confidence::confidence;
use crate::estimate::Estimate;
use crate::flesh::Flesh;
use crate::lens::V3;
use crate::segments::{Sample, Segments};
use crate::sight::Extent;

/// A surface nearer than this to the flesh around the joints is explained by them, metres; this share of it must be.
const NEAR_M: f32 = 0.15;
const LEAST_NEAR: f64 = 0.7;

/// Of a person the network knows at least so many joints so surely.
const SURE: f32 = 0.6;
const SURE_JOINTS: usize = 6;
/// Who does not move is a person only if it knows so many so surely, image after image. Of things (chairs and cabinets are the
/// likest) it knows fewer; of people in view nearly all.
const CONVINCED: f32 = 0.9;
const CONVINCING_JOINTS: usize = 18;

/// The box of pixels around a person's surfaces, how large these are, and their middle; `None` if there is nothing.
pub(crate) fn measured<'a>(
    segments: &Segments,
    samples: impl Iterator<Item = &'a Sample>,
) -> Option<(Extent, f32, V3)> {
    let (mut area_m2, mut middle) = (0.0, V3::zeros());
    let [mut columns, mut rows] = [[u16::MAX, 0]; 2];
    let mut last = None;
    for sample in samples {
        area_m2 += sample.area_m2;
        middle += sample.at * sample.area_m2;
        if last != Some(sample.segment) {
            last = Some(sample.segment);
            let segment = &segments.segments[sample.segment as usize];
            columns = [
                columns[0].min(segment.columns[0]),
                columns[1].max(segment.columns[1]),
            ];
            rows = [rows[0].min(segment.rows[0]), rows[1].max(segment.rows[1])];
        }
    }
    let extent = [columns, rows].map(|[from, to]| [usize::from(from), usize::from(to) + 1]);
    (area_m2 > 0.0).then(|| (extent, area_m2, middle / area_m2))
}

/// Whether the person's surface is where the joints are: what does not fit is no person, or the network does not know better.
pub(crate) fn fits<'a>(found: &Estimate, points: impl Iterator<Item = &'a Sample>) -> bool {
    let mut flesh = Flesh::default();
    flesh.around(&found.joints, &V3::zeros());
    let (mut near, mut all) = (0, 0);
    for point in points {
        near += u32::from(flesh.distance(&point.at) < NEAR_M);
        all += 1;
    }
    f64::from(near) >= LEAST_NEAR * f64::from(all)
}

/// Whether the network finds a person there.
pub(crate) fn is_sure(found: &Estimate) -> bool {
    knows(found, SURE) >= SURE_JOINTS
}

/// Whether it finds nothing at all.
pub(crate) fn is_dull(found: &Estimate) -> bool {
    knows(found, SURE) == 0
}

/// Whether this is convincing even of somebody who does not move.
pub(crate) fn is_convincing(found: &Estimate) -> bool {
    knows(found, CONVINCED) >= CONVINCING_JOINTS
}

/// Of how many joints the network knows where they are, as surely as that.
fn knows(found: &Estimate, surely: f32) -> usize {
    let joints = found.sigma_m.iter().zip(&found.visible);
    let known = joints.filter(|(sigma, seen)| confidence(**sigma, **seen).get() > surely);
    known.count()
}

/// The middle of the trunk.
pub(crate) fn torso(found: &Estimate) -> V3 {
    let sum: V3 = Joint::TORSO
        .iter()
        .map(|&joint| found.joints[joint as usize])
        .sum();
    sum / Joint::TORSO.len() as f32
}
