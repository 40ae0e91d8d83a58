//! Acclaim motions (AMC), made with a skeleton (ASF). Y up; angles in degrees or radians, as either file says.
//!
//! A bone's rotations are about its own axes: with `C` the rotation to them and `M` that of the frame's values, it
//! turns against its parent by `C M C^-1`.

use nalgebra::{UnitQuaternion, Vector3};

use super::acclaim::{Bone, Freedom, Line, Skeleton, words};
use super::tree::{Axes, Frame, about};
use super::{Flaw, flaw, numbers};
use crate::motion::Clip;

/// CMU recorded at 120 frames per second; AMC files do not say.
const RATE_HZ: f64 = 120.0;

/// The motion in the text of an AMC file, with the text of its ASF. A flaw's line may be of either; use
/// [`super::load`] to know which.
pub fn acclaim(name: &str, asf: &str, amc: &str) -> Result<Clip, Flaw> {
    motion(name, &Skeleton::parse(asf)?, amc)
}

/// The motion in the text of an AMC file.
pub(crate) fn motion(name: &str, skeleton: &Skeleton, text: &str) -> Result<Clip, Flaw> {
    let found = skeleton.tree.joints(1)?;
    let lines = words(text);
    let mut degrees = skeleton.degrees_per_unit;
    let mut frames = Vec::new();
    let mut at = 0;
    while let Some((line, words)) = lines.get(at) {
        match words[..] {
            [":DEGREES"] => degrees = 1.0,
            [":RADIANS"] => degrees = 1f64.to_degrees(),
            [word] if word.starts_with(':') => {}
            [word] => {
                let expected = frames.len() + 1;
                if word.parse() != Ok(expected) {
                    return flaw(
                        *line,
                        format!("expected frame number {expected}, found `{word}`"),
                    );
                }
                let end = (at + 1..lines.len())
                    .find(|&i| lines[i].1.len() == 1)
                    .unwrap_or(lines.len());
                let frame = frame(skeleton, *line, &lines[at + 1..end], degrees)?;
                frames.push(skeleton.tree.place(&frame));
                at = end - 1;
            }
            _ => {
                return flaw(
                    *line,
                    format!("expected a frame number, found `{}`", words.join(" ")),
                );
            }
        }
        at += 1;
    }
    let last = lines.last().map_or(1, |(line, _)| *line);
    if frames.is_empty() {
        return flaw(last, "expected at least one frame, found none");
    }
    Axes::y_up(skeleton.metres_per_unit).clip(name, RATE_HZ, &found, &frames, last)
}

fn frame(skeleton: &Skeleton, line: usize, lines: &[Line], degrees: f64) -> Result<Frame, Flaw> {
    let mut frame = Frame {
        root: Vector3::zeros(),
        rotations: vec![UnitQuaternion::identity(); skeleton.tree.nodes.len()],
    };
    let mut given = vec![false; skeleton.tree.nodes.len()];
    for (line, words) in lines {
        let node = skeleton.by_name.get(words[0]).copied();
        let Some((node, bone)) = node.and_then(|node| Some((node, skeleton.bones[node].as_ref()?)))
        else {
            return flaw(*line, format!("the skeleton has no bone `{}`", words[0]));
        };
        let values = numbers(*line, &words[1..], bone.freedoms.len())?;
        let mut turn = UnitQuaternion::identity();
        for (freedom, value) in bone.freedoms.iter().zip(values) {
            match *freedom {
                Freedom::Move(axis) => frame.root[axis] = value,
                Freedom::Turn(axis) => turn = about(axis, value * degrees) * turn,
                Freedom::Length => {}
            }
        }
        frame.rotations[node] = bone.axes * turn * bone.axes.inverse();
        given[node] = true;
    }
    let moves = |bone: &Option<Bone>| bone.as_ref().is_some_and(|bone| !bone.freedoms.is_empty());
    match (0..given.len()).find(|&node| moves(&skeleton.bones[node]) && !given[node]) {
        None => Ok(frame),
        Some(node) => {
            let name = &skeleton.tree.nodes[node].name;
            flaw(
                line,
                format!("the frame that begins here has no values for bone `{name}`"),
            )
        }
    }
}
