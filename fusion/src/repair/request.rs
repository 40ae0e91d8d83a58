//! Models that run outside the engine: which there is, what it is asked, and what it answers.
//!
//! The engine never waits for one by itself. It puts out a [`RepairRequest`], holds the frame back, and goes on with the
//! [`RepairAnswer`] that comes as an input, or with its own simple model once the deadline has passed. So a recorded take
//! replays to the same bytes whatever ran, and without the model being there.

use std::ops::Range;

use posefuse_skeleton::{JointMap, Timestamp, TrackId};
use serde::{Deserialize, Serialize};

use super::{Fill, Needs, Window};

/// A model outside the engine that answers requests from now on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepairModel {
    /// Its name, as in `repair.model`. The engine asks it if the configuration says `auto` or this name.
    pub name: String,
    /// The windows it gets.
    pub needs: Needs,
}

/// A window to be filled by the model outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepairRequest {
    /// Counts up from 1; the answer carries it.
    pub number: u64,
    /// Whose window it is.
    pub track: TrackId,
    /// The frame's time.
    pub time: Timestamp,
    /// When it was asked, in the engine's time. Who answers at once says that it was received then.
    pub asked: Timestamp,
    /// From then on the engine goes on without the answer.
    pub deadline: Timestamp,
    /// As many poses as the model needs.
    pub window: Window,
    /// The poses of the window to be filled.
    pub wanted: Range<usize>,
}

impl RepairRequest {
    /// The answer to this request, given at once; `fills` is empty where the model failed.
    pub fn answer(&self, fills: Vec<JointMap<Fill>>) -> RepairAnswer {
        RepairAnswer {
            number: self.number,
            received: self.asked,
            fills,
        }
    }
}

/// What the model outside answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepairAnswer {
    /// Of the request.
    pub number: u64,
    /// When the answer came.
    pub received: Timestamp,
    /// For each wanted pose what was made up. Empty, or of another length than was wanted: the model failed.
    pub fills: Vec<JointMap<Fill>>,
}
