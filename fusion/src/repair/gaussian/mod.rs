//! `gaussian`: what bodies do that moved like this one and look now like what is seen of it.
//!
//! Poses in the person's frame are jointly Gaussian over time (`table`): how a pose follows from one that was known, and how
//! its joints go together. What was believed when the missing joints were last seen is carried on to now, and what is
//! measured now, weak measurements with their noise, is taken in (`settle`). Looking both ways, what is believed when they
//! are seen again is carried back, and the two are multiplied and divided by what was known beforehand (Bayes). What the
//! statistics could not describe of a joint when it was seen (its offset) fades over half a second.

mod settle;
mod table;

use nalgebra::Vector3;
use posefuse_skeleton::{BONES, JOINT_COUNT, Joint, JointMap};

use super::{Fill, MAX_AGE_S, Window, WindowJoint};
use settle::{Belief, Settled, measured, noise, settle};
use table::{CHANGE, Latent, RATE_HZ, TABLE};

/// Poses looked at on either side.
pub(super) const REACH: usize = 60;
/// Poses at which joints were lost are told apart, at most so many.
const MOST_ANCHORS: usize = 3;
/// Joints lost within so many poses were lost together.
const TOGETHER: usize = 2;
/// The offset fades with this time constant, seconds.
const OFFSET_FADE_S: f64 = 0.5;
/// A bone counts as measured from this weight on.
const BONE_WEIGHT: f32 = 0.8;
/// Poses between those that bones are measured in.
const BONE_STEP: usize = 6;
/// What a mean bone is taken for where none is measured, and what it can be, metres.
const USUAL_SCALE_M: f64 = 0.25;
const SCALES_M: (f64, f64) = (0.08, 0.5);
/// What the statistics say of their own error, times this, is right within a factor of 1.4: errors were 0.74 to 1.06 times
/// as large on recordings held out, 1.3 to 1.8 times on other people doing other things (gaps of 0.2 to 2 s, one side).
const CALIBRATED: f64 = 1.25;
/// A posterior this near to the measurement says nothing beyond it.
const NOTHING_NEW: f64 = 0.95;

/// Where to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sides {
    Before,
    Both,
}

/// Everything that can be said of the pose number `now`: each joint that is not measured with trust. Of one that is measured
/// weakly, what the others say of it.
pub(super) fn fill(window: &Window, now: usize, sides: Sides) -> JointMap<Fill> {
    let pose = &window.poses[now];
    let scale = scale(window, now, sides);
    let before = Past::of(window, now, Way::Back, scale);
    let after = match sides {
        Sides::Before => None,
        Sides::Both => Past::of(window, now, Way::Ahead, scale),
    };
    let anybody = Belief::of_anybody();
    let prior = match (&before, &after) {
        (None, None) => anybody,
        (Some(one), None) | (None, Some(one)) => one.belief.clone(),
        (Some(a), Some(b)) => both(&a.belief, &b.belief).unwrap_or_else(|| a.belief.clone()),
    };
    let Some(settled) = settle(pose, !0, &prior, scale) else {
        return JointMap::empty();
    };
    let joints = Joint::ALL.into_iter().enumerate();
    joints
        .filter(|(index, _)| pose[*index].weight < 1.0)
        .filter_map(|(index, joint)| {
            let offset = offset(index, before.as_ref(), after.as_ref());
            Some((joint, said(&settled, index, &pose[index], offset)?))
        })
        .collect()
}

/// What the settled pose says of a joint.
fn said(settled: &Settled, index: usize, seen: &WindowJoint, offset: Vector3<f64>) -> Option<Fill> {
    let place = settled.place(index);
    let variance = settled.variance(index);
    let (position, variance) = if seen.weight > 0.0 {
        // The measurement is in it: it is taken out again, for the engine to put in once.
        let own = noise(seen.weight);
        if variance >= NOTHING_NEW * own {
            return None;
        }
        let without = 1.0 / (1.0 / variance - 1.0 / own);
        ((place / variance - seen.position / own) * without, without)
    } else {
        (place + settled.to_room(offset), variance)
    };
    Some(Fill {
        position,
        sigma_m: CALIBRATED * variance.sqrt(),
        rotation: None,
    })
}

/// What both sides say, once.
fn both(a: &Belief, b: &Belief) -> Option<Belief> {
    let (a_information, b_information) = (
        a.covariance.cholesky()?.inverse(),
        b.covariance.cholesky()?.inverse(),
    );
    let mut information = a_information + b_information;
    for index in 0..table::LATENT {
        information[(index, index)] -= 1.0 / TABLE.variance[index];
    }
    let covariance = information.cholesky()?.inverse();
    Some(Belief {
        mean: covariance * (a_information * a.mean + b_information * b.mean),
        covariance,
    })
}

/// The offset of joint number `index` now, in the person's frame, metres.
fn offset(index: usize, before: Option<&Past>, after: Option<&Past>) -> Vector3<f64> {
    let of = |past: Option<&Past>| past.and_then(|past| past.offsets[index]);
    let fade = |age_s: f64| (-age_s / OFFSET_FADE_S).exp();
    match (of(before), of(after)) {
        (None, None) => Vector3::zeros(),
        (Some((offset, age_s)), None) | (None, Some((offset, age_s))) => offset * fade(age_s),
        (Some((a, a_s)), Some((b, b_s))) => {
            let share = a_s / (a_s + b_s).max(f64::MIN_POSITIVE);
            a * (1.0 - share) + b * share
        }
    }
}

/// Metres per unit of length: the person's bones against those of the table.
fn scale(window: &Window, now: usize, sides: Sides) -> f64 {
    let (mut found, mut expected) = (0.0, 0.0);
    let last = match sides {
        Sides::Before => now + 1,
        Sides::Both => window.poses.len(),
    };
    for pose in window.poses[..last].iter().rev().step_by(BONE_STEP) {
        for (bone, length) in BONES.iter().zip(&TABLE.bones) {
            let (a, b) = (&pose[bone.parent as usize], &pose[bone.child as usize]);
            if a.weight >= BONE_WEIGHT && b.weight >= BONE_WEIGHT {
                found += (a.position - b.position).norm();
                expected += length;
            }
        }
    }
    if expected == 0.0 {
        return USUAL_SCALE_M;
    }
    (found / expected).clamp(SCALES_M.0, SCALES_M.1)
}

/// Which way to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Back,
    Ahead,
}

impl Way {
    /// The pose `steps` further that way, if the window has it.
    fn from(self, now: usize, steps: usize, window: &Window) -> Option<usize> {
        match self {
            Self::Back => now.checked_sub(steps),
            Self::Ahead => Some(now + steps).filter(|index| *index < window.poses.len()),
        }
    }
}

/// What the poses on one side of a gap say of the pose in it.
struct Past {
    belief: Belief,
    /// What was left of each joint when it was seen, in the person's frame, metres, and how long ago that was, seconds.
    offsets: [Option<(Vector3<f64>, f64)>; JOINT_COUNT],
}

impl Past {
    /// `None` where no missing joint is seen that way.
    fn of(window: &Window, now: usize, way: Way, scale: f64) -> Option<Self> {
        let (anchors, seen) = anchors(window, now, way);
        let mut known: Option<(Settled, Latent, usize)> = None;
        let mut offsets = [None; JOINT_COUNT];
        for steps in anchors {
            let here = way.from(now, steps, window)?;
            let prior = match &known {
                None => Belief::of_anybody(),
                Some((settled, change, from)) => {
                    carried(&settled.belief, change, lag(window, from - steps))
                }
            };
            let Some(settled) = settle(&window.poses[here], !0, &prior, scale) else {
                continue;
            };
            for (index, at) in seen.iter().enumerate() {
                let joint = &window.poses[here][index];
                if at.is_some_and(|at| at.abs_diff(steps) <= TOGETHER) && joint.weight > 0.0 {
                    let left = settled.to_person(joint.position - settled.place(index));
                    offsets[index] = Some((left, steps as f64 * window.step_s));
                }
            }
            let change = change(window, here, way, &prior, &settled, scale);
            known = Some((settled, change, steps));
        }
        let (settled, change, from) = known?;
        Some(Self {
            belief: carried(&settled.belief, &change, lag(window, from)),
            offsets,
        })
    }
}

/// Steps of the window in poses of the table.
fn lag(window: &Window, steps: usize) -> f64 {
    steps as f64 * window.step_s * RATE_HZ
}

/// How many steps away the missing joints were last seen, furthest first, at most [`MOST_ANCHORS`]; and for each
/// joint that is missing now.
fn anchors(window: &Window, now: usize, way: Way) -> (Vec<usize>, [Option<usize>; JOINT_COUNT]) {
    let mut seen = [None; JOINT_COUNT];
    for (index, joint) in window.poses[now].iter().enumerate() {
        if joint.weight > 0.0 || way == Way::Back && joint.age_s >= MAX_AGE_S {
            continue;
        }
        seen[index] = (1..=REACH).find(|steps| {
            let there = way.from(now, *steps, window);
            there.is_some_and(|there| window.poses[there][index].weight > 0.0)
        });
    }
    let mut anchors: Vec<usize> = seen.iter().flatten().copied().collect();
    anchors.sort_unstable_by(|a, b| b.cmp(a));
    let mut together = TOGETHER;
    loop {
        anchors.dedup_by(|nearer, further| *further - *nearer <= together);
        if anchors.len() <= MOST_ANCHORS {
            return (anchors, seen);
        }
        together *= 2;
    }
}

/// How the latents were changing at the pose `here`, towards the gap, over [`CHANGE`] poses of the table.
fn change(
    window: &Window,
    here: usize,
    way: Way,
    prior: &Belief,
    settled: &Settled,
    scale: f64,
) -> Latent {
    let steps = (CHANGE as f64 / (window.step_s * RATE_HZ)).round().max(1.0) as usize;
    let Some(further) = way.from(here, steps, window) else {
        return Latent::zeros();
    };
    let (near, far) = (&window.poses[here], &window.poses[further]);
    let (known, shared) = (measured(near), measured(near) & measured(far));
    let Some(before) = settle(far, shared, prior, scale) else {
        return Latent::zeros();
    };
    let mean = if known == shared {
        settled.belief.mean
    } else {
        match settle(near, shared, prior, scale) {
            Some(settled) => settled.belief.mean,
            None => return Latent::zeros(),
        }
    };
    (mean - before.belief.mean) * (CHANGE as f64 / lag(window, steps))
}

/// What is believed `lag` poses further.
fn carried(belief: &Belief, change: &Latent, lag: f64) -> Belief {
    let carry = TABLE.carry(lag);
    let covariance = carry.of_pose * belief.covariance * carry.of_pose.transpose() + carry.spread;
    Belief {
        mean: carry.of_pose * belief.mean + carry.of_change * change,
        covariance: (covariance + covariance.transpose()) * 0.5,
    }
}

#[cfg(test)]
mod tests;
