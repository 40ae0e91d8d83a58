//! What is said of hands being open or closed, counted.

use posefuse_bodytrack::TrackedBody;
use posefuse_skeleton::Joint;
use serde::Serialize;

use super::tally::{Kind, Reliability};

/// Left and right.
pub(super) const HANDS: [Joint; 2] = [Joint::HandLeft, Joint::HandRight];

/// Votes on hands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Votes {
    /// Hands.
    pub hands: u64,
    /// Those on which there was a vote.
    pub voted: u64,
    /// Votes that were right.
    pub right: u64,
}

/// Hands of one kind of person.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HandKind {
    /// Hands that the sensor sees.
    pub seen: Votes,
    /// Hands in the image that something hides.
    pub hidden: Votes,
}

impl Votes {
    fn add(&mut self, right: Option<bool>) {
        self.hands += 1;
        self.voted += u64::from(right.is_some());
        self.right += u64::from(right == Some(true));
    }

    fn merge(&mut self, other: &Self) {
        self.hands += other.hands;
        self.voted += other.voted;
        self.right += other.right;
    }

    /// The share of hands that were voted on.
    pub fn voted_share(&self) -> Option<f64> {
        (self.hands > 0).then(|| self.voted as f64 / self.hands as f64)
    }

    /// The share of votes that were right.
    pub fn right_share(&self) -> Option<f64> {
        (self.voted > 0).then(|| self.right as f64 / self.voted as f64)
    }
}

impl HandKind {
    pub(super) fn merge(&mut self, other: &Self) {
        self.seen.merge(&other.seen);
        self.hidden.merge(&other.hidden);
    }
}

/// Counts the votes on somebody's hands. `closed`: the truth; `sees`: whether each is seen, `None` out of the image.
pub(super) fn count(
    kind: &mut Kind,
    reliability: &mut Reliability,
    body: &TrackedBody,
    closed: [bool; 2],
    sees: impl Fn(Joint) -> Option<bool>,
) {
    for side in 0..2 {
        let Some(seen) = sees(HANDS[side]) else {
            continue;
        };
        let said = body.hands_closed[side];
        let right = said.map(|said| (said > 0.5) == closed[side]);
        match seen {
            true => kind.hands.seen.add(right),
            false => kind.hands.hidden.add(right),
        }
        if let Some(said) = said {
            reliability.add(said, closed[side]);
        }
    }
}
