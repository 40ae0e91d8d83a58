//! BVH: the bones with their offsets, then a line of numbers a frame.
//!
//! Angles in degrees, about Z, X, Y in this order, each about the axes that the ones before left (`R = Rz Rx Ry`). The root's
//! offset is zero and its position channels say where it is, because readers differ on whether they add the two. In the
//! rest pose (a T-pose that faces ahead) every angle is zero. The format cannot tell that a person was not seen: then the
//! last pose stays, and before the first one, that one.

use std::io::{self, Write};

use nalgebra::Vector3;
use posefuse_kinematics::{Rig, RigPose};

use super::tree::Tree;
use super::{Moment, Out, Sheet, Sink};
use crate::euler::{self, Angles};

const ORDER: [usize; 3] = [2, 0, 1];
const ROTATIONS: &str = "Zrotation Xrotation Yrotation";
/// A millionth of a degree moves nothing by more than a micrometre.
const ANGLE_DECIMALS: usize = 6;

pub(super) struct Bvh<'a> {
    sheet: Sheet<'a>,
    /// The bones that turn, in the order of the file.
    turning: Vec<usize>,
    last: Vec<Option<Angles>>,
    line: Option<String>,
    /// Frames before the first pose.
    waiting: u64,
    out: Out,
}

impl<'a> Bvh<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, mut out: Out) -> io::Result<Self> {
        let rig = sheet.rig(0)?;
        let tree = Tree::of(rig);
        let mut turning = Vec::new();
        writeln!(out, "HIERARCHY")?;
        nest(&sheet, rig, &tree, tree.root, 0, &mut turning, &mut out)?;
        writeln!(out, "MOTION\nFrames: {}", sheet.frames())?;
        writeln!(out, "Frame Time: {:.9}", 1.0 / sheet.plan.grid.rate_hz)?;
        let last = vec![None; turning.len()];
        Ok(Self {
            sheet,
            turning,
            last,
            line: None,
            waiting: 0,
            out,
        })
    }

    fn pose_line(&mut self, pose: &RigPose) -> String {
        let space = self.sheet.space;
        let decimals = space.unit.decimals();
        let at = space.vector(pose.root.vector());
        let mut line = format!(
            "{:.decimals$} {:.decimals$} {:.decimals$}",
            at.x, at.y, at.z
        );
        for (bone, last) in self.turning.iter().zip(&mut self.last) {
            let turned = space.axes.rotation(&pose.rotations[*bone]);
            let angles = euler::angles(ORDER, &turned, *last);
            *last = Some(angles);
            for angle in angles {
                line += &format!(" {angle:.ANGLE_DECIMALS$}");
            }
        }
        line
    }
}

/// Writes a bone and what it carries.
fn nest(
    sheet: &Sheet,
    rig: &Rig,
    tree: &Tree,
    bone: usize,
    depth: usize,
    turning: &mut Vec<usize>,
    out: &mut Out,
) -> io::Result<()> {
    let indent = "\t".repeat(depth);
    let is_end = tree.is_end(bone);
    let name = sheet.names.of_bone(&rig.bones[bone].name);
    match (bone == tree.root, is_end) {
        (true, _) => writeln!(out, "{indent}ROOT {name}")?,
        (false, true) => writeln!(out, "{indent}End Site")?,
        (false, false) => writeln!(out, "{indent}JOINT {name}")?,
    }
    let offset = match bone == tree.root {
        true => Vector3::zeros(),
        false => sheet.space.vector(rig.bones[bone].offset),
    };
    let decimals = sheet.space.unit.decimals();
    writeln!(out, "{indent}{{")?;
    writeln!(
        out,
        "{indent}\tOFFSET {:.decimals$} {:.decimals$} {:.decimals$}",
        offset.x, offset.y, offset.z
    )?;
    if !is_end {
        turning.push(bone);
        match bone == tree.root {
            true => writeln!(
                out,
                "{indent}\tCHANNELS 6 Xposition Yposition Zposition {ROTATIONS}"
            )?,
            false => writeln!(out, "{indent}\tCHANNELS 3 {ROTATIONS}")?,
        }
    }
    for &child in &tree.children[bone] {
        nest(sheet, rig, tree, child, depth + 1, turning, out)?;
    }
    writeln!(out, "{indent}}}")
}

impl Sink for Bvh<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        let person = self.sheet.people[0];
        if let Some(pose) = moment.pose_of(person) {
            let line = self.pose_line(pose);
            for _ in 0..self.waiting {
                writeln!(self.out, "{line}")?;
            }
            self.waiting = 0;
            self.line = Some(line);
        }
        match &self.line {
            Some(line) => writeln!(self.out, "{line}"),
            None => {
                self.waiting += 1;
                Ok(())
            }
        }
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        if self.waiting > 0 {
            return Err(super::never_seen());
        }
        self.out.flush()
    }
}
