//! The frames of now beside the recorded ones.

use std::iter::Peekable;

use posefuse_proto::room_frame_to_wire;
use posefuse_skeleton::{RoomFrame, Timestamp};
use prost::Message;

use super::FrameDifference;
use crate::{Entries, Entry, Recorded, Result};

/// Compares frame by frame, in order.
pub(super) struct Comparison {
    recorded: Peekable<Entries>,
    recorded_frames: u64,
    frames: u64,
    lacking: u64,
    lacking_at_most: u64,
    first_difference: Option<FrameDifference>,
    /// Input after which the first frame came that the old take has not; it has all before.
    surplus_after: Option<u64>,
}

/// What the comparison gave.
pub(super) struct Compared {
    pub(super) recorded_frames: u64,
    pub(super) frames: u64,
    pub(super) lacking: u64,
    pub(super) first_difference: Option<FrameDifference>,
}

impl Comparison {
    /// `lacking_at_most`: how many frames may have been dropped when the take was recorded.
    pub(super) fn with(recorded: Entries, lacking_at_most: u64) -> Self {
        Self {
            recorded: recorded.peekable(),
            recorded_frames: 0,
            frames: 0,
            lacking: 0,
            lacking_at_most,
            first_difference: None,
            surplus_after: None,
        }
    }

    /// The next frame, which came after so many inputs.
    pub(super) fn frame(&mut self, frame: &RoomFrame, inputs: u64) -> Result<()> {
        let after = self.frames - self.lacking;
        self.frames += 1;
        if self.recording_lacks(frame) {
            self.lacking += 1;
            return Ok(());
        }
        let recorded = self.recorded.next().transpose()?;
        match &recorded {
            Some(_) => self.recorded_frames += 1,
            None => {
                self.surplus_after.get_or_insert(inputs);
            }
        }
        let bytes = room_frame_to_wire(frame).encode_to_vec();
        if recorded.as_ref().is_none_or(|entry| entry.bytes != bytes) {
            self.first_difference
                .get_or_insert_with(|| FrameDifference {
                    after,
                    recorded: recorded.as_ref().and_then(number_of),
                    found: Some((frame.time, frame.number)),
                });
        }
        Ok(())
    }

    fn recording_lacks(&mut self, frame: &RoomFrame) -> bool {
        let is_later = |entry: &Result<Entry>| match entry {
            Ok(entry) => number_of(entry).is_some_and(|(_, number)| number > frame.number),
            Err(_) => false,
        };
        self.lacking < self.lacking_at_most && self.recorded.peek().is_none_or(is_later)
    }

    /// The result after the last of so many inputs.
    pub(super) fn finish(mut self, inputs: u64) -> Result<Compared> {
        let after = self.frames - self.lacking;
        for entry in self.recorded {
            let entry = entry?;
            self.recorded_frames += 1;
            self.first_difference.get_or_insert(FrameDifference {
                after,
                recorded: number_of(&entry),
                found: None,
            });
        }
        // A take that was cut off may lack the last input's frames, and no others.
        if self.surplus_after == Some(inputs) {
            self.first_difference = self
                .first_difference
                .filter(|first| first.recorded.is_some());
        }
        Ok(Compared {
            recorded_frames: self.recorded_frames,
            frames: self.frames,
            lacking: self.lacking,
            first_difference: self.first_difference,
        })
    }
}

fn number_of(entry: &Entry) -> Option<(Timestamp, u64)> {
    match entry.decode() {
        Ok(Recorded::Frame(frame)) => Some((frame.time, frame.number)),
        _ => None,
    }
}
