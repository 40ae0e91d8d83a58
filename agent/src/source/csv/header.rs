//! Where in a line of the recording each thing stands.
//!
//! Columns are found by name. Spellings differ between files: `Study` or `Study_Id`, `Person#` or `Person_Id`,
//! `tracker_time` or `Tracker_Time`; so case, `_` and `#` do not count, and an `Id` at the end may be there or not.

use posefuse_skeleton::{JOINT_COUNT, Joint};

/// Columns, as indices into the cells of a line.
#[derive(Clone, Debug)]
pub(super) struct Header {
    pub(super) tracker_time: usize,
    pub(super) person: usize,
    pub(super) skeleton: usize,
    pub(super) skeleton_time: usize,
    pub(super) kinect: usize,
    /// X, Y and Z of each canonical joint.
    pub(super) joints: [[usize; 3]; JOINT_COUNT],
    /// How many columns there are.
    pub(super) width: usize,
}

fn plain(name: &str) -> String {
    name.chars()
        .filter(|c| c.is_ascii_alphanumeric())
        .collect::<String>()
        .to_ascii_lowercase()
}

impl Header {
    /// Reads the first line (without its byte-order mark). The error says which column is missing or doubled.
    pub(super) fn read(line: &str) -> Result<Self, String> {
        let names: Vec<String> = line.split(',').map(plain).collect();
        let column = |wanted: &str| {
            let key = plain(wanted);
            let matches = |name: &String| *name == key || name.strip_suffix("id") == Some(&key);
            let mut found = names.iter().enumerate().filter(|(_, name)| matches(name));
            match (found.next(), found.next()) {
                (Some((index, _)), None) => Ok(index),
                (None, _) => Err(format!(
                    "the header has no column `{wanted}`; expected the columns of a two-Kinect recording, \
                     e.g. Tracker_Time, Person#, Skeleton#, Skeleton_Time, Kinect#, AnkleLeft_X"
                )),
                (Some(_), Some(_)) => Err(format!("the header has column `{wanted}` twice")),
            }
        };
        let mut joints = [[0; 3]; JOINT_COUNT];
        for joint in Joint::ALL {
            for (axis, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
                joints[joint as usize][axis] = column(&format!("{joint}_{letter}"))?;
            }
        }
        Ok(Self {
            tracker_time: column("Tracker_Time")?,
            person: column("Person")?,
            skeleton: column("Skeleton")?,
            skeleton_time: column("Skeleton_Time")?,
            kinect: column("Kinect")?,
            joints,
            width: names.len(),
        })
    }
}
