//! Limbs hidden from simple models, and how near these come.

use std::error::Error;
use std::path::Path;

use nalgebra::Vector3;
use posefuse_fusion::{MAX_AGE_S, OcclusionModel, SimpleModel, Window, WindowJoint};
use posefuse_skeleton::{JOINT_COUNT, Joint};

use crate::recordings::{Part, Pose, RATE_HZ, pieces};

/// Gaps begin so many poses apart.
const EVERY: usize = 15;
const GAPS_S: [f64; 4] = [0.2, 0.5, 1.0, 2.0];
/// Of each gap so many poses are looked at.
const LOOKS: usize = 6;

pub(crate) fn measure(folder: &Path, noise_mm: f64) -> Result<(), Box<dyn Error>> {
    println!("part,limb,model,gap_s,mean_mm,p95_mm,rms_over_sigma,us");
    for part in [Part::HeldOut, Part::Unseen] {
        let pieces = pieces(folder, part)?;
        for (limb, hidden) in limbs() {
            for model in SimpleModel::ALL {
                for gap_s in GAPS_S {
                    let found = all(&pieces, &hidden, model, gap_s, noise_mm * 1e-3)?;
                    println!("{part:?},{limb},{},{gap_s},{found}", model.label());
                }
            }
        }
    }
    Ok(())
}

fn limbs() -> [(&'static str, Vec<Joint>); 5] {
    use Joint::*;
    let arm = vec![ElbowLeft, WristLeft, HandLeft, HandTipLeft, ThumbLeft];
    let leg = vec![KneeLeft, AnkleLeft, FootLeft];
    let legs = leg
        .iter()
        .flat_map(|joint| [*joint, joint.mirrored()])
        .collect::<Vec<_>>();
    let lower = legs
        .iter()
        .copied()
        .chain([SpineBase, HipLeft, HipRight])
        .collect();
    let side = arm.iter().chain(&leg).copied().collect();
    [
        ("arm", arm),
        ("leg", leg),
        ("legs", legs),
        ("lower", lower),
        ("side", side),
    ]
}

fn all(
    pieces: &[Vec<Pose>],
    hidden: &[Joint],
    mut model: SimpleModel,
    gap_s: f64,
    noise_m: f64,
) -> Result<String, Box<dyn Error>> {
    let needs = model.needs();
    let gap = (gap_s * RATE_HZ) as usize;
    let (mut errors, mut squares, mut busy, mut calls) = (Vec::new(), 0.0, 0.0, 0.0);
    let mut dice = 1_u64;
    for piece in pieces {
        let seen: Vec<Pose> = piece
            .iter()
            .map(|pose| pose.map(|place| place + wobble(&mut dice) * noise_m))
            .collect();
        for start in (10..piece.len().saturating_sub(gap + 4)).step_by(EVERY) {
            for look in (0..gap).step_by(gap.div_ceil(LOOKS)) {
                let now = start + look;
                let first = now.saturating_sub(needs.before);
                let last = (now + needs.after).min(piece.len() - 1);
                let poses = (first..=last)
                    .map(|index| pose(&seen, index, hidden, start..start + gap))
                    .collect();
                let window = Window {
                    step_s: 1.0 / RATE_HZ,
                    poses,
                };
                let here = now - first;
                let begun = std::time::Instant::now();
                let fills = model.fill(&window, here..here + 1)?;
                busy += begun.elapsed().as_secs_f64();
                calls += 1.0;
                for joint in hidden {
                    let Some(fill) = &fills[0][*joint] else {
                        return Err(format!("{} says nothing of {joint}", model.label()).into());
                    };
                    let error = (fill.position - piece[now][*joint as usize]).norm();
                    errors.push(error);
                    squares += error * error / (3.0 * fill.sigma_m * fill.sigma_m);
                }
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let p95 = errors[(0.95 * count) as usize];
    Ok(format!(
        "{:.1},{:.1},{:.2},{:.0}",
        mean * 1e3,
        p95 * 1e3,
        (squares / count).sqrt(),
        busy / calls * 1e6
    ))
}

/// The pose as a window shows it, `hidden` not seen during `gap`.
fn pose(
    seen: &[Pose],
    index: usize,
    hidden: &[Joint],
    gap: std::ops::Range<usize>,
) -> [WindowJoint; JOINT_COUNT] {
    std::array::from_fn(|joint| {
        let missing = gap.contains(&index) && hidden.contains(&Joint::ALL[joint]);
        let (from, age) = match missing {
            true => (gap.start - 1, index + 1 - gap.start),
            false => (index, 0),
        };
        WindowJoint {
            position: seen[from][joint],
            weight: if missing { 0.0 } else { 1.0 },
            confidence: if missing { 0.0 } else { 1.0 },
            age_s: (age as f32 / RATE_HZ as f32).min(MAX_AGE_S),
        }
    })
}

/// Three numbers of about variance 1 (sums of three uniform ones).
fn wobble(state: &mut u64) -> Vector3<f64> {
    let mut uniform = || {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    Vector3::from_fn(|_, _| uniform() + uniform() + uniform())
}
