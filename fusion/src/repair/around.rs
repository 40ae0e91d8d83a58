//! What repair is told from around it, what it gives, and its account of itself.

use posefuse_skeleton::{RoomFrame, Timestamp};
use serde::{Deserialize, Serialize};

use super::person::Joints;
use super::{RepairConfig, RepairRequest};

/// What repair has done since the engine's start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RepairCounts {
    /// Joints of frames that were made up in whole or in part.
    pub joints: u64,
    /// People of frames that had such joints.
    pub poses: u64,
    /// Windows given to the model outside.
    pub asked: u64,
    /// Its answers that were used.
    pub answered: u64,
    /// Its answers that said that it failed, or made no sense.
    pub failed: u64,
    /// Windows that the simple model filled because the answer had not come in time.
    pub late: u64,
    /// Answers to nothing that was still open.
    pub unknown: u64,
}

/// Where finished frames and requests go.
pub(crate) trait Outlet {
    fn frame(&mut self, frame: RoomFrame);
    fn request(&mut self, request: RepairRequest);
}

/// What is the same for one call.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Circumstances<'a> {
    pub(crate) config: &'a RepairConfig,
    /// The engine's time.
    pub(crate) now: Timestamp,
    /// The joints that the sensors' trackers have.
    pub(crate) known: Joints,
    /// Frames may wait for later ones.
    pub(crate) offline: bool,
}
