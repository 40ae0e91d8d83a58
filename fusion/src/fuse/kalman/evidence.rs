//! What the sensors say of one joint for one frame, and how far each is believed.
//!
//! Consensus: a robust mean of the predicted place and every sensor's latest sample, moved to the frame's time by
//! the prediction. It never casts a sensor out for good; a confidently wrong one counts next to nothing.

use nalgebra::{Matrix3, Vector3};
use posefuse_skeleton::{Provenance, SensorId, SensorSet};

use crate::body::{Body, Halves};

/// Rounds of re-weighting.
const ROUNDS: usize = 4;
/// Squared distance at which a sighting counts a quarter, in units of its variance.
const SCALE: f64 = 15.0;
/// Nothing counts less than this.
const LEAST_WEIGHT: f64 = 1e-3;
/// Below this weight a sensor has had no part in the place.
const PART: f64 = 0.05;

/// One sensor's sample of the person, as it is used in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading<'a> {
    pub(crate) sensor: SensorId,
    /// Where the sensor stands, room metres.
    pub(crate) origin: Vector3<f64>,
    pub(crate) body: &'a Body,
    /// From the sample to the frame, seconds, not negative.
    pub(crate) age_s: f64,
    /// Not yet used in an earlier frame.
    pub(crate) fresh: bool,
    /// How much more its halves are to be doubted, m^2.
    pub(crate) doubt: Halves<f64>,
}

/// One reading's word on one joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word {
    /// Number of the reading.
    pub(super) reading: usize,
    /// How far the sample lies from where the prediction expects it, metres.
    pub(super) off: Vector3<f64>,
    /// What the depth image alone lets it be off, mean over the axes, m^2.
    pub(super) image: f64,
    /// The quick part of its variance, mean over the axes, m^2.
    pub(super) quick: f64,
    pub(super) information: Matrix3<f64>,
    pub(super) confidence: f64,
    /// The tracker says that it saw the joint.
    pub(super) claimed: bool,
    /// It says so, and could see it.
    pub(super) sure: bool,
    /// By consensus, 0..=1.
    pub(super) weight: f64,
    /// How unsure the prediction is, mean over the axes, m^2; `None` without one.
    pub(super) unsure: Option<f64>,
    /// How far it lies from what prediction and the other words say, metres; `None` where there is nothing else.
    pub(super) apart_m: Option<f64>,
}

impl Word {
    /// Whether it says nothing that all others would not deny.
    pub(super) fn is_ignored(&self) -> bool {
        self.weight < PART
    }
}

/// All words on a joint together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// Where the joint was expected, room metres.
    pub(super) expected: Vector3<f64>,
    /// Of what is new, 1/m^2.
    pub(super) information: Matrix3<f64>,
    /// The same times how far it lies off the expectation, 1/m.
    pub(super) pull: Vector3<f64>,
    /// Mean age of what is new, seconds.
    pub(super) age_s: f64,
    /// Consensus of prediction and all words, relative to the expectation, metres, and its covariance.
    pub(super) middle: Vector3<f64>,
    pub(super) covariance: Option<Matrix3<f64>>,
    /// Mean confidence by weight; `None` without a word.
    pub(super) confidence: Option<f64>,
    /// Somebody said it with trust, and is believed.
    pub(super) trusted: bool,
    pub(super) provenance: Provenance,
}

/// Weighs `words` against each other and the prediction, whose certainty is `prior` (1/m^2, zero for none).
pub(super) fn weigh(
    words: &mut [Word],
    readings: &[Reading],
    prior: &Matrix3<f64>,
    expected: Vector3<f64>,
) -> Evidence {
    let mut trust = 1.0;
    let mut middle = Vector3::zeros();
    let mut covariance = None;
    for round in 0..=ROUNDS {
        let (mut total, mut sum) = (prior * trust, Vector3::zeros());
        for word in words.iter() {
            let own = word.information * word.weight;
            total += own;
            sum += own * word.off;
        }
        covariance = total.try_inverse();
        let Some(inverse) = &covariance else {
            break;
        };
        middle = inverse * sum;
        if round == ROUNDS {
            compare(words, &total, &sum);
            break;
        }
        trust = weight(prior, middle);
        for word in words.iter_mut() {
            word.weight = weight(&word.information, word.off - middle);
        }
    }
    let mut all = sum_up(words, readings);
    (all.expected, all.middle, all.covariance) = (expected, middle, covariance);
    all
}

/// What something `off` by so much (metres) counts, 0..=1, where `information` (1/m^2) is what is known of it.
pub(super) fn weight(information: &Matrix3<f64>, off: Vector3<f64>) -> f64 {
    let odd = 1.0 + off.dot(&(information * off)) / SCALE;
    (1.0 / (odd * odd)).max(LEAST_WEIGHT)
}

/// Each word beside all others and the prediction, whose sums with it are `total` and `sum`.
fn compare(words: &mut [Word], total: &Matrix3<f64>, sum: &Vector3<f64>) {
    for word in words {
        let own = word.information * word.weight;
        let others = (total - own).try_inverse();
        word.apart_m = others.map(|others| (word.off - others * (sum - own * word.off)).norm());
    }
}

fn sum_up(words: &[Word], readings: &[Reading]) -> Evidence {
    let mut all = Evidence {
        expected: Vector3::zeros(),
        information: Matrix3::zeros(),
        pull: Vector3::zeros(),
        age_s: 0.0,
        middle: Vector3::zeros(),
        covariance: None,
        confidence: None,
        trusted: false,
        provenance: provenance(words, readings),
    };
    let (mut fresh, mut shares, mut confidence) = (0.0, 0.0, 0.0);
    for word in words {
        let own = word.information * word.weight;
        let share = own.trace();
        confidence += share * word.confidence;
        shares += share;
        all.trusted |= word.sure && !word.is_ignored();
        let reading = &readings[word.reading];
        if reading.fresh {
            all.information += own;
            all.pull += own * word.off;
            all.age_s += share * reading.age_s;
            fresh += share;
        }
    }
    all.age_s /= f64::max(fresh, f64::MIN_POSITIVE);
    all.confidence = (shares > 0.0).then(|| confidence / shares);
    all
}

/// Measured by those whose trackers trust their word and who are believed, else predicted from all.
fn provenance(words: &[Word], readings: &[Reading]) -> Provenance {
    let by = |all: bool| -> SensorSet {
        words
            .iter()
            .filter(|word| !word.is_ignored() && (all || word.claimed))
            .map(|word| readings[word.reading].sensor)
            .collect()
    };
    let sure = by(false);
    if sure.is_empty() {
        Provenance::Predicted(by(true))
    } else {
        Provenance::Measured(sure)
    }
}
