//! Recorded motion that teaches, at 30 Hz, in pieces without jumps.

use std::error::Error;
use std::path::Path;

use nalgebra::Vector3;
use posefuse_evaluate::repair::Split;
use posefuse_simulator::load::{find, load};
use posefuse_skeleton::{JOINT_COUNT, Joint};

/// All joints of one instant, room metres.
pub(crate) type Pose = [Vector3<f64>; JOINT_COUNT];

const RATE_HZ: f64 = 30.0;
/// Nothing of a person moves faster; what does is a jump of the recording, m/s.
const MAX_SPEED_MPS: f64 = 12.0;

/// Every piece of the recordings below `folder` that teach, in order of their paths.
pub(crate) fn pieces(folder: &Path) -> Result<Vec<Vec<Pose>>, Box<dyn Error>> {
    let split = Split::shipped()?;
    let mut pieces = Vec::new();
    for file in find(folder)? {
        let place = file.strip_prefix(folder)?.to_string_lossy().into_owned();
        // The patterns begin below some folder; the recordings may lie in FOLDER itself.
        if split.tests(&format!("/{place}")).is_some() {
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
    eprintln!("{} pieces, {minutes:.1} minutes", pieces.len());
    Ok(pieces)
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
