//! Recorded motion at 30 Hz, in pieces without jumps, by what it is for.

use std::error::Error;
use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use posefuse_simulator::load::{find, load};
use posefuse_skeleton::{JOINT_COUNT, Joint};
use serde::Deserialize;

/// All joints of one instant, room metres.
pub(crate) type Pose = [Vector3<f64>; JOINT_COUNT];

pub(crate) const RATE_HZ: f64 = 30.0;
/// Nothing of a person moves faster; what does is a jump of the recording, m/s.
const MAX_SPEED_MPS: f64 = 12.0;

/// What a recording is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    Training,
    HeldOut,
    Unseen,
}

/// `models/training/split.toml`.
#[derive(Deserialize)]
struct Split {
    held_out: Vec<String>,
    unseen: Vec<String>,
}

/// Every piece of the recordings of `part` below `folder`, in order of their paths.
pub(crate) fn pieces(folder: &Path, part: Part) -> Result<Vec<Vec<Pose>>, Box<dyn Error>> {
    let split = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/training/split.toml");
    let split: Split = toml::from_str(&fs::read_to_string(split)?)?;
    let mut pieces = Vec::new();
    for file in find(folder)? {
        let place = file.strip_prefix(folder)?.to_string_lossy().into_owned();
        if split.part(&place) != part {
            continue;
        }
        match load(&file) {
            Ok(clip) => {
                let count = (clip.duration_s() * RATE_HZ) as usize;
                let poses = (0..count).filter_map(|index| {
                    let pose = clip.pose(index as f64 / RATE_HZ);
                    let mut all = [Vector3::zeros(); JOINT_COUNT];
                    for joint in Joint::ALL {
                        all[joint as usize] = pose[joint]?.vector();
                    }
                    Some(all)
                });
                cut(poses, &mut pieces);
            }
            Err(error) => eprintln!("left out {place}: {error}"),
        }
    }
    let poses: usize = pieces.iter().map(Vec::len).sum();
    let minutes = poses as f64 / RATE_HZ / 60.0;
    eprintln!("{part:?}: {} pieces, {minutes:.1} minutes", pieces.len());
    Ok(pieces)
}

impl Split {
    fn part(&self, place: &str) -> Part {
        // The patterns begin below some folder; the recordings may lie in FOLDER itself.
        let place = format!("/{place}");
        let among = |patterns: &[String]| {
            patterns
                .iter()
                .any(|p| matches(p.as_bytes(), place.as_bytes()))
        };
        if among(&self.held_out) {
            Part::HeldOut
        } else if among(&self.unseen) {
            Part::Unseen
        } else {
            Part::Training
        }
    }
}

/// Whether `text` is what `pattern` means, with `*` for anything and `[a-z]` for one of a range.
fn matches(pattern: &[u8], text: &[u8]) -> bool {
    match (pattern, text) {
        ([], []) => true,
        ([b'*', rest @ ..], _) => {
            matches(rest, text) || !text.is_empty() && matches(pattern, &text[1..])
        }
        ([b'[', low, b'-', high, b']', rest @ ..], [first, more @ ..]) => {
            (low..=high).contains(&first) && matches(rest, more)
        }
        ([a, rest @ ..], [b, more @ ..]) => a == b && matches(rest, more),
        _ => false,
    }
}

/// Cuts at jumps.
fn cut(poses: impl Iterator<Item = Pose>, pieces: &mut Vec<Vec<Pose>>) {
    let mut piece: Vec<Pose> = Vec::new();
    for pose in poses {
        let jumped = piece.last().is_some_and(|last| {
            let moved = last.iter().zip(&pose).map(|(a, b)| (b - a).norm());
            moved.fold(0.0, f64::max) * RATE_HZ > MAX_SPEED_MPS
        });
        if jumped {
            pieces.push(std::mem::take(&mut piece));
        }
        piece.push(pose);
    }
    pieces.push(piece);
}
