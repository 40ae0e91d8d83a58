//! Acclaim skeletons (ASF). Y up; angles and lengths in the units that the file names.
//!
//! Orders name the rotations from the first applied to the last.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};

use super::tree::{Tree, about};
use super::{Flaw, flaw, number, numbers};

/// Inches, scaled by the ASF's `length`.
const METRES_PER_INCH: f64 = 0.0254;

/// What a number of an AMC line does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Freedom {
    Move(usize),
    Turn(usize),
    /// Stretching; no recording here uses it.
    Length,
}

/// A bone, or the root, beside its node in the tree.
#[derive(Clone, Debug)]
pub(crate) struct Bone {
    pub(crate) vector: Vector3<f64>,
    pub(crate) axes: UnitQuaternion<f64>,
    pub(crate) freedoms: Vec<Freedom>,
}

/// An ASF file.
#[derive(Clone, Debug)]
pub(crate) struct Skeleton {
    pub(crate) tree: Tree,
    /// By node; ends have none.
    pub(crate) bones: Vec<Option<Bone>>,
    pub(crate) by_name: BTreeMap<String, usize>,
    pub(crate) metres_per_unit: f64,
    pub(crate) degrees_per_unit: f64,
}

/// A line's number and words.
pub(crate) type Line<'a> = (usize, Vec<&'a str>);

pub(crate) fn words(text: &str) -> Vec<Line<'_>> {
    text.lines()
        .enumerate()
        .map(|(index, line)| {
            let line = line.split('#').next().unwrap_or_default();
            (index + 1, line.split_whitespace().collect())
        })
        .filter(|(_, words): &Line| !words.is_empty())
        .collect()
}

impl Skeleton {
    pub(crate) fn parse(text: &str) -> Result<Self, Flaw> {
        let lines = words(text);
        let mut sections: BTreeMap<&str, (usize, &[Line])> = BTreeMap::new();
        let starts: Vec<usize> = (0..lines.len())
            .filter(|&i| lines[i].1[0].starts_with(':'))
            .collect();
        for (k, &start) in starts.iter().enumerate() {
            let end = starts.get(k + 1).copied().unwrap_or(lines.len());
            sections.insert(lines[start].1[0], (lines[start].0, &lines[start + 1..end]));
        }
        let last = lines.last().map_or(1, |(line, _)| *line);
        let section = |name: &str| match sections.get(name) {
            Some(section) => Ok(*section),
            None => flaw(last, format!("expected a section `{name}`, found none")),
        };
        let (degrees_per_unit, length) = match sections.get(":units") {
            Some((_, lines)) => units(lines)?,
            None => (1.0, 1.0),
        };
        let root = root(section(":root")?.1, degrees_per_unit)?;
        let bones = bones(section(":bonedata")?.1, degrees_per_unit)?;
        let (line, hierarchy) = section(":hierarchy")?;
        let mut skeleton = Self {
            tree: Tree { nodes: Vec::new() },
            bones: vec![Some(root)],
            by_name: BTreeMap::from([("root".to_owned(), 0)]),
            metres_per_unit: METRES_PER_INCH / length,
            degrees_per_unit,
        };
        skeleton.tree.add("root", None, Vector3::zeros());
        skeleton.grow(hierarchy, bones)?;
        skeleton.tree.joints(line)?;
        Ok(skeleton)
    }

    /// Hangs the bones on each other as the hierarchy says, and an end on each bone that carries none.
    fn grow(&mut self, hierarchy: &[Line], mut bones: BTreeMap<String, Bone>) -> Result<(), Flaw> {
        for (line, words) in hierarchy {
            if matches!(words[0], "begin" | "end") {
                continue;
            }
            let Some(&parent) = self.by_name.get(words[0]) else {
                return flaw(
                    *line,
                    format!("bone `{}` hangs on nothing so far", words[0]),
                );
            };
            for name in &words[1..] {
                let Some(bone) = bones.remove(*name) else {
                    return flaw(
                        *line,
                        format!("bone `{name}` is not in :bonedata, or hangs twice"),
                    );
                };
                let offset = self.bones[parent]
                    .as_ref()
                    .map_or_else(Vector3::zeros, |b| b.vector);
                let node = self.tree.add(name, Some(parent), offset);
                self.bones.push(Some(bone));
                self.by_name.insert((*name).to_owned(), node);
            }
        }
        for node in 1..self.tree.nodes.len() {
            let carries = self
                .tree
                .nodes
                .iter()
                .any(|other| other.parent == Some(node));
            if let (false, Some(bone)) = (carries, &self.bones[node]) {
                let (name, vector) = (format!("^{}", self.tree.nodes[node].name), bone.vector);
                self.tree.add(&name, Some(node), vector);
                self.bones.push(None);
            }
        }
        Ok(())
    }
}

/// Degrees per angle unit, and the length factor.
fn units(lines: &[Line]) -> Result<(f64, f64), Flaw> {
    let (mut degrees, mut length) = (1.0, 1.0);
    for (line, words) in lines {
        match words[..] {
            ["length", value] => length = number(*line, value)?,
            ["angle", "deg"] => degrees = 1.0,
            ["angle", "rad"] => degrees = 1f64.to_degrees(),
            ["angle", other] => {
                return flaw(
                    *line,
                    format!("expected angles in `deg` or `rad`, found `{other}`"),
                );
            }
            _ => {}
        }
        if length <= 0.0 {
            return flaw(*line, format!("expected a length above 0, found {length}"));
        }
    }
    Ok((degrees, length))
}

fn root(lines: &[Line], degrees: f64) -> Result<Bone, Flaw> {
    let mut bone = Bone {
        vector: Vector3::zeros(),
        axes: UnitQuaternion::identity(),
        freedoms: Vec::new(),
    };
    let (mut order, mut orientation) = ("XYZ", vec![0.0; 3]);
    for (line, words) in lines {
        match words[0] {
            "order" => bone.freedoms = freedoms(*line, &words[1..])?,
            "axis" if words.len() == 2 => order = words[1],
            "orientation" => orientation = numbers(*line, &words[1..], 3)?,
            _ => {}
        }
    }
    let line = lines.first().map_or(1, |(line, _)| *line);
    bone.axes = turned(line, order, &orientation, degrees)?;
    if bone.freedoms.is_empty() {
        return flaw(
            line,
            "expected an `order` of the root's channels, found none",
        );
    }
    Ok(bone)
}

fn bones(lines: &[Line], degrees: f64) -> Result<BTreeMap<String, Bone>, Flaw> {
    let mut bones = BTreeMap::new();
    let mut name = None;
    let (mut direction, mut length) = (None, None);
    let mut bone = None;
    for (line, words) in lines {
        let fresh = || Bone {
            vector: Vector3::zeros(),
            axes: UnitQuaternion::identity(),
            freedoms: Vec::new(),
        };
        match (words[0], &mut bone) {
            ("begin", None) => {
                bone = Some(fresh());
                (name, direction, length) = (None, None, None);
            }
            ("name", Some(_)) if words.len() == 2 => name = Some(words[1].to_owned()),
            ("direction", Some(_)) => {
                direction = Some(Vector3::from_column_slice(&numbers(*line, &words[1..], 3)?));
            }
            ("length", Some(_)) => length = Some(numbers(*line, &words[1..], 1)?[0]),
            ("axis", Some(bone)) if words.len() == 5 => {
                let angles = numbers(*line, &words[1..4], 3)?;
                bone.axes = turned(*line, words[4], &angles, degrees)?;
            }
            ("dof", Some(bone)) => bone.freedoms = freedoms(*line, &words[1..])?,
            ("end", Some(finished)) => {
                let (Some(name), Some(direction), Some(length)) = (name.take(), direction, length)
                else {
                    return flaw(
                        *line,
                        "the bone that ends here lacks its name, direction or length",
                    );
                };
                finished.vector = direction.try_normalize(1e-9).unwrap_or_default() * length;
                bones.insert(name, finished.clone());
                bone = None;
            }
            ("begin", Some(_)) => return flaw(*line, "`begin` before the last bone's `end`"),
            (_, None) => return flaw(*line, format!("`{}` outside of a bone", words.join(" "))),
            _ => {}
        }
    }
    Ok(bones)
}

fn freedoms(line: usize, words: &[&str]) -> Result<Vec<Freedom>, Flaw> {
    let freedom = |word: &&str| match word.to_ascii_lowercase().as_str() {
        "tx" => Ok(Freedom::Move(0)),
        "ty" => Ok(Freedom::Move(1)),
        "tz" => Ok(Freedom::Move(2)),
        "rx" => Ok(Freedom::Turn(0)),
        "ry" => Ok(Freedom::Turn(1)),
        "rz" => Ok(Freedom::Turn(2)),
        "l" => Ok(Freedom::Length),
        other => flaw(
            line,
            format!("expected tx, ty, tz, rx, ry, rz or l, found `{other}`"),
        ),
    };
    words.iter().map(freedom).collect()
}

/// The rotation by three angles about x, y, z, applied in `order`, e.g. `XYZ`: x first.
fn turned(
    line: usize,
    order: &str,
    angles: &[f64],
    degrees: f64,
) -> Result<UnitQuaternion<f64>, Flaw> {
    let mut rotation = UnitQuaternion::identity();
    if order.len() != 3 {
        return flaw(line, format!("expected an order like XYZ, found `{order}`"));
    }
    for (letter, angle) in order.chars().zip(angles) {
        let axis = match letter {
            'X' | 'x' => 0,
            'Y' | 'y' => 1,
            'Z' | 'z' => 2,
            _ => return flaw(line, format!("expected an order like XYZ, found `{order}`")),
        };
        rotation = about(axis, angle * degrees) * rotation;
    }
    Ok(rotation)
}
