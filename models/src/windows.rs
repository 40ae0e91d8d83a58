//! Windows of the engine as tensors, and back: cut or filled up to the length a network has, one window for each pose
//! asked for or overlapping ones for a long gap.

use std::ops::Range;

use nalgebra::Vector3;
use posefuse_fusion::{Fill, MAX_AGE_S, Window, WindowJoint};
use posefuse_skeleton::{Joint, JointMap};

use crate::Manifest;
use crate::tensors::{JOINTS, Tensors};

/// A joint further from the person's middle than this is nonsense, metres.
const FAR_M: f32 = 5.0;
/// A standard deviation beyond this is nonsense, metres.
const VAGUE_M: f32 = 10.0;

/// Windows to fill, and which of their poses.
#[derive(Clone, Debug)]
pub struct Ask<'a> {
    /// The window.
    pub window: &'a Window,
    /// The poses of it that are wanted.
    pub wanted: Range<usize>,
}

/// A network's window within a longer one: it begins at pose `start`, which may lie before the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    pub(crate) ask: usize,
    pub(crate) start: isize,
}

/// The network's windows for `ask`, the `number`th.
///
/// A network that fills one pose gets one window for each. One that fills its whole window gets one with the wanted poses
/// where it is best, or, for more of them, several that overlap by three quarters.
pub(crate) fn pieces(manifest: &Manifest, number: usize, ask: &Ask, into: &mut Vec<Piece>) {
    let (t, before) = (manifest.poses(), manifest.before as isize);
    let (first, end) = (ask.wanted.start as isize, ask.wanted.end as isize);
    let mut push = |start| into.push(Piece { ask: number, start });
    if manifest.filled() == 1 {
        (first..end).for_each(|wanted| push(wanted - before));
        return;
    }
    // A window shorter than the network's begins before its first pose.
    let latest = ask.window.poses.len() as isize - t as isize;
    let at = |wanted: isize| (wanted - before).max(0).min(latest);
    let (low, high) = (at(first), at(end - 1));
    let stride = (t / 4).max(1);
    (low..high).step_by(stride).for_each(&mut push);
    push(high);
}

/// Appends the poses of `piece` to the inputs.
pub(crate) fn append(tensors: &mut Tensors, window: &Window, piece: Piece) {
    let count = window.poses.len();
    for number in 0..tensors.poses {
        let wanted = piece.start + number as isize;
        let found = usize::try_from(wanted).unwrap_or(0).min(count - 1);
        let is_there = wanted == found as isize;
        // How far beyond the last pose; 0 before the first one.
        let beyond_s = (wanted - found as isize).max(0) as f32 * window.step_s as f32;
        for joint in &window.poses[found] {
            let position = joint.position.cast::<f32>();
            tensors.pose.extend_from_slice(position.as_slice());
            let (mask, age) = match (is_there, beyond_s > 0.0) {
                (true, _) => (joint.weight, joint.age_s),
                (false, true) => (0.0, joint.age_s + beyond_s),
                (false, false) => (0.0, MAX_AGE_S),
            };
            tensors.mask.push(mask.clamp(0.0, 1.0));
            tensors.age.push(age.clamp(0.0, MAX_AGE_S));
        }
    }
}

/// What is wrong with a window, if anything.
pub(crate) fn check(manifest: &Manifest, ask: &Ask) -> Result<(), String> {
    let Window { step_s, poses } = ask.window;
    if ask.wanted.is_empty() || ask.wanted.end > poses.len() {
        let (wanted, count) = (&ask.wanted, poses.len());
        return Err(format!(
            "poses {wanted:?} were asked of a window of {count}"
        ));
    }
    let rate_hz = 1.0 / step_s;
    if !(0.95..1.05).contains(&(rate_hz / manifest.rate_hz)) {
        let needed = manifest.rate_hz;
        return Err(format!(
            "the window is of {rate_hz:.1} Hz, it needs {needed:.1} Hz"
        ));
    }
    let is_number = |joint: &WindowJoint| {
        let position = joint.position.iter().all(|value| value.is_finite());
        position && joint.weight.is_finite() && joint.age_s.is_finite()
    };
    match poses.iter().flatten().all(is_number) {
        true => Ok(()),
        false => Err("the window holds a value that is no number".to_owned()),
    }
}

/// Adds up what overlapping windows say of each wanted pose of one ask.
pub(crate) struct Sums<'a> {
    ask: &'a Ask<'a>,
    poses: Vec<Sum>,
}

#[derive(Clone)]
struct Sum {
    weight: f64,
    joints: [(Vector3<f64>, f64); JOINTS],
}

impl<'a> Sums<'a> {
    pub(crate) fn new(ask: &'a Ask<'a>) -> Self {
        let none = Sum {
            weight: 0.0,
            joints: [(Vector3::zeros(), 0.0); JOINTS],
        };
        Self {
            ask,
            poses: vec![none; ask.wanted.len()],
        }
    }

    /// Adds the outputs of the `number`th window of a call.
    ///
    /// # Errors
    /// They are nonsense: not finite, or nowhere near the person.
    pub(crate) fn add(
        &mut self,
        manifest: &Manifest,
        tensors: &Tensors,
        number: usize,
        piece: Piece,
    ) -> Result<(), String> {
        let k = tensors.answers;
        for answer in 0..k {
            let pose = match k {
                1 => piece.start + manifest.before as isize,
                _ => piece.start + answer as isize,
            };
            let Some(wanted) = usize::try_from(pose)
                .ok()
                .filter(|pose| self.ask.wanted.contains(pose))
            else {
                continue;
            };
            let middle = middle(&self.ask.window.poses[wanted]);
            // The middle of a window knows most of both sides.
            let weight = (1 + answer.min(k - 1 - answer)) as f64;
            let sum = &mut self.poses[wanted - self.ask.wanted.start];
            sum.weight += weight;
            for (joint, (position, sigma)) in sum.joints.iter_mut().enumerate() {
                let at = (number * k + answer) * JOINTS + joint;
                let p = &tensors.filled[3 * at..3 * at + 3];
                let found = Vector3::new(p[0], p[1], p[2]);
                check_answer(Joint::ALL[joint], found, tensors.sigma[at], middle)?;
                *position += weight * found.cast::<f64>();
                *sigma += weight * f64::from(tensors.sigma[at]);
            }
        }
        Ok(())
    }

    /// The joints that were not measured with full trust, of each wanted pose.
    pub(crate) fn fills(&self) -> Vec<JointMap<Fill>> {
        let poses = &self.ask.window.poses[self.ask.wanted.clone()];
        let fill = |(sum, pose): (&Sum, &[WindowJoint; JOINTS])| {
            let joints = Joint::ALL.into_iter().zip(&sum.joints).zip(pose);
            joints
                .filter(|(_, known)| known.weight < 1.0)
                .map(|((joint, (position, sigma)), _)| {
                    let fill = Fill {
                        position: position / sum.weight,
                        sigma_m: sigma / sum.weight,
                        rotation: None,
                    };
                    (joint, fill)
                })
                .collect()
        };
        self.poses.iter().zip(poses).map(fill).collect()
    }
}

/// Whether all outputs are near a person whose middle is at `middle`.
pub(crate) fn check_outputs(tensors: &Tensors, middle: [f32; 3]) -> Result<(), String> {
    let joints = Joint::ALL.into_iter().cycle();
    let outputs = tensors.filled.chunks_exact(3).zip(&tensors.sigma);
    for (joint, (p, sigma)) in joints.zip(outputs) {
        check_answer(joint, Vector3::new(p[0], p[1], p[2]), *sigma, middle.into())?;
    }
    Ok(())
}

fn middle(pose: &[WindowJoint; JOINTS]) -> Vector3<f32> {
    let sum: Vector3<f64> = pose.iter().map(|joint| joint.position).sum();
    (sum / JOINTS as f64).cast()
}

fn check_answer(
    joint: Joint,
    position: Vector3<f32>,
    sigma: f32,
    middle: Vector3<f32>,
) -> Result<(), String> {
    let name = joint.name();
    let far = (position - middle).norm();
    // Not a number is not within either.
    if !(0.0..=FAR_M).contains(&far) {
        return Err(format!("it put {name} {far:.1} m away from the person"));
    }
    if !(sigma > 0.0 && sigma <= VAGUE_M) {
        return Err(format!("it gave {name} an uncertainty of {sigma} m"));
    }
    Ok(())
}
