//! FBX 7.4, binary: a rig in its T-pose, a plain figure bound to it, a key for every frame.
//!
//! Y up, a person of the rest pose faces +Z, X is their left; the unit is told by `UnitScaleFactor` (centimetres). Angles in
//! degrees in the format's default order (`R = Rz Ry Rx`). Keys hold cubic curves with slopes. Where the person was not
//! seen, the last pose stays; before the first one, that one. One person a file: what retargeting tools expect. Held in
//! memory until the end: 4 bytes a number, some 0.3 kB a frame.

mod curve;
mod document;
mod scene;

use std::io;

use nalgebra::Vector3;
use posefuse_kinematics::RigPose;

use self::document::{Attribute::*, Document};
use super::tree::Tree;
use super::{Moment, Out, Sheet, Sink};
use crate::euler::{self, Angles};

/// The order in which angles are found: outermost first. Files list them as X, Y, Z.
const ORDER: [usize; 3] = [2, 1, 0];
/// The identification that belongs to the footer which the writer gives, and the time that belongs to both.
const FILE_ID: [u8; 16] = [
    0x28, 0xb3, 0x2a, 0xeb, 0xb6, 0x24, 0xcc, 0xc2, 0xbf, 0xc8, 0xb0, 0x2a, 0xa9, 0x2b, 0xfc, 0xf1,
];
const FILE_TIME: &str = "1970-01-01 10:00:00:000";
const CREATOR: &str = concat!("posefuse export ", env!("CARGO_PKG_VERSION"));

pub(super) struct Fbx<'a> {
    sheet: Sheet<'a>,
    out: Out,
    /// The root's place, by axis, one a frame, file units.
    places: [Vec<f32>; 3],
    /// For each bone that turns its angles by axis, one a frame.
    turns: Vec<Turn>,
    /// Frames before the first pose.
    waiting: u64,
}

/// A bone's angles.
struct Turn {
    bone: usize,
    last: Option<Angles>,
    keys: [Vec<f32>; 3],
}

impl<'a> Fbx<'a> {
    pub(super) fn begin(sheet: Sheet<'a>, out: Out) -> io::Result<Self> {
        let rig = sheet.rig(0)?;
        let tree = Tree::of(rig);
        let turning = (0..rig.bones.len()).filter(|bone| !tree.is_end(*bone));
        let turn = |bone| Turn {
            bone,
            last: None,
            keys: Default::default(),
        };
        let turns = turning.map(turn).collect();
        Ok(Self {
            sheet,
            out,
            places: Default::default(),
            turns,
            waiting: 0,
        })
    }

    fn take_in(&mut self, pose: &RigPose) {
        let space = self.sheet.space;
        let root: Vector3<f64> = space.vector(pose.root.vector());
        for (keys, value) in self.places.iter_mut().zip(root.iter()) {
            keys.push(*value as f32);
        }
        for turn in &mut self.turns {
            let turned = space.axes.rotation(&pose.rotations[turn.bone]);
            let angles = euler::angles(ORDER, &turned, turn.last);
            turn.last = Some(angles);
            let [z, y, x] = angles;
            for (keys, angle) in turn.keys.iter_mut().zip([x, y, z]) {
                keys.push(angle as f32);
            }
        }
    }

    /// The last frame once more.
    fn hold(&mut self) {
        let keys = self.turns.iter_mut().flat_map(|turn| &mut turn.keys);
        for keys in self.places.iter_mut().chain(keys) {
            let last = keys.last().copied();
            keys.extend(last);
        }
    }
}

impl Sink for Fbx<'_> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        match moment.pose_of(self.sheet.people[0]) {
            Some(pose) => {
                self.take_in(pose);
                // What came before the first pose has that one, too.
                (0..std::mem::take(&mut self.waiting)).for_each(|_| self.hold());
            }
            None if self.places[0].is_empty() => self.waiting += 1,
            None => self.hold(),
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        if self.places[0].is_empty() {
            return Err(super::never_seen());
        }
        let Self {
            sheet,
            out,
            places,
            turns,
            ..
        } = *self;
        let mut document = Document::new(out)?;
        head(&mut document, &sheet)?;
        scene::write(&mut document, &sheet, &places, &turns)?;
        document.connections()?;
        takes(&mut document, &sheet)?;
        document.finish()
    }
}

/// What comes before the objects.
fn head(document: &mut Document, sheet: &Sheet) -> io::Result<()> {
    document.node("FBXHeaderExtension", &[], |document| {
        document.leaf("FBXHeaderVersion", &[Int(1003)])?;
        document.leaf("FBXVersion", &[Int(7400)])?;
        document.leaf("EncryptionType", &[Int(0)])?;
        time_stamp(document, sheet)?;
        document.leaf("Creator", &[Text(CREATOR)])?;
        let info = "GlobalInfo\0\u{1}SceneInfo";
        document.node("SceneInfo", &[Text(info), Text("UserData")], |document| {
            document.leaf("Type", &[Text("UserData")])?;
            document.leaf("Version", &[Int(100)])?;
            let comment = format!(
                "capture begins {}, {:.6} s after the take's start",
                sheet.plan.civil(sheet.first),
                sheet.plan.seconds(sheet.first)
            );
            document.node("MetaData", &[], |document| {
                document.leaf("Version", &[Int(100)])?;
                document.leaf("Title", &[Text(&sheet.plan.header.name)])?;
                document.leaf("Subject", &[Text(&sheet.plan.header.slate)])?;
                document.leaf("Author", &[Text("")])?;
                document.leaf("Keywords", &[Text("")])?;
                document.leaf("Revision", &[Text("")])?;
                document.leaf("Comment", &[Text(&comment)])
            })
        })
    })?;
    document.leaf("FileId", &[Bytes(&FILE_ID)])?;
    document.leaf("CreationTime", &[Text(FILE_TIME)])?;
    document.leaf("Creator", &[Text(CREATOR)])?;
    settings(document, sheet)?;
    let scene = document.id();
    document.node("Documents", &[], |document| {
        document.leaf("Count", &[Int(1)])?;
        document.node(
            "Document",
            &[Long(scene), Text("Scene"), Text("Scene")],
            |document| document.leaf("RootNode", &[Long(0)]),
        )
    })?;
    document.leaf("References", &[])
}

/// Civil time of the first frame, UTC.
fn time_stamp(document: &mut Document, sheet: &Sheet) -> io::Result<()> {
    let Some(at) = sheet.plan.civil_parts(sheet.first) else {
        return Ok(());
    };
    let names = [
        "Year",
        "Month",
        "Day",
        "Hour",
        "Minute",
        "Second",
        "Millisecond",
    ];
    document.node("CreationTimeStamp", &[], |document| {
        document.leaf("Version", &[Int(1000)])?;
        let parts = names.iter().zip(at);
        parts
            .into_iter()
            .try_for_each(|(name, part)| document.leaf(name, &[Int(part)]))
    })
}

/// Axes, unit and time.
fn settings(document: &mut Document, sheet: &Sheet) -> io::Result<()> {
    let rate = sheet.plan.grid.rate_hz;
    // The format counts a unit in centimetres.
    let scale = 100.0 / sheet.space.unit.per_metre();
    let stop = curve::tick(sheet.frames() - 1, rate);
    document.node("GlobalSettings", &[], |document| {
        document.leaf("Version", &[Int(1000)])?;
        document.properties(|document| {
            for (name, value) in [
                ("UpAxis", 1),
                ("UpAxisSign", 1),
                ("FrontAxis", 2),
                ("FrontAxisSign", 1),
                ("CoordAxis", 0),
                ("CoordAxisSign", 1),
                ("OriginalUpAxis", 1),
                ("OriginalUpAxisSign", 1),
            ] {
                document.property([name, "int", "Integer", ""], &[Int(value)])?;
            }
            for (name, value) in [
                ("UnitScaleFactor", scale),
                ("OriginalUnitScaleFactor", scale),
                ("CustomFrameRate", rate),
            ] {
                document.property([name, "double", "Number", ""], &[Double(value)])?;
            }
            document.property(["TimeMode", "enum", "", ""], &[Int(time_mode(rate))])?;
            document.property(["TimeSpanStart", "KTime", "Time", ""], &[Long(0)])?;
            document.property(["TimeSpanStop", "KTime", "Time", ""], &[Long(stop)])
        })
    })
}

/// The format's number for a frame rate; 14 for one that it has none for.
fn time_mode(rate_hz: f64) -> i32 {
    let modes = [
        (120.0, 1),
        (100.0, 2),
        (60.0, 3),
        (50.0, 4),
        (48.0, 5),
        (30.0, 6),
        (25.0, 10),
        (24.0, 11),
    ];
    modes
        .iter()
        .find(|(rate, _)| *rate == rate_hz)
        .map_or(14, |(_, mode)| *mode)
}

fn takes(document: &mut Document, sheet: &Sheet) -> io::Result<()> {
    let (name, stop) = (
        &sheet.plan.header.name,
        curve::tick(sheet.frames() - 1, sheet.plan.grid.rate_hz),
    );
    document.node("Takes", &[], |document| {
        document.leaf("Current", &[Text(name)])?;
        document.node("Take", &[Text(name)], |document| {
            document.leaf("FileName", &[Text(&format!("{name}.tak"))])?;
            document.leaf("LocalTime", &[Long(0), Long(stop)])?;
            document.leaf("ReferenceTime", &[Long(0), Long(stop)])
        })
    })
}
