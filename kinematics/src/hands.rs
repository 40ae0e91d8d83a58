//! Open or closed: what several sensors say of a hand, frame after frame, as one state that does not flicker.
//!
//! A hidden Markov model of two states (Rabiner 1989), filtered forwards. A hand opens and closes at a known rate; a vote
//! is right with a known share. Successive frames of one sensor repeat the same mistake, so of many votes in a short time
//! only as much counts as is news.

use posefuse_skeleton::{Confidence, HandVotes, Timestamp};

use crate::config::HandsConfig;

/// Whether a hand is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandState {
    /// What is most likely; changes only on clear evidence.
    pub closed: bool,
    /// The probability of being closed, 0 (surely open) to 1 (surely closed).
    pub closed_probability: f64,
}

/// One hand of one person.
#[derive(Clone, Debug)]
pub struct HandFilter {
    config: HandsConfig,
    last: Option<(Timestamp, HandState)>,
    /// When a sensor last said something.
    heard: Option<Timestamp>,
}

/// More sensors than this see no hand at once that differ in what they see.
const MOST_VOTES: usize = 8;
/// Nothing is ever surer than this.
const SUREST: f64 = 0.999;
/// Of the first vote, seconds since the one before.
const FIRST_S: f64 = 1.0 / 30.0;
/// After so long without a vote nothing is known any more, seconds.
const FORGOTTEN_S: f64 = 2.0;

impl HandFilter {
    /// A hand of which nothing is known.
    pub fn new(config: HandsConfig) -> Self {
        Self {
            config,
            last: None,
            heard: None,
        }
    }

    /// What is known now.
    pub fn state(&self) -> Option<HandState> {
        self.last.map(|(_, state)| state)
    }

    /// Takes in what a fused person's frame says of the hand.
    pub fn take(&mut self, votes: Option<&HandVotes>, at: Timestamp) {
        match votes {
            Some(votes) => {
                let many = usize::from(votes.sensors).min(MOST_VOTES);
                self.vote(&[votes.closed; MOST_VOTES][..many], at);
            }
            None => self.vote(&[], at),
        }
    }

    /// Takes in what sensors say at `at`: of each the probability that the hand is closed. Times must not go back; a vote
    /// from before the last one counts as one of the same time.
    ///
    /// ```
    /// use posefuse_kinematics::{HandFilter, HandsConfig};
    /// use posefuse_skeleton::{Confidence, HandVotes, Timestamp};
    ///
    /// let mut hand = HandFilter::new(HandsConfig::default());
    /// for frame in 0..30 {
    ///     hand.vote(&[Confidence::FULL], Timestamp::from_seconds(f64::from(frame) / 30.0));
    /// }
    /// assert!(hand.state().unwrap().closed);
    /// ```
    pub fn vote(&mut self, closed: &[Confidence], at: Timestamp) {
        if !closed.is_empty() {
            self.heard = Some(at);
        } else if self
            .heard
            .is_none_or(|heard| at.since_seconds(heard) > FORGOTTEN_S)
        {
            self.last = None;
            return;
        }
        let (elapsed, before) = match self.last {
            Some((last, state)) => (at.since_seconds(last).max(0.0), state),
            None => {
                let nothing = HandState {
                    closed: false,
                    closed_probability: 0.5,
                };
                (FIRST_S, nothing)
            }
        };
        let forgotten = 1.0 - (-2.0 * self.config.changes_per_s * elapsed).exp();
        let expected = before.closed_probability + (0.5 - before.closed_probability) * forgotten;
        let news = (elapsed / self.config.news_s).min(1.0);
        let right = self.config.right_share;
        let evidence: f64 = closed
            .iter()
            .map(|vote| {
                let vote = f64::from(vote.get());
                let if_closed = right * vote + (1.0 - right) * (1.0 - vote);
                (if_closed / (1.0 - if_closed)).ln()
            })
            .sum();
        let odds = (expected / (1.0 - expected)).ln() + news * evidence;
        let probability = (1.0 / (1.0 + (-odds).exp())).clamp(1.0 - SUREST, SUREST);
        let needed = if before.closed {
            1.0 - self.config.decide
        } else {
            self.config.decide
        };
        let state = HandState {
            closed: probability > needed,
            closed_probability: probability,
        };
        let at = self.last.map_or(at, |(last, _)| last.max(at));
        self.last = Some((at, state));
    }
}
