//! Left and right: depth trackers take a back for a front and exchange the labels.
//!
//! Two questions, kept apart. Relative: does this sensor's body agree with the track as labelled or as mirrored?
//! Decided per sample, with hysteresis. Absolute: are the track's own labels right? Answered slowly by what does
//! not depend on labels: toes and knees point forward, people walk forward, and a tracker that calls a view a
//! back view has not mistaken it for a front.

use nalgebra::{Vector2, Vector3};
use posefuse_skeleton::Joint;

use crate::body::{Body, HALVES, Halves};

/// Squared distances above this are outliers, m^2.
const CLIP_M2: f64 = 0.25;
/// How much better, in m^2 of mean squared distance, the other labelling must be to be taken.
const MARGIN_M2: f64 = 0.004;
/// Evidence weight of toes, knees and walking direction.
const TOES: f64 = 0.8;
const KNEES: f64 = 0.4;
const WALK: f64 = 0.5;
/// What tells the left of each half from its right.
const ENDS: Halves<(Joint, Joint)> = [
    (Joint::ShoulderLeft, Joint::ShoulderRight),
    (Joint::HipLeft, Joint::HipRight),
];

/// Which halves of `body` fit `predicted` better with left and right exchanged; `was` is the previous answer.
/// Where nothing can be said the previous answer stays.
pub(crate) fn mirrored_halves(body: &Body, predicted: &Body, was: Halves<bool>) -> Halves<bool> {
    std::array::from_fn(|half| is_mirrored(HALVES[half], body, predicted, was[half]))
}

fn is_mirrored(pairs: &[(Joint, Joint)], body: &Body, predicted: &Body, was: bool) -> bool {
    let (mut as_is, mut mirrored, mut weights) = (0.0, 0.0, 0.0);
    for (left, right) in pairs {
        let (left, right) = (*left as usize, *right as usize);
        if !(predicted.has(left) && predicted.has(right)) {
            continue;
        }
        for (index, other) in [(left, right), (right, left)] {
            if !body.has(index) {
                continue;
            }
            let weight = 0.1 + f64::from(body.confidence[index]);
            let square = |other: usize| {
                let distance = body.position[index] - predicted.position[other];
                distance.norm_squared().min(CLIP_M2)
            };
            as_is += weight * square(index);
            mirrored += weight * square(other);
            weights += weight;
        }
    }
    if weights == 0.0 {
        return was;
    }
    let gain = (as_is - mirrored) / weights;
    if was {
        gain > -MARGIN_M2
    } else {
        gain > MARGIN_M2
    }
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

/// What the view itself says: a claimed back view is hardly a mistake, a claimed front view may be one.
fn view(body: &Body, origin: Vector3<f64>, forward: Vector2<f64>) -> f64 {
    let Some(at) = body
        .get(Joint::SpineBase)
        .or_else(|| body.get(Joint::SpineShoulder))
    else {
        return 0.0;
    };
    let to_sensor = (origin - at).xy();
    let distance = to_sensor.norm();
    if distance < 1e-6 {
        return 0.0;
    }
    match to_sensor.dot(&forward) / distance {
        towards if towards > 0.3 => 0.1,
        towards if towards > -0.3 => 0.3,
        _ => 0.6,
    }
}

/// Forward by the labels: from right to left, turned a quarter clockwise as seen from above; unit vector.
fn labelled_forward(body: &Body, left: Joint, right: Joint) -> Option<Vector2<f64>> {
    let left = body.get(left)? - body.get(right)?;
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
            for was in [[false; 2], [true; 2]] {
                assert_eq!(mirrored_halves(&swapped, &truth, was), halves);
                assert_eq!(mirrored_halves(&swapped, &Body::default(), was), was);
            }
        }
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
