//! Biovision hierarchies: a skeleton with channels, then one line of channel values a frame, degrees.

use nalgebra::{UnitQuaternion, Vector3};

use super::tree::{Frame, Tree, about};
use super::{Flaw, flaw, number, numbers};
use crate::motion::Clip;

/// A channel of a node: what the next number of a motion line does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

/// The skeleton of a file, and what the numbers of a line mean: for each in turn, which node and channel.
struct Hierarchy {
    tree: Tree,
    channels: Vec<(usize, Channel)>,
}

/// The motion in the text of a BVH file.
///
/// Axes and unit are guessed from the rest pose (metres, CMU's 56.44 mm, inches, centimetres or millimetres).
/// Position channels count for the root only; others keep their offsets. A first frame that is the rest pose, with
/// a jump after it, is left out.
pub fn bvh(name: &str, text: &str) -> Result<Clip, Flaw> {
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.split_whitespace().collect::<Vec<_>>()))
        .filter(|(_, words)| !words.is_empty());
    let (hierarchy, at) = hierarchy(&mut lines)?;
    let found = hierarchy.tree.joints(at)?;
    let Some(axes) = hierarchy.tree.guess_axes(&found) else {
        return flaw(
            at,
            "the rest pose is not an upright body with legs of a known unit",
        );
    };
    let count = match lines.next() {
        Some((line, words)) if words.len() == 2 && words[0] == "Frames:" => {
            number(line, words[1])? as usize
        }
        other => return expected("`Frames:` and their number", other, at),
    };
    let seconds = match lines.next() {
        Some((line, words)) if words.len() == 3 && words[..2] == ["Frame", "Time:"] => {
            number(line, words[2])?
        }
        other => return expected("`Frame Time:` and seconds", other, at),
    };
    let mut frames = Vec::with_capacity(count.min(1 << 20));
    let mut last = at;
    for (line, words) in lines {
        let values = numbers(line, &words, hierarchy.channels.len())?;
        frames.push(hierarchy.tree.place(&frame(&hierarchy, &values)));
        last = line;
    }
    if frames.len() != count {
        return flaw(
            last,
            format!("expected {count} frames, found {}", frames.len()),
        );
    }
    let begin = usize::from(begins_with_rest_pose(
        &hierarchy.tree,
        &frames,
        axes.metres_per_unit,
    ));
    axes.clip(name, 1.0 / seconds, &found, &frames[begin..], at)
}

/// Whether the first frame is the rest pose, put there for those who retarget, and the motion begins with a jump:
/// CMU's files for DAZ are like that.
fn begins_with_rest_pose(tree: &Tree, frames: &[Vec<Vector3<f64>>], metres_per_unit: f64) -> bool {
    let [first, second, ..] = frames else {
        return false;
    };
    let furthest = |a: &[Vector3<f64>], b: &[Vector3<f64>]| {
        let way =
            |(a_at, b_at): (&Vector3<f64>, &Vector3<f64>)| ((a_at - a[0]) - (b_at - b[0])).norm();
        a.iter().zip(b).map(way).fold(0.0, f64::max) * metres_per_unit
    };
    furthest(first, &tree.rest()) < 0.05 && furthest(first, second) > 0.2
}

fn expected<T>(what: &str, found: Option<(usize, Vec<&str>)>, last: usize) -> Result<T, Flaw> {
    match found {
        Some((line, words)) => flaw(
            line,
            format!("expected {what}, found `{}`", words.join(" ")),
        ),
        None => flaw(last, format!("expected {what}, found the end of the file")),
    }
}

/// Everything up to and including the line `MOTION`, and that line's number.
fn hierarchy<'a>(
    lines: &mut impl Iterator<Item = (usize, Vec<&'a str>)>,
) -> Result<(Hierarchy, usize), Flaw> {
    match lines.next() {
        Some((_, words)) if words == ["HIERARCHY"] => {}
        other => return expected("`HIERARCHY`", other, 1),
    }
    let mut tree = Tree { nodes: Vec::new() };
    let mut channels = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    let mut begun: Option<String> = None;
    let mut last = 1;
    for (line, words) in lines.by_ref() {
        last = line;
        match (words[0], words.len()) {
            ("ROOT", 2..) if tree.nodes.is_empty() => begun = Some(words[1..].join(" ")),
            ("JOINT", 2..) if !open.is_empty() => begun = Some(words[1..].join(" ")),
            ("End", _) if !open.is_empty() => {
                begun = Some(format!("^{}", tree.nodes[open[open.len() - 1]].name));
            }
            ("{", 1) => match begun.take() {
                Some(name) => {
                    open.push(tree.add(&name, open.last().copied(), Vector3::zeros()));
                }
                None => return flaw(line, "`{` without `ROOT`, `JOINT` or `End Site` before it"),
            },
            ("OFFSET", _) if !open.is_empty() => {
                let offset = numbers(line, &words[1..], 3)?;
                tree.nodes[open[open.len() - 1]].offset = Vector3::from_column_slice(&offset);
            }
            ("CHANNELS", 2..) if !open.is_empty() => {
                let node = open[open.len() - 1];
                let count = number(line, words[1])?;
                if count != (words.len() - 2) as f64 {
                    return flaw(
                        line,
                        format!("expected {count} channels, found {}", words.len() - 2),
                    );
                }
                for word in &words[2..] {
                    channels.push((node, channel(line, word)?));
                }
            }
            ("}", 1) if !open.is_empty() => {
                open.pop();
            }
            ("MOTION", 1) if open.is_empty() && !tree.nodes.is_empty() => {
                return Ok((Hierarchy { tree, channels }, line));
            }
            _ => return flaw(line, format!("`{}` has no place here", words.join(" "))),
        }
    }
    flaw(last, "expected `MOTION`, found the end of the file")
}

fn channel(line: usize, word: &str) -> Result<Channel, Flaw> {
    let axis = match word.as_bytes().first() {
        Some(b'X') => 0,
        Some(b'Y') => 1,
        Some(b'Z') => 2,
        _ => 3,
    };
    match word.get(1..) {
        Some("position") if axis < 3 => Ok(Channel::Position(axis)),
        Some("rotation") if axis < 3 => Ok(Channel::Rotation(axis)),
        _ => flaw(
            line,
            format!("expected a channel like `Xposition` or `Zrotation`, found `{word}`"),
        ),
    }
}

fn frame(hierarchy: &Hierarchy, values: &[f64]) -> Frame {
    let nodes = &hierarchy.tree.nodes;
    let mut root = nodes[0].offset;
    let mut rotations = vec![UnitQuaternion::identity(); nodes.len()];
    for (&(node, channel), &value) in hierarchy.channels.iter().zip(values) {
        match channel {
            Channel::Position(axis) if node == 0 => root[axis] = value,
            Channel::Position(_) => {}
            Channel::Rotation(axis) => rotations[node] *= about(axis, value),
        }
    }
    Frame { root, rotations }
}
