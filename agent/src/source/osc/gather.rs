//! Single joints, as messages bring them, gathered into frames.
//!
//! OSC knows no frames. One ends where the sender says so, where the time tag of the bundles changes, where a joint comes
//! that the frame has already, and where nothing has come for a moment. It was caught when its first message came.

use std::collections::{BTreeMap, VecDeque};

use posefuse_skeleton::{AgentTime, Observation, RawJoint};

use super::layout::Said;
use crate::source::{SourceBody, SourceFrame};

/// Nothing for this long after people were seen: nobody is there any more, nanoseconds.
const NOBODY_NS: i64 = 250_000_000;
/// Frames that may wait; one packet cannot hold more that are worth having.
const MOST_READY: usize = 64;

/// The frame that is being gathered, and those that are whole.
#[derive(Debug)]
pub(super) struct Gather {
    joint_count: usize,
    gap_ns: i64,
    bodies: BTreeMap<u64, Vec<Option<RawJoint>>>,
    /// When the frame's first message came.
    began_ns: Option<i64>,
    tag: Option<u64>,
    last_ns: i64,
    /// The latest frame ended before the sender said so: when it does, that frame is meant.
    untold: bool,
    /// Whether the latest frame had people in it.
    people: bool,
    ready: VecDeque<SourceFrame>,
    /// Joints of more people than a frame may have.
    pub(super) surplus: u64,
}

impl Gather {
    /// `gap_ns`: a pause this long ends a frame.
    pub(super) fn new(joint_count: usize, gap_ns: i64) -> Self {
        Self {
            joint_count,
            gap_ns,
            bodies: BTreeMap::new(),
            began_ns: None,
            tag: None,
            last_ns: 0,
            untold: false,
            people: false,
            ready: VecDeque::new(),
            surplus: 0,
        }
    }

    /// Takes in what a message says that came at `now_ns` in a bundle with this time tag.
    pub(super) fn hear(&mut self, said: Said, tag: Option<u64>, now_ns: i64) {
        let of_the_next = match &said {
            Said::Joint(person, joint, _) => {
                let body = self.bodies.get(person);
                tag != self.tag || body.is_some_and(|body| body[*joint].is_some())
            }
            // Told outside of the bundles, it is about the frame that is open.
            Said::Lost(_) => tag.is_some() && tag != self.tag,
            Said::EndOfFrame => false,
        };
        if self.began_ns.is_some() && of_the_next {
            self.end();
            self.untold = true;
        }
        match said {
            Said::EndOfFrame => {
                if !std::mem::take(&mut self.untold) {
                    self.began_ns.get_or_insert(now_ns);
                    self.end();
                }
            }
            Said::Lost(person) => {
                self.bodies.remove(&person);
            }
            Said::Joint(person, joint, place) => {
                let full = self.bodies.len() >= Observation::MAX_BODIES;
                if full && !self.bodies.contains_key(&person) {
                    self.surplus += 1;
                    return;
                }
                self.began_ns.get_or_insert(now_ns);
                self.untold = false;
                self.tag = tag;
                let missing = || vec![None; self.joint_count];
                let body = self.bodies.entry(person).or_insert_with(missing);
                body[joint] = place;
            }
        }
        self.last_ns = now_ns;
    }

    /// Ends the frame if nothing has come for long enough; says that nobody is there once nothing comes at all.
    pub(super) fn idle(&mut self, now_ns: i64) {
        let silent_ns = now_ns.saturating_sub(self.last_ns);
        if self.began_ns.is_some() && silent_ns >= self.gap_ns {
            self.end();
            self.untold = true;
        } else if self.people && self.began_ns.is_none() && silent_ns >= NOBODY_NS {
            self.began_ns = Some(now_ns);
            self.end();
        }
    }

    /// Whether a frame is waiting for its end.
    pub(super) fn is_open(&self) -> bool {
        self.began_ns.is_some()
    }

    /// The next whole frame.
    pub(super) fn next(&mut self) -> Option<SourceFrame> {
        self.ready.pop_front()
    }

    /// Forgets everything that has not been taken.
    pub(super) fn clear(&mut self) {
        self.bodies.clear();
        self.ready.clear();
        self.began_ns = None;
        self.untold = false;
    }

    fn end(&mut self) {
        let Some(began_ns) = self.began_ns.take() else {
            return;
        };
        let bodies: Vec<SourceBody> = std::mem::take(&mut self.bodies)
            .into_iter()
            .filter(|(_, joints)| joints.iter().any(Option::is_some))
            .map(|(tracking_id, joints)| SourceBody {
                tracking_id,
                joints,
                orientations: Vec::new(),
                hands_closed: [None; 2],
            })
            .collect();
        self.people = !bodies.is_empty();
        if self.ready.len() == MOST_READY {
            self.ready.pop_front();
        }
        self.ready.push_back(SourceFrame {
            captured: AgentTime::from_ns(began_ns),
            due_ns: None,
            bodies,
        });
    }
}

#[cfg(test)]
mod tests;
