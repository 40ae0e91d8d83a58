//! What repair does: frames with it laid beside the same frames without it, joint by joint.
//!
//! Joints hidden from every sensor in truth are where repair is to help; joints that a sensor sees and that were
//! measured are where it must do nothing. Errors are without the bias of the body.

use std::collections::BTreeMap;

use posefuse_skeleton::{Joint, Provenance, RoomFrame, Timestamp, Track};
use serde::Serialize;

use crate::compare::compare;
use crate::histogram::Histogram;
use crate::tally::Mean;
use crate::truth::Truth;

/// A joint moved by no more than this counts as unchanged, metres.
const UNCHANGED_M: f64 = 1e-4;
/// A joint that was made up comes back to where it is measured within this, seconds.
const SETTLED_S: f64 = 0.5;

/// Counts over one or more runs; [`RepairEffect`] says what they mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    without: Histogram,
    with: Histogram,
    only_with: Histogram,
    nowhere: u64,
    claimed: Histogram,
    changed: Mean,
    settled_changed: Mean,
    most_changed_m: f64,
}

/// What repair does to the joints of the same frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RepairEffect {
    /// Joints hidden from every sensor that are there with repair and without it.
    pub hidden: u64,
    /// Their mean error without it, mm. `None` where there is nothing, as in all others.
    pub without_mm: Option<f64>,
    /// And with it.
    pub with_mm: Option<f64>,
    /// The same as 95th percentiles.
    pub without_p95_mm: Option<f64>,
    /// See `without_p95_mm`.
    pub with_p95_mm: Option<f64>,
    /// Hidden joints that are there only with repair.
    pub only_with: u64,
    /// Their mean error, mm.
    pub only_with_mm: Option<f64>,
    /// Hidden joints that are not there with it either.
    pub nowhere: u64,
    /// Of the joints in `hidden` those that a tracker took for seen, so that they count as measured.
    pub claimed: u64,
    /// Their mean error without repair, mm.
    pub claimed_mm: Option<f64>,
    /// Joints that a sensor sees and that were measured.
    pub seen: u64,
    /// Share of them that repair moved by more than 0.1 mm, or took away.
    pub changed: Option<f64>,
    /// The same share of those that have been seen and measured for half a second and longer.
    pub settled_changed: Option<f64>,
    /// The furthest that it moved one of these, mm.
    pub most_changed_mm: Option<f64>,
}

impl Beside {
    pub(crate) fn merge(&mut self, other: &Self) {
        self.without.merge(&other.without);
        self.with.merge(&other.with);
        self.only_with.merge(&other.only_with);
        self.nowhere += other.nowhere;
        self.claimed.merge(&other.claimed);
        self.changed.merge(&other.changed);
        self.settled_changed.merge(&other.settled_changed);
        self.most_changed_m = self.most_changed_m.max(other.most_changed_m);
    }

    /// The figures; `None` where nothing was compared.
    pub(crate) fn effect(&self) -> Option<RepairEffect> {
        let mm = |metres: Option<f64>| metres.map(|metres| metres * 1e3);
        let any = self.changed.count > 0.0 || self.with.count() > 0;
        any.then(|| RepairEffect {
            hidden: self.with.count(),
            without_mm: mm(self.without.mean_m()),
            with_mm: mm(self.with.mean_m()),
            without_p95_mm: mm(self.without.quantile_m(0.95)),
            with_p95_mm: mm(self.with.quantile_m(0.95)),
            only_with: self.only_with.count(),
            only_with_mm: mm(self.only_with.mean_m()),
            nowhere: self.nowhere,
            claimed: self.claimed.count(),
            claimed_mm: mm(self.claimed.mean_m()),
            seen: self.changed.count as u64,
            changed: self.changed.mean(),
            settled_changed: self.settled_changed.mean(),
            most_changed_mm: mm((self.settled_changed.count > 0.0).then_some(self.most_changed_m)),
        })
    }
}

/// Lays frames `with` repair beside those `without`, from `from` on. People are followed by the same tracks in both.
pub(crate) fn beside(
    without: &[RoomFrame],
    with: &[RoomFrame],
    truth: &dyn Truth,
    from: Timestamp,
) -> Beside {
    let mut found = Beside::default();
    // Since when each joint of each person has been seen and measured.
    let mut since: BTreeMap<(u64, Joint), Timestamp> = BTreeMap::new();
    let mut rest = without.iter().peekable();
    for repaired in with.iter().filter(|frame| frame.time >= from) {
        while rest.next_if(|frame| frame.time < repaired.time).is_some() {}
        let Some(plain) = rest.peek().filter(|frame| frame.time == repaired.time) else {
            continue;
        };
        let (Some(people), Some(sighted)) = (truth.reported(plain.time), truth.sighted(plain.time))
        else {
            continue;
        };
        for pair in compare(plain, &people).pairs {
            let own = |frame: &RoomFrame| {
                let track = frame.tracks.iter().find(|track| track.id == pair.track);
                track.cloned()
            };
            let person = people.iter().find(|person| person.id == pair.person);
            let seen = sighted.iter().find(|seen| seen.person == pair.person);
            let (Some(a), Some(b), Some(person)) = (own(plain), own(repaired), person) else {
                continue;
            };
            for (joint, truth) in person.joints.iter() {
                let off = |track: &Track| {
                    let position = track.skeleton.position(joint)?;
                    Some(position.distance(*truth))
                };
                let is_seen = seen.is_some_and(|seen| seen.joints[joint].is_some());
                let key = (pair.person, joint);
                if is_seen && is_measured(&a, joint) {
                    let first = *since.entry(key).or_insert(plain.time);
                    let settled = plain.time.since_seconds(first) >= SETTLED_S;
                    found.seen(moved(joint, &a, &b), settled);
                } else {
                    since.remove(&key);
                }
                if !is_seen {
                    found.hidden(off(&a), off(&b), is_measured(&a, joint));
                }
            }
        }
    }
    found
}

fn is_measured(track: &Track, joint: Joint) -> bool {
    let state = track.skeleton[joint].as_ref();
    state.is_some_and(|state| matches!(state.provenance, Provenance::Measured(_)))
}

/// From one to the other, metres; `None` where it is no longer there.
fn moved(joint: Joint, from: &Track, to: &Track) -> Option<f64> {
    let (from, to) = (from.skeleton.position(joint)?, to.skeleton.position(joint)?);
    Some(from.distance(to))
}

impl Beside {
    fn hidden(&mut self, without: Option<f64>, with: Option<f64>, claimed: bool) {
        match (without, with) {
            (Some(without), Some(with)) => {
                self.without.add(without);
                self.with.add(with);
                if claimed {
                    self.claimed.add(without);
                }
            }
            (None, Some(with)) => self.only_with.add(with),
            (_, None) => self.nowhere += 1,
        }
    }

    fn seen(&mut self, moved_m: Option<f64>, settled: bool) {
        let changed = moved_m.is_none_or(|moved| moved > UNCHANGED_M);
        self.changed.add(f64::from(u8::from(changed)));
        if settled {
            self.settled_changed.add(f64::from(u8::from(changed)));
            self.most_changed_m = self.most_changed_m.max(moved_m.unwrap_or(0.0));
        }
    }
}
