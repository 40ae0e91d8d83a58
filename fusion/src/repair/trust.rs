//! How far what the filter says of a joint is a measurement.
//!
//! A tracker guesses joints that it does not see, and its guesses are off for as long as the joint stays hidden. A filter that
//! averages them grows sure of them; here the doubt grows with the time since somebody saw the joint with trust.

use posefuse_skeleton::{JOINT_COUNT, Joint, Provenance, Room, Skeleton, Timestamp};
use serde::{Deserialize, Serialize};

use super::history::weight_of;

/// By how much more a guess is off than the filter says: so much for each second without a trusted measurement, m/s, and
/// no more than this, metres.
const DOUBT_MPS: f64 = 0.3;
const MOST_DOUBT_M: f64 = 0.08;

/// What is carried on from the past is known to the model too: so much less is it worth beside it, and nothing after this
/// time, seconds.
const SHARED_PAST: f64 = 2.0;
const CARRIED_S: f64 = 0.3;

/// When each joint was last measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Trust {
    /// However weakly.
    measured: [Option<Timestamp>; JOINT_COUNT],
    /// With trust.
    trusted: [Option<Timestamp>; JOINT_COUNT],
}

/// What is to be thought of a joint of one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Standing {
    /// How far it is measured, 0..=1.
    pub(super) weight: f64,
    /// What its covariance does not say, metres.
    pub(super) unsaid_m: f64,
    /// When it was last measured, however weakly.
    pub(super) measured: Option<Timestamp>,
}

impl Standing {
    /// How much what is known of it at `time` is worth beside a model, 0..=1.
    pub(super) fn worth(&self, time: Timestamp) -> f64 {
        if self.weight > 0.0 {
            return 1.0;
        }
        let age_s = self.measured.map(|seen| time.since_seconds(seen));
        let left = 1.0 - age_s.map_or(1.0, |age_s| age_s / CARRIED_S);
        left.max(0.0) / SHARED_PAST
    }
}

impl Trust {
    pub(super) fn none() -> Self {
        Self {
            measured: [None; JOINT_COUNT],
            trusted: [None; JOINT_COUNT],
        }
    }

    /// Takes the next pose in, and says what is to be thought of its joints.
    pub(super) fn note(
        &mut self,
        time: Timestamp,
        skeleton: &Skeleton<Room>,
    ) -> [Standing; JOINT_COUNT] {
        std::array::from_fn(|index| {
            let state = skeleton[Joint::ALL[index]].as_ref();
            if state.is_some_and(|state| matches!(state.provenance, Provenance::Measured(_))) {
                self.trusted[index] = Some(time);
            }
            let unsaid_m = self.trusted[index].map_or(MOST_DOUBT_M, |trusted| {
                (time.since_seconds(trusted) * DOUBT_MPS).clamp(0.0, MOST_DOUBT_M)
            });
            let weight = state.map_or(0.0, |state| weight_of(state, unsaid_m));
            if weight > 0.0 {
                self.measured[index] = Some(time);
            }
            Standing {
                weight,
                unsaid_m,
                measured: self.measured[index],
            }
        })
    }
}
