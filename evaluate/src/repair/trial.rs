//! One model on one gap: what it is shown, what it makes of it, and how good that is.

use std::ops::Range;
use std::time::Instant;

use nalgebra::Vector3;
use posefuse_fusion::{Fill, MAX_AGE_S, OcclusionModel, Window, WindowJoint};
use posefuse_skeleton::{Joint, JointMap};

use super::gaps::Gap;
use super::motion::{Pose, RATE_HZ};
use super::score::Score;

/// So many poses at either end of a gap are always filled: what happens at the seams needs them.
const SEAM: usize = 2;
/// A joint is within its stated uncertainty if it is no further off than so many standard deviations: 95 % of a normal
/// error in three dimensions are.
const WITHIN_SIGMAS: f64 = 2.795;

/// Lets `model` fill the gap in `poses` and counts what it made. Of the gap's poses every `every`th counts, and those at the
/// seams.
pub(super) fn run(
    model: &mut dyn OcclusionModel,
    poses: &[Pose],
    gap: &Gap,
    every: usize,
    score: &mut Score,
) {
    let counted =
        |index: &usize| *index < SEAM || *index + SEAM >= gap.length || index.is_multiple_of(every);
    let counted: Vec<usize> = (0..gap.length).filter(counted).collect();
    let begun = Instant::now();
    let filled = match model.needs().after {
        0 => live(model, poses, gap, &counted),
        _ => offline(model, poses, gap),
    };
    score.busy_s.sum += begun.elapsed().as_secs_f64();
    score.busy_s.count += match model.needs().after {
        0 => counted.len() as f64,
        _ => gap.length as f64,
    };
    count(&filled, poses, gap, &counted, score);
}

/// What the truth itself does at the seams, and would do if it were filled in.
pub(super) fn truth(poses: &[Pose], gap: &Gap, score: &mut Score) {
    let filled: Vec<Filled> = poses[gap.start..gap.end()]
        .iter()
        .map(|pose| Filled {
            pose: *pose,
            sigmas: JointMap::empty(),
        })
        .collect();
    seams(&|index| filled[index].pose, poses, gap, score);
}

/// A pose of the gap with what was made up.
#[derive(Clone)]
struct Filled {
    pose: Pose,
    /// Standard deviation along each axis of every joint that was made up, metres.
    sigmas: JointMap<f64>,
}

impl Filled {
    /// Pose `index` of the gap; what the model says nothing of stays where it was.
    fn new(poses: &[Pose], gap: &Gap, index: usize, fills: Option<&JointMap<Fill>>) -> Self {
        let (mut pose, held) = (poses[gap.start + index], poses[gap.start - 1]);
        let mut sigmas = JointMap::empty();
        for joint in Joint::ALL.into_iter().filter(|j| gap.hides(*j as usize)) {
            let fill = fills.and_then(|fills| fills[joint].as_ref());
            pose[joint as usize] = fill.map_or(held[joint as usize], |fill| fill.position);
            sigmas[joint] = fill.map(|fill| fill.sigma_m);
        }
        Self { pose, sigmas }
    }
}

/// Pose after pose, each from what was before it; poses that do not count are left out.
fn live(
    model: &mut dyn OcclusionModel,
    poses: &[Pose],
    gap: &Gap,
    counted: &[usize],
) -> Vec<Option<Filled>> {
    let before = model.needs().before;
    let mut filled = vec![None; gap.length];
    for &index in counted {
        let newest = gap.start + index;
        let window = window(poses, gap, newest as isize - before as isize, newest + 1);
        let fills = model.fill(&window, before..before + 1);
        let fills = fills.ok().filter(|fills| fills.len() == 1);
        let fills = fills.as_ref().and_then(|fills| fills.first());
        filled[index] = Some(Filled::new(poses, gap, index, fills));
    }
    filled
}

/// The whole gap at once.
fn offline(model: &mut dyn OcclusionModel, poses: &[Pose], gap: &Gap) -> Vec<Option<Filled>> {
    let needs = model.needs();
    let end = (gap.end() + needs.after).min(poses.len());
    let window = window(poses, gap, gap.start as isize - needs.before as isize, end);
    let wanted: Range<usize> = needs.before..needs.before + gap.length;
    let fills = model.fill(&window, wanted);
    let fills = fills.ok().filter(|fills| fills.len() == gap.length);
    let fill = |index: usize| {
        let fills = fills.as_ref().and_then(|fills| fills.get(index));
        Some(Filled::new(poses, gap, index, fills))
    };
    (0..gap.length).map(fill).collect()
}

/// Poses `first` to `end` as the engine shows them; before the first pose there is that one again, without weight.
fn window(poses: &[Pose], gap: &Gap, first: isize, end: usize) -> Window {
    let seen = |position: Vector3<f64>| WindowJoint {
        position,
        weight: 1.0,
        confidence: 1.0,
        age_s: 0.0,
    };
    let unseen = |position: Vector3<f64>, age_s: f64| WindowJoint {
        position,
        weight: 0.0,
        confidence: 0.0,
        age_s: (age_s as f32).min(MAX_AGE_S),
    };
    let pose = |index: isize| {
        let Ok(index) = usize::try_from(index) else {
            return poses[0].map(|at| unseen(at, f64::from(MAX_AGE_S)));
        };
        let inside = (gap.start..gap.end()).contains(&index);
        std::array::from_fn(|joint| match inside && gap.hides(joint) {
            true => {
                let age_s = (index + 1 - gap.start) as f64 / RATE_HZ;
                unseen(poses[gap.start - 1][joint], age_s)
            }
            false => seen(poses[index][joint]),
        })
    };
    Window {
        step_s: 1.0 / RATE_HZ,
        poses: (first..end as isize).map(pose).collect(),
    }
}

fn count(
    filled: &[Option<Filled>],
    poses: &[Pose],
    gap: &Gap,
    counted: &[usize],
    score: &mut Score,
) {
    score.gaps += 1;
    let length = |pose: &Pose, (a, b): (usize, usize)| (pose[a] - pose[b]).norm();
    for &index in counted {
        let (Some(found), truth) = (&filled[index], &poses[gap.start + index]) else {
            continue;
        };
        for joint in Joint::ALL.into_iter().filter(|j| gap.hides(*j as usize)) {
            let off = (found.pose[joint as usize] - truth[joint as usize]).norm();
            score.error.add(off);
            let sigma = found.sigmas[joint];
            score.filled.add(f64::from(u8::from(sigma.is_some())));
            if let Some(sigma) = sigma {
                let within = off <= WITHIN_SIGMAS * sigma;
                score.within.add(f64::from(u8::from(within)));
            }
        }
        for bone in gap.bones() {
            let error = length(&found.pose, bone) - length(truth, bone);
            score.bones.add(error.abs());
        }
    }
    let at = |index: usize| match &filled[index] {
        Some(filled) => filled.pose,
        // Not at a seam.
        None => poses[gap.start + index],
    };
    seams(&at, poses, gap, score);
}

/// Second differences of the hidden joints over the two triples of poses that contain the step into the gap, and over
/// those that contain the step out of it. `filled` gives the poses of the gap.
fn seams(filled: &dyn Fn(usize) -> Pose, poses: &[Pose], gap: &Gap, score: &mut Score) {
    let at = |index: usize| match (gap.start..gap.end()).contains(&index) {
        true => filled(index - gap.start),
        false => poses[index],
    };
    let (start, end) = (gap.start, gap.end());
    for (firsts, sum) in [
        ([start - 2, start - 1], &mut score.entering),
        ([end - 2, end - 1], &mut score.leaving),
    ] {
        for first in firsts {
            let [a, b, c] = [at(first), at(first + 1), at(first + 2)];
            for joint in (0..a.len()).filter(|joint| gap.hides(*joint)) {
                let second = (c[joint] - b[joint]) - (b[joint] - a[joint]);
                sum.add((second * RATE_HZ * RATE_HZ).norm_squared());
            }
        }
    }
}
