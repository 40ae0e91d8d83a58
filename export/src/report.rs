//! What an export made, for people and scripts.

use std::path::PathBuf;

use posefuse_skeleton::JOINT_COUNT;
use serde::Serialize;

use crate::Who;
use crate::format::Format;
use crate::plan::{Plan, Presence};

/// What an export made.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The take.
    pub take: String,
    /// Civil time of the take's start (UTC), RFC 3339.
    pub started: String,
    /// Frames per second of the files.
    pub rate_hz: f64,
    /// The people, in order.
    pub people: Vec<PersonReport>,
    /// How many more were seen for too short.
    pub passers_by: usize,
    /// Numbers that were asked for and nobody has in what is exported.
    pub absent: Vec<u64>,
    /// Who is in no file with a rig, because their trunk is never seen.
    pub without_rig: Vec<Who>,
    /// The files.
    pub files: Vec<FileReport>,
}

/// A person of an export.
#[derive(Clone, Debug, Serialize)]
pub struct PersonReport {
    /// Who, as in the files.
    pub person: Who,
    /// When they came, seconds since the take's start.
    pub from_s: f64,
    /// When they left.
    pub to_s: f64,
    /// From the one to the other.
    pub frames: u64,
    /// Frames among them in which no joint is known. A rig keeps its pose in them.
    pub frames_without: u64,
    /// The share of joints that are missing in the other frames.
    pub missing_share: f64,
}

/// A file of an export.
#[derive(Clone, Debug, Serialize)]
pub struct FileReport {
    /// Where it is.
    pub path: PathBuf,
    /// What it is.
    pub format: Format,
    /// Whose motion it has.
    pub people: Vec<Who>,
    /// When its first frame is, seconds since the take's start.
    pub from_s: f64,
    /// The same as civil time (UTC), RFC 3339.
    pub from_utc: String,
    /// The same as the room's timecode, and its rate; empty where the take has none.
    pub from_timecode: String,
    /// The timecode's rate: 24, 25, 29.97df, 30, 50 or 60.
    pub timecode_rate: String,
    /// How many frames it has.
    pub frames: u64,
    /// Its size.
    pub bytes: u64,
}

/// Counts what was known of a person.
#[derive(Clone, Default)]
pub(crate) struct Tally {
    frames_with: u64,
    joints: u64,
}

pub(crate) fn tallies(plan: &Plan) -> Vec<Tally> {
    vec![Tally::default(); plan.people.len()]
}

impl Tally {
    pub(crate) fn count(&mut self, joints: usize) {
        self.frames_with += 1;
        self.joints += joints as u64;
    }

    pub(crate) fn report(&self, plan: &Plan, person: &Presence) -> PersonReport {
        let frames = person.last - person.first + 1;
        let joints = self.frames_with * JOINT_COUNT as u64;
        PersonReport {
            person: person.who.clone(),
            from_s: plan.seconds(person.first),
            to_s: plan.seconds(person.last),
            frames,
            frames_without: frames - self.frames_with,
            missing_share: match joints {
                0 => 1.0,
                joints => 1.0 - self.joints as f64 / joints as f64,
            },
        }
    }
}
