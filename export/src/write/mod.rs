//! Writers, one a format. Each gets the moments of its range in order, then is finished.

mod bones;
mod bvh;
mod c3d;
mod csv;
mod fbx;
mod figure;
mod glb;
mod parquet;
mod trc;
mod tree;

use std::fs::File;
use std::io::{self, BufWriter};

use posefuse_kinematics::{HandState, Rig, RigPose};
use posefuse_skeleton::{Joint, Room, Skeleton};

use crate::format::Format;
use crate::plan::Plan;
use crate::space::Space;
use crate::{Names, Who};

pub(crate) type Out = BufWriter<File>;

/// One person at one instant.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Figure {
    /// The index in [`Plan::people`].
    pub(crate) person: usize,
    /// What was measured; joints of gaps are missing.
    pub(crate) skeleton: Skeleton<Room>,
    /// Whether the left and the right hand is closed; `None` while nobody said anything of it.
    pub(crate) hands: [Option<HandState>; 2],
    /// The same as a pose of the person's rig, where one is asked for.
    pub(crate) pose: Option<RigPose>,
}

impl Figure {
    /// The state of the hand (0 left, 1 right) in a word; empty while nothing is known of it.
    fn hand(&self, side: usize) -> &'static str {
        match self.hands[side] {
            Some(HandState { closed: true, .. }) => "closed",
            Some(_) => "open",
            None => "",
        }
    }

    /// The same for the joint of a hand; empty for all others.
    fn hand_of(&self, joint: Joint) -> &'static str {
        match joint {
            Joint::HandLeft => self.hand(0),
            Joint::HandRight => self.hand(1),
            _ => "",
        }
    }
}

/// Everybody at one instant.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moment {
    /// The frame's number in [`Plan::grid`].
    pub(crate) frame: u64,
    /// Those who are there, in the order of [`Plan::people`].
    pub(crate) people: Vec<Figure>,
}

impl Moment {
    /// A person's figure, if they are there.
    fn figure(&self, person: usize) -> Option<&Figure> {
        self.people.iter().find(|figure| figure.person == person)
    }

    /// The pose of a person's rig, if there is one.
    fn pose_of(&self, person: usize) -> Option<&RigPose> {
        self.figure(person)?.pose.as_ref()
    }
}

/// What a writer needs to know before the first moment.
pub(crate) struct Sheet<'a> {
    pub(crate) plan: &'a Plan,
    /// For each person of the plan the rig, where rigs are asked for.
    pub(crate) rigs: &'a [Option<Rig>],
    /// The people of this file: indices in [`Plan::people`].
    pub(crate) people: Vec<usize>,
    /// The first and the last frame of this file.
    pub(crate) first: u64,
    pub(crate) last: u64,
    pub(crate) space: Space,
    pub(crate) names: Names,
}

impl Sheet<'_> {
    /// How many frames the file has.
    pub(crate) fn frames(&self) -> u64 {
        self.last - self.first + 1
    }

    /// The rig of a person of this file: an index in [`Sheet::people`].
    fn rig(&self, index: usize) -> io::Result<&Rig> {
        let rig = self.rigs[self.people[index]].as_ref();
        rig.ok_or_else(never_seen)
    }

    /// Whose motion the file has, in order.
    pub(crate) fn who(&self) -> impl Iterator<Item = &Who> {
        self.people
            .iter()
            .map(|&person| &self.plan.people[person].who)
    }
}

/// A file that is being written.
pub(crate) trait Sink {
    /// Takes in the next frame of the file's range.
    fn moment(&mut self, moment: &Moment) -> io::Result<()>;

    /// Writes what comes last, and makes sure that everything has gone to the system.
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// A writer for a format.
pub(crate) fn open<'a>(
    format: Format,
    sheet: Sheet<'a>,
    out: Out,
) -> io::Result<Box<dyn Sink + 'a>> {
    Ok(match format {
        Format::Csv => Box::new(csv::Csv::begin(sheet, csv::Layout::Wide, out)?),
        Format::CsvTidy => Box::new(csv::Csv::begin(sheet, csv::Layout::Tidy, out)?),
        Format::CsvBones => Box::new(bones::Bones::begin(sheet, out)?),
        Format::Parquet => Box::new(parquet::Parquet::begin(sheet, out)?),
        Format::Trc => Box::new(trc::Trc::begin(sheet, out)?),
        Format::C3d => Box::new(c3d::C3d::begin(sheet, out)?),
        Format::Bvh => Box::new(bvh::Bvh::begin(sheet, out)?),
        Format::Glb => Box::new(glb::Glb::begin(sheet, out)?),
        Format::Fbx => Box::new(fbx::Fbx::begin(sheet, out)?),
    })
}

/// Why there is no pose to write, and what to do.
pub(crate) const NEVER_SEEN: &str = "no trunk is ever seen, so there is no pose of a rig; export joints (csv, trc, c3d) or other people";

fn never_seen() -> io::Error {
    io::Error::other(NEVER_SEEN)
}
