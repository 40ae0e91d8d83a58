//! What the sensors are like, learned from what they say: what each is off by habit, how loud it is, and whether
//! all of it is off, as when it was moved since the calibration.

use std::ops::Range;

use nalgebra::Vector3;
use posefuse_skeleton::{JOINT_COUNT, SensorId};

use super::evidence::{Evidence, Reading, Word};
use super::slow::SlowErrors;
use super::{Moment, PersonFilter, Scratch};
use crate::people::median;

/// A body of fewer trusted joints says nothing of its sensor as a whole.
const MIN_JOINTS: usize = 8;
/// Mean of a squared error in three dimensions, in units of its median.
const MEAN_OF_MEDIAN: f64 = 1.4;
/// Share of the slow errors that is taken not to be learned yet when a sensor's loudness is.
const SLOW_SHARE: f64 = 0.2;

impl PersonFilter {
    /// What is new of joint number `index` tells how far off each sensor is by habit.
    ///
    /// What it sees is compared with all that is new together, never with the prediction: what all sensors lie ahead of
    /// that is the person's movement, and would else be learned as an error of each.
    pub(super) fn learn_slow(
        &mut self,
        index: usize,
        words: &[Word],
        readings: &[Reading],
        evidence: &Evidence,
    ) {
        let (Some(known), Some(spread)) = (&self.joints[index], evidence.information.try_inverse())
        else {
            return;
        };
        let together = spread * evidence.pull;
        let unsure = known.belief.place_covariance().trace() / 3.0;
        for word in words {
            let reading = &readings[word.reading];
            let (true, Some(slow)) = (reading.fresh, slow_of(&mut self.slow, reading.sensor))
            else {
                continue;
            };
            if word.sure {
                let noise = word.quick + spread.trace() / 3.0;
                slow.learn(index, true, word.off - together, noise, word.weight);
            } else {
                let there = known.belief.place_at(-reading.age_s) + slow.of(index, false).0;
                let off = reading.body.position[index] - there;
                slow.learn(index, false, off, word.quick + unsure, 1.0);
            }
        }
    }

    /// How far each sensor's joints lie from where they were expected tells how loud it is.
    pub(super) fn learn_loudness(
        &mut self,
        moment: &Moment,
        readings: &[Reading],
        scratch: &mut Scratch,
    ) {
        let Scratch { words, squares, .. } = scratch;
        for (number, reading) in readings.iter().enumerate().filter(|(_, r)| r.fresh) {
            let Some(slow) = slow_of(&mut self.slow, reading.sensor) else {
                continue;
            };
            squares.clear();
            squares.extend(words.iter().filter_map(|word| {
                let known = word.unsure? + SLOW_SHARE * slow.usual();
                let quick = word.off.norm_squared() / 3.0 - known;
                (word.sure && word.reading == number).then_some(quick / word.image)
            }));
            if let Some(middle) = middle(squares) {
                slow.listen(middle * MEAN_OF_MEDIAN, moment.elapsed_s);
            }
        }
    }

    /// How far a sensor's joints lie from where the other sensors say they are tells how far all of it is off.
    ///
    /// The prediction has no say in it: with one good sensor and one bad, it follows both. The good one keeps its name
    /// then, because what it is told apart by is the bad one's own variance.
    pub(super) fn learn_faults(
        &mut self,
        moment: &Moment,
        readings: &[Reading],
        scratch: &mut Scratch,
        said: &[Range<usize>; JOINT_COUNT],
    ) {
        let Scratch { words, squares, .. } = scratch;
        for (number, reading) in readings.iter().enumerate().filter(|(_, r)| r.fresh) {
            let Some(slow) = slow_of(&mut self.slow, reading.sensor) else {
                continue;
            };
            squares.clear();
            squares.extend(said.iter().enumerate().filter_map(|(index, said)| {
                let words = &words[said.clone()];
                let own = words.iter().find(|w| w.sure && w.reading == number)?;
                let is_other = |w: &&Word| readings[w.reading].sensor != reading.sensor;
                let (place, unsure) = mean(words.iter().filter(|w| w.sure).filter(is_other))?;
                let apart = own.off + slow.of(index, true).0 - place;
                Some(apart.norm_squared() - 3.0 * (unsure + own.quick + slow.usual()))
            }));
            if let Some(middle) = middle(squares) {
                slow.blame(middle, moment.elapsed_s);
            }
        }
    }

    /// How faulty the best of the sensors is that have a say, m^2: there is nobody to be put before it.
    pub(super) fn least_fault(&self, readings: &[Reading]) -> f64 {
        let faults = readings
            .iter()
            .filter_map(|reading| Some(self.slow_of(reading.sensor)?.fault()));
        faults.reduce(f64::min).unwrap_or(0.0)
    }
}

/// What is known of `sensor` among all, which are in order of sensors.
fn slow_of(all: &mut [SlowErrors], sensor: SensorId) -> Option<&mut SlowErrors> {
    let found = all.binary_search_by_key(&sensor, |slow| slow.sensor);
    Some(&mut all[found.ok()?])
}

/// The median over a body's joints, if they are enough to speak for the whole of it.
fn middle(squares: &mut [f64]) -> Option<f64> {
    (squares.len() >= MIN_JOINTS)
        .then(|| median(squares))
        .flatten()
}

/// Where `words` say a joint is, relative to the expectation (metres), and the variance of that per axis (m^2).
fn mean<'a>(words: impl Iterator<Item = &'a Word>) -> Option<(Vector3<f64>, f64)> {
    let (mut sum, mut total) = (Vector3::zeros(), 0.0);
    for word in words {
        let weight = word.weight * word.information.trace() / 3.0;
        sum += word.off * weight;
        total += weight;
    }
    (total > 0.0).then(|| (sum / total, 1.0 / total))
}
