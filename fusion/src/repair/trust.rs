//! How far what the filter says of a joint is a measurement.
//!
//! A tracker guesses joints that it does not see, and its guesses are off for as long as the joint stays hidden. A filter that
//! averages them grows sure of them; here the doubt grows with the time that nobody sees the joint with trust. Trackers are
//! sure of a guess now and then, so that the doubt goes as it came, little by little.

use posefuse_skeleton::{JOINT_COUNT, Joint, Provenance, Room, Skeleton, Timestamp};
use serde::{Deserialize, Serialize};

use super::history::weight_of;

/// By how much more a guess is off than the filter says: so much for each second without a trusted measurement, m/s, and
/// no more than this, metres; with trusted measurements so much less for each second, until so little is left that it is none.
const DOUBT_MPS: f64 = 0.3;
const MOST_DOUBT_M: f64 = 0.08;
const REGAINED_MPS: f64 = 0.18;
const LEAST_DOUBT_M: f64 = 0.005;

/// What is carried on from the past is known to the model too: so much less is it worth beside it, and nothing after this
/// time, seconds.
const SHARED_PAST: f64 = 2.0;
const CARRIED_S: f64 = 0.3;

/// What came of each joint so far.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Trust {
    /// When it was last measured, however weakly.
    measured: [Option<Timestamp>; JOINT_COUNT],
    /// Since when it has been measured with trust.
    trusted: [Option<Timestamp>; JOINT_COUNT],
    /// When it was last looked at, and by how much more it was off then than the filter says, metres.
    unsaid_m: [Option<(Timestamp, f64)>; JOINT_COUNT],
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
    /// For how long it has been measured with trust, seconds; `None` where it is not.
    pub(super) trusted_s: Option<f64>,
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
            unsaid_m: [None; JOINT_COUNT],
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
            let trusted =
                state.is_some_and(|state| matches!(state.provenance, Provenance::Measured(_)));
            let unsaid_m = match (self.unsaid_m[index], trusted) {
                (None, true) => 0.0,
                (None, false) => MOST_DOUBT_M,
                (Some((last, unsaid_m)), _) => changed(unsaid_m, trusted, time.since_seconds(last)),
            };
            self.unsaid_m[index] = Some((time, unsaid_m));
            self.trusted[index] = trusted.then(|| self.trusted[index].unwrap_or(time));
            let weight = state.map_or(0.0, |state| weight_of(state, unsaid_m));
            if weight > 0.0 {
                self.measured[index] = Some(time);
            }
            Standing {
                weight,
                unsaid_m,
                measured: self.measured[index],
                trusted_s: self.trusted[index].map(|since| time.since_seconds(since)),
            }
        })
    }
}

/// The doubt after a joint was seen with trust for so long, or was not.
fn changed(unsaid_m: f64, trusted: bool, elapsed_s: f64) -> f64 {
    let elapsed_s = elapsed_s.max(0.0);
    if !trusted {
        return (unsaid_m + elapsed_s * DOUBT_MPS).min(MOST_DOUBT_M);
    }
    let left_m = unsaid_m - elapsed_s * REGAINED_MPS;
    if left_m < LEAST_DOUBT_M { 0.0 } else { left_m }
}
