//! Spells: stretches of time, at most one in ten seconds, in which something is wrong.

use crate::random::{Purpose, Stream};

/// Every slot of this length has its own spell, or none; seconds.
const SLOT_S: f64 = 10.0;

/// How often spells come and how long they last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spells {
    pub(crate) seed: u64,
    pub(crate) purpose: Purpose,
    pub(crate) sensor: u64,
    /// At most 6.
    pub(crate) per_min: f64,
    /// Shortest and longest, seconds, at most 5.
    pub(crate) length_s: [f64; 2],
}

impl Spells {
    /// The number of the spell at `seconds` after the scenario's start and when it ends, if there is one.
    pub(crate) fn at(&self, seconds: f64) -> Option<(u64, f64)> {
        let slot = (seconds / SLOT_S).floor().max(0.0) as u64;
        let mut stream = Stream::new(self.seed, self.purpose, &[self.sensor, slot]);
        if !stream.chance(self.per_min * SLOT_S / 60.0) {
            return None;
        }
        let length = stream.between(self.length_s[0], self.length_s[1]);
        let begin = slot as f64 * SLOT_S + stream.between(0.0, SLOT_S - length);
        (begin..begin + length)
            .contains(&seconds)
            .then_some((slot, begin + length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spells_come_as_often_and_last_as_long_as_they_should() {
        let spells = Spells {
            seed: 3,
            purpose: Purpose::Gap,
            sensor: 1,
            per_min: 3.0,
            length_s: [0.5, 0.5],
        };
        let hour: Vec<Option<(u64, f64)>> = (0..360_000)
            .map(|i| spells.at(f64::from(i) * 0.01))
            .collect();
        let within = hour.iter().flatten().count();
        let mut numbers: Vec<u64> = hour.iter().flatten().map(|(number, _)| *number).collect();
        numbers.dedup();
        assert!((150..=210).contains(&numbers.len()), "{}", numbers.len());
        let mean_s = within as f64 * 0.01 / numbers.len() as f64;
        assert!((mean_s - 0.5).abs() < 0.01, "{mean_s} s");
    }
}
