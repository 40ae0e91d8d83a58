//! What one reading says of one joint, by all that is known of its sensor; and what part each sensor had in the end.

use nalgebra::Vector3;
use posefuse_skeleton::JOINT_COUNT;

use super::evidence::{Reading, Word};
use super::slow::SlowErrors;
use super::{Moment, Part};
use crate::body::HALVES;
use crate::noise::Noise;

/// What even a silent sensor's joint shakes, metres.
const FINE_M: f64 = 0.003;

/// How far a word is to be trusted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trust {
    /// The person's own body hides the joint.
    pub(super) hidden: bool,
    /// Variance of a sensor that is off as a whole, m^2.
    pub(super) fault: f64,
}

/// What reading `number` says of joint number `index`, which was expected to be `there` at the sample's time.
pub(super) fn word(
    number: usize,
    reading: &Reading,
    index: usize,
    moment: &Moment,
    slow: &SlowErrors,
    Trust { hidden, fault }: Trust,
    there: Vector3<f64>,
) -> Word {
    let position = reading.body.position[index];
    let confidence = f64::from(reading.body.confidence[index]);
    let claimed = confidence >= moment.trusted;
    let sure = claimed && !hidden;
    let (mean, variance) = slow.of(index, sure);
    let doubt = HALF[index].map_or(0.0, |half| reading.doubt[half]);
    let image = Noise::of_image(position, reading.origin);
    let quick = image.louder(slow.loudness()).plus(FINE_M * FINE_M + doubt);
    // The less confidence is left, the less even a guess is worth.
    let worth = Noise::of_guess(confidence, moment.trusted);
    Word {
        reading: number,
        off: position - mean - there,
        image: image.mean_variance(),
        quick: quick.mean_variance(),
        information: quick.plus(variance * worth + fault).information(),
        confidence,
        claimed,
        sure,
        weight: 1.0,
        unsure: None,
        apart_m: None,
    }
}

/// Each sensor's part in what `words` say of joint number `joint`.
pub(super) fn tell_parts(
    joint: usize,
    words: &[Word],
    readings: &[Reading],
    part: &mut dyn FnMut(Part),
) {
    let share = |word: &Word| word.information.trace() * word.weight;
    let all: f64 = words.iter().map(share).sum();
    for word in words.iter().filter(|word| readings[word.reading].fresh) {
        part(Part {
            sensor: readings[word.reading].sensor,
            joint,
            share: share(word) / all,
            rejected: word.sure.then(|| word.is_ignored()),
            apart_m: word.apart_m,
        });
    }
}

/// The half of the body (arms, legs) that each joint belongs to; none for the middle.
const HALF: [Option<usize>; JOINT_COUNT] = {
    let mut table = [None; JOINT_COUNT];
    let mut half = 0;
    while half < HALVES.len() {
        let mut pair = 0;
        while pair < HALVES[half].len() {
            let (left, right) = HALVES[half][pair];
            table[left as usize] = Some(half);
            table[right as usize] = Some(half);
            pair += 1;
        }
        half += 1;
    }
    table
};
