//! A frame on its way out of the engine, and what is known of the answers that it waits for.

use posefuse_skeleton::{JointMap, RoomFrame, Timestamp};
use serde::{Deserialize, Serialize};

use super::Fill;
use super::blend::Source;
use super::person::Joints;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Waiting {
    pub(super) frame: RoomFrame,
    /// By the frame's tracks.
    pub(super) gaps: Vec<Joints>,
    pub(super) asked: bool,
    /// By the frame's tracks; empty until asked.
    pub(super) answers: Vec<Answer>,
    /// Nothing that comes later is waited for.
    pub(super) last: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Answer {
    /// Nothing is missing, or nothing can be said.
    None,
    Open {
        number: u64,
        deadline: Timestamp,
    },
    /// The simple model has to stand in.
    Failed,
    Filled {
        fills: Box<JointMap<Fill>>,
        source: Source,
    },
}

impl Waiting {
    pub(super) fn is_ready(&self) -> bool {
        let ready = |answer| matches!(answer, &Answer::None | &Answer::Filled { .. });
        self.asked && self.answers.iter().all(ready)
    }

    pub(super) fn open(&self) -> impl Iterator<Item = (u64, Timestamp)> {
        self.answers.iter().filter_map(|answer| match answer {
            Answer::Open { number, deadline } => Some((*number, *deadline)),
            Answer::None | Answer::Failed | Answer::Filled { .. } => None,
        })
    }
}
