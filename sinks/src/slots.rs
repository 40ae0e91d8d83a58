//! Fixed places for people: a port, a channel, an outlet is somebody's while they are there.

use posefuse_skeleton::{Timestamp, TrackId};

/// Nobody else gets a place so soon while there is another one, seconds: who comes back in that time has the same id.
const KEPT_S: f64 = 2.0;

/// Who has which place.
#[derive(Clone, Debug)]
pub(crate) struct Slots(Vec<Slot>);

#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    held_by: Option<TrackId>,
    /// Who had it last, and when they were there last.
    former: Option<(TrackId, Timestamp)>,
}

impl Slots {
    /// `most` free places.
    pub(crate) fn new(most: usize) -> Self {
        Self(vec![Slot::default(); most])
    }

    /// At `now`, `present` are there: who is not loses their place. Of those without one, `ready` ones get theirs of
    /// before, or the lowest that is free. Who finds none waits.
    pub(crate) fn update(&mut self, now: Timestamp, present: &[TrackId], ready: &[TrackId]) {
        for slot in &mut self.0 {
            if let Some(id) = slot.held_by {
                slot.former = Some((id, now));
                slot.held_by = present.contains(&id).then_some(id);
            }
        }
        for id in ready {
            if self.of(*id).is_none()
                && let Some(free) = self.free(*id, now)
            {
                free.held_by = Some(*id);
            }
        }
    }

    /// Everybody is gone.
    pub(crate) fn clear(&mut self) {
        for slot in &mut self.0 {
            slot.held_by = None;
        }
    }

    /// The place of a person, from 0.
    pub(crate) fn of(&self, id: TrackId) -> Option<usize> {
        self.0.iter().position(|slot| slot.held_by == Some(id))
    }

    /// Who has each place.
    pub(crate) fn holders(&self) -> impl Iterator<Item = Option<TrackId>> {
        self.0.iter().map(|slot| slot.held_by)
    }

    fn free(&mut self, id: TrackId, now: Timestamp) -> Option<&mut Slot> {
        let cost = |slot: &Slot| match slot.former {
            Some((former, _)) if former == id => 0,
            Some((_, left)) if now.since_seconds(left) < KEPT_S => 2,
            _ => 1,
        };
        let free = self.0.iter_mut().filter(|slot| slot.held_by.is_none());
        free.min_by_key(|slot| cost(slot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(slots: &Slots) -> Vec<Option<u64>> {
        slots.holders().map(|id| id.map(|id| id.0)).collect()
    }

    fn step(slots: &mut Slots, at_s: f64, ids: &[u64]) -> Vec<Option<u64>> {
        let ids: Vec<TrackId> = ids.iter().copied().map(TrackId).collect();
        slots.update(Timestamp::from_seconds(at_s), &ids, &ids);
        held(slots)
    }

    #[test]
    fn people_keep_their_places_and_places_are_used_again() {
        let mut slots = Slots::new(2);
        assert_eq!(step(&mut slots, 0.0, &[1]), [Some(1), None]);
        assert_eq!(step(&mut slots, 1.0, &[1, 2]), [Some(1), Some(2)]);
        assert_eq!(step(&mut slots, 2.0, &[2]), [None, Some(2)]);
        assert_eq!(step(&mut slots, 9.0, &[2, 3]), [Some(3), Some(2)]);
        assert_eq!(step(&mut slots, 10.0, &[2, 3, 4]), [Some(3), Some(2)]);
        assert_eq!(step(&mut slots, 11.0, &[3, 4]), [Some(3), Some(4)]);
    }

    #[test]
    fn who_was_away_for_a_moment_comes_back_to_their_own() {
        let mut slots = Slots::new(2);
        step(&mut slots, 0.0, &[1]);
        step(&mut slots, 0.1, &[]);
        assert_eq!(step(&mut slots, 1.0, &[2]), [None, Some(2)]);
        assert_eq!(step(&mut slots, 1.1, &[1, 2]), [Some(1), Some(2)]);
        // Somebody alone, lost for longer and found again as somebody else.
        let mut slots = Slots::new(2);
        step(&mut slots, 0.0, &[1]);
        step(&mut slots, 0.1, &[]);
        assert_eq!(step(&mut slots, 4.0, &[2]), [Some(2), None]);
    }

    #[test]
    fn who_is_there_but_not_ready_gets_no_place_and_keeps_theirs() {
        let mut slots = Slots::new(1);
        let (now, one) = (Timestamp::ZERO, [TrackId(1)]);
        slots.update(now, &one, &[]);
        assert_eq!(slots.of(TrackId(1)), None);
        slots.update(now, &one, &one);
        slots.update(now, &one, &[]);
        assert_eq!(slots.of(TrackId(1)), Some(0));
    }
}
