//! Left and right: depth trackers take a back for a front and exchange the labels.
//!
//! Two questions, kept apart. Relative: does this sensor's body agree with the track as labelled or as mirrored?
//! Decided per sample, by a two-state filter. Absolute: are the track's own labels right? Answered slowly by what does
//! not depend on labels: toes and knees point forward, people walk forward, and a tracker that calls a view a
//! back view has not mistaken it for a front.

use nalgebra::{Vector2, Vector3};
use posefuse_skeleton::Joint;
use serde::{Deserialize, Serialize};

use crate::body::{Body, HALVES, Halves};

/// Standard deviations that a joint is taken to be off the track: of one that the tracker saw, of one it guessed, m.
const SEEN_M: f64 = 0.08;
const GUESSED_M: f64 = 0.22;
/// No joint says more than this, in log odds.
const JOINT_LIMIT: f64 = 2.5;
/// Errors of one body's joints go together: they count as fewer than they are.
const JOINTLY: f64 = 0.5;
/// Chance per second that a tracker begins, and that it ceases, to exchange a half: of a view in which the person
/// faces the sensor, and of any other.
const FACING_RATES: [f64; 2] = [0.05, 6.0];
const OTHER_RATES: [f64; 2] = [0.6, 0.3];
/// The person faces the sensor when the cosine between the two directions is above this.
const FACING_ABOVE: f64 = 0.2;
/// What hips that face as the shoulders do, or the other way, say; log odds.
const TWIST: f64 = 1.5;
/// Certainty that is never exceeded, log odds.
const ODDS_LIMIT: f64 = 7.0;
/// Evidence weight of toes, knees and walking direction.
const TOES: f64 = 0.8;
const KNEES: f64 = 0.4;
const WALK: f64 = 0.5;
/// A joint of less confidence was guessed.
const TRUSTED: f32 = 0.7;
/// What tells the left of each half from its right.
pub(super) const ENDS: Halves<(Joint, Joint)> = [
    (Joint::ShoulderLeft, Joint::ShoulderRight),
    (Joint::HipLeft, Joint::HipRight),
];

/// One sensor's view of one person: are left and right exchanged? Log odds of each half, positive if so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SwapOdds(Halves<f64>);

impl SwapOdds {
    /// Before anything is known of the person: `cues` are [`facing_cues`] of the first body.
    pub(crate) fn first(cues: Halves<f64>) -> Self {
        Self(cues.map(|cue| -2.0 * cue))
    }

    /// Weighs `body` against `predicted`, `elapsed_s` after the body before it, seen from `origin`: a two-state
    /// filter, which forgets by as much as a tracker may have changed its mind. Whether each half is exchanged.
    pub(crate) fn weigh(
        &mut self,
        body: &Body,
        predicted: &Body,
        origin: Vector3<f64>,
        elapsed_s: f64,
    ) -> Halves<bool> {
        for (half, odds) in self.0.iter_mut().enumerate() {
            let (left, right) = ENDS[half];
            let faces = labelled_forward(predicted, left, right)
                .and_then(|forward| towards(predicted, origin, forward))
                .is_some_and(|towards| towards > FACING_ABOVE);
            let rates = if faces { FACING_RATES } else { OTHER_RATES };
            let prior = forget(*odds, rates, elapsed_s);
            let said = evidence(HALVES[half], body, predicted) - twist(half, body, predicted);
            *odds = (prior + said).clamp(-ODDS_LIMIT, ODDS_LIMIT);
        }
        self.mirrored()
    }

    /// Whether each half is exchanged.
    pub(crate) fn mirrored(&self) -> Halves<bool> {
        self.0.map(|odds| odds > 0.0)
    }

    /// The track's own labels were exchanged in these halves.
    pub(crate) fn flip(&mut self, halves: Halves<bool>) {
        for (odds, flip) in self.0.iter_mut().zip(halves) {
            if flip {
                *odds = -*odds;
            }
        }
    }
}

/// Log odds `elapsed_s` later, when the state begins and ceases at these rates, 1/s.
fn forget(odds: f64, [begins, ceases]: [f64; 2], elapsed_s: f64) -> f64 {
    let elapsed_s = elapsed_s.clamp(0.0, 1.0);
    let chance = |rate: f64| 1.0 - (-rate * elapsed_s).exp();
    let was = 1.0 / (1.0 + (-odds).exp());
    let is = was * (1.0 - chance(ceases)) + (1.0 - was) * chance(begins);
    let is = is.clamp(1e-6, 1.0 - 1e-6);
    (is / (1.0 - is)).ln()
}

/// For the legs: whether the hips of `body` face where the shoulders of `predicted` do, log odds for it. The arms, wider
/// and better seen, are hardly ever taken wrongly, and nobody turns their back on their own feet.
fn twist(half: usize, body: &Body, predicted: &Body) -> f64 {
    if half == 0 {
        return 0.0;
    }
    let [(left, right), (hip_left, hip_right)] = ENDS;
    let shoulders = labelled_forward(predicted, left, right);
    let hips = labelled_forward(body, hip_left, hip_right);
    shoulders
        .zip(hips)
        .map_or(0.0, |(shoulders, hips)| TWIST * shoulders.dot(&hips))
}

/// Log likelihood ratio of `pairs` of `body` being exchanged against `predicted`.
fn evidence(pairs: &[(Joint, Joint)], body: &Body, predicted: &Body) -> f64 {
    let mut sum = 0.0;
    for (left, right) in pairs {
        let (left, right) = (*left as usize, *right as usize);
        if !(predicted.has(left) && predicted.has(right)) {
            continue;
        }
        for (index, other) in [(left, right), (right, left)] {
            if !body.has(index) {
                continue;
            }
            let guessed = body.confidence[index].min(predicted.confidence[index]) < TRUSTED;
            let sigma = if guessed { GUESSED_M } else { SEEN_M };
            let square =
                |other: usize| (body.position[index] - predicted.position[other]).norm_squared();
            let ratio = (square(index) - square(other)) / (2.0 * sigma * sigma);
            sum += ratio.clamp(-JOINT_LIMIT, JOINT_LIMIT);
        }
    }
    JOINTLY * sum
}

/// How well the labels of each half of `body` (as the sensor gave them) agree with everything that does not depend
/// on labels, -1..=1. `origin` is the sensor's place, `walk` the person's velocity (m/s).
pub(crate) fn facing_cues(body: &Body, origin: Vector3<f64>, walk: Vector3<f64>) -> Halves<f64> {
    let (toes, knees) = (toes(body), knees(body));
    let speed = walk.xy().norm();
    ENDS.map(|(left, right)| {
        let Some(forward) = labelled_forward(body, left, right) else {
            return 0.0;
        };
        let mut cue = view(body, origin, forward);
        cue += toes.map_or(0.0, |toes| TOES * toes.dot(&forward));
        cue += knees.map_or(0.0, |knees| KNEES * knees.dot(&forward));
        if speed > 0.5 {
            cue += WALK * walk.xy().dot(&forward) / speed;
        }
        cue.clamp(-1.0, 1.0)
    })
}

/// Cosine between `forward` and the direction of a sensor at `origin`, flat on the floor.
fn towards(body: &Body, origin: Vector3<f64>, forward: Vector2<f64>) -> Option<f64> {
    let at = body
        .get(Joint::SpineBase)
        .or_else(|| body.get(Joint::SpineShoulder))?;
    Some(unit((origin - at).xy(), 1e-6)?.dot(&forward))
}

/// What the view itself says: a claimed back view is hardly a mistake, a claimed front view may be one.
fn view(body: &Body, origin: Vector3<f64>, forward: Vector2<f64>) -> f64 {
    match towards(body, origin, forward) {
        None => 0.0,
        Some(towards) if towards > 0.3 => 0.1,
        Some(towards) if towards > -0.3 => 0.3,
        Some(_) => 0.6,
    }
}

/// Forward by the labels; unit vector.
fn labelled_forward(body: &Body, left: Joint, right: Joint) -> Option<Vector2<f64>> {
    forward(body.get(left)?, body.get(right)?)
}

/// From right to left, turned a quarter clockwise as seen from above; unit vector.
pub(super) fn forward(left: Vector3<f64>, right: Vector3<f64>) -> Option<Vector2<f64>> {
    let left = left - right;
    unit(Vector2::new(left.y, -left.x), 0.05)
}

/// Where the toes point.
fn toes(body: &Body) -> Option<Vector2<f64>> {
    let foot = |ankle, foot| {
        let toe = body.get(foot)? - body.get(ankle)?;
        (toe.norm() < 0.4).then_some(toe.xy())
    };
    let left = foot(Joint::AnkleLeft, Joint::FootLeft);
    let right = foot(Joint::AnkleRight, Joint::FootRight);
    unit(left.unwrap_or_default() + right.unwrap_or_default(), 0.05)
}

/// Where bent knees point.
fn knees(body: &Body) -> Option<Vector2<f64>> {
    let knee = |hip, knee, ankle| {
        let (hip, knee, ankle) = (body.get(hip)?, body.get(knee)?, body.get(ankle)?);
        let leg: Vector3<f64> = ankle - hip;
        let share = (knee - hip).dot(&leg) / leg.norm_squared().max(1e-6);
        let out = knee - hip - leg * share;
        (out.norm() < 0.4).then_some(out.xy())
    };
    let left = knee(Joint::HipLeft, Joint::KneeLeft, Joint::AnkleLeft);
    let right = knee(Joint::HipRight, Joint::KneeRight, Joint::AnkleRight);
    unit(left.unwrap_or_default() + right.unwrap_or_default(), 0.06)
}

/// The direction of `vector`, if it is longer than `least`.
fn unit(vector: Vector2<f64>, least: f64) -> Option<Vector2<f64>> {
    let length = vector.norm();
    (length > least).then(|| vector / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stands at the origin facing +X, knees a little bent.
    fn standing() -> Body {
        let mut body = Body::default();
        let mut put = |joint: Joint, x: f64, y: f64, z: f64| {
            body.set(joint as usize, Vector3::new(x, y, z), 1.0)
        };
        put(Joint::SpineBase, 0.0, 0.0, 1.0);
        for (side, hip, knee, ankle, foot, shoulder) in [
            (
                1.0,
                Joint::HipLeft,
                Joint::KneeLeft,
                Joint::AnkleLeft,
                Joint::FootLeft,
                Joint::ShoulderLeft,
            ),
            (
                -1.0,
                Joint::HipRight,
                Joint::KneeRight,
                Joint::AnkleRight,
                Joint::FootRight,
                Joint::ShoulderRight,
            ),
        ] {
            put(hip, 0.0, 0.1 * side, 0.95);
            put(knee, 0.08, 0.1 * side, 0.5);
            put(ankle, 0.0, 0.1 * side, 0.08);
            put(foot, 0.14, 0.1 * side, 0.03);
            put(shoulder, 0.0, 0.18 * side, 1.45);
        }
        body
    }

    #[test]
    fn a_mirrored_half_is_noticed_both_ways() {
        let truth = standing();
        for halves in [[false, false], [true, false], [false, true], [true, true]] {
            let mut swapped = truth.clone();
            swapped.mirror(halves);
            for was in [1.0, -1.0] {
                let before = SwapOdds::first([was; 2]);
                let weigh = |predicted: &Body| {
                    let aside = Vector3::new(0.0, 3.0, 1.5);
                    { before }.weigh(&swapped, predicted, aside, 0.03)
                };
                assert_eq!(weigh(&truth), halves);
                assert_eq!(weigh(&Body::default()), before.mirrored());
            }
        }
    }

    #[test]
    fn an_exchange_fades_where_the_person_faces_the_sensor() {
        let truth = standing();
        let mut odds = SwapOdds::first([-1.0; 2]);
        let ahead = Vector3::new(3.0, 0.0, 1.5);
        let mut nothing = Body::default();
        nothing.set(Joint::SpineBase as usize, Vector3::z(), 1.0);
        assert_eq!(odds.mirrored(), [true; 2]);
        for _ in 0..20 {
            odds.weigh(&nothing, &truth, ahead, 0.033);
        }
        assert_eq!(odds.mirrored(), [false; 2]);
    }

    #[test]
    fn toes_and_knees_tell_a_front_from_a_back() {
        let truth = standing();
        let mut swapped = truth.clone();
        swapped.mirror([true, false]);
        let behind = Vector3::new(-3.0, 0.0, 1.5);
        assert!(
            facing_cues(&truth, behind, Vector3::zeros())
                .iter()
                .all(|cue| *cue > 0.9)
        );
        let [upper, lower] = facing_cues(&swapped, behind, Vector3::zeros());
        assert!(upper < -0.9 && lower > 0.9, "{upper} {lower}");
    }

    #[test]
    fn walking_tells_where_feet_are_hidden() {
        let mut torso = standing();
        torso.mask &= !(1 << Joint::FootLeft as u32 | 1 << Joint::FootRight as u32);
        torso.mask &= !(1 << Joint::KneeLeft as u32 | 1 << Joint::KneeRight as u32);
        let (aside, ahead) = (Vector3::new(0.0, 3.0, 1.5), Vector3::x());
        let [right, _] = facing_cues(&torso, aside, ahead);
        torso.mirror([true; 2]);
        let [wrong, _] = facing_cues(&torso, aside, ahead);
        assert!(right > 0.5 && wrong < 0.0, "{right} {wrong}");
    }
}
