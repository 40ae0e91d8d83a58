//! What a sensor's frames alone say of it, before anything is solved: its unit, its labels, which way up it hangs,
//! and whether it was there to the end.

use nalgebra::Vector3;
use posefuse_skeleton::Joint;

use crate::stats::median;
use crate::{CalibrationError, SensorWalk, WalkBody, WalkFrame};

/// Bones whose ends trackers agree on, with their length in an adult of 1.75 m, metres.
const ADULT_M: [(Joint, Joint, f64); 8] = [
    (Joint::ShoulderLeft, Joint::ElbowLeft, 0.29),
    (Joint::ShoulderRight, Joint::ElbowRight, 0.29),
    (Joint::ElbowLeft, Joint::WristLeft, 0.26),
    (Joint::ElbowRight, Joint::WristRight, 0.26),
    (Joint::HipLeft, Joint::KneeLeft, 0.43),
    (Joint::HipRight, Joint::KneeRight, 0.43),
    (Joint::KneeLeft, Joint::AnkleLeft, 0.42),
    (Joint::KneeRight, Joint::AnkleRight, 0.42),
];
/// Frames that are looked at, spread over the walk.
const LOOKS: usize = 1000;
/// Over how long, and from which speed, somebody counts as coming towards a sensor: seconds, m/s.
const COMING_S: f64 = 0.5;
const COMING_SPEED: f64 = 0.4;
/// How far toes must lie before ankles towards the sensor, both feet together, to turn a body's face to it, metres: feet of
/// 12 cm each give 24 cm straight at it and half of that at 60 degrees; errors of a tracker some 2 cm.
const TOES_M: f64 = 0.12;
/// Confidence from which a foot counts: trackers guess the feet of hidden legs.
const SEEN: f64 = 0.75;
/// Fewest bodies that come or face to say something.
const MIN_FACING: u32 = 12;

/// One sensor on its own.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    pub(crate) name: String,
    /// Its bones over those of an adult; `None` where it saw none of them.
    pub(crate) size: Option<f64>,
    /// Of the bodies that come towards the sensor or point their toes at it, the share that show it their back, going by
    /// their labels of left and right. Hardly anybody walks backwards, and no foot is on backwards; 0 where there were too
    /// few of them.
    pub(crate) backwards_share: f64,
    /// Share of bodies whose head hangs below their hips in the sensor's picture.
    pub(crate) hanging_share: f64,
    /// Share of its frames with somebody in them that show more than one person.
    pub(crate) crowded_share: f64,
    /// Its frames per second, from the first to the last; `None` for less than two frames.
    pub(crate) rate_hz: Option<f64>,
    /// How long before the end of the walk its last frame was, seconds.
    pub(crate) gone_s: f64,
}

/// What a body's size may be, in adults: from a small child to a giant.
const SIZES: std::ops::RangeInclusive<f64> = 0.5..=1.5;
/// What is taken for metres, by how many times too large people then are.
const UNITS: [(f64, &str); 6] = [
    (1000.0, "millimetres"),
    (100.0, "centimetres"),
    (39.37, "inches"),
    (10.0, "decimetres"),
    (3.281, "feet"),
    (0.1, "a unit that is larger than the metre"),
];

/// The unit that a sensor sends instead of metres, if what it sees cannot be people.
pub(crate) fn wrong_unit(looks: &[Look]) -> Option<CalibrationError> {
    let wrong = |look: &Look| {
        let size = look.size.filter(|size| !SIZES.contains(size))?;
        let far = |unit: &f64| (unit / size).ln().abs();
        let nearest = UNITS
            .iter()
            .min_by(|x, y| far(&x.0).total_cmp(&far(&y.0)))?;
        Some(CalibrationError::WrongUnit {
            sensor: look.name.clone(),
            times: match size {
                10.0.. => format!("{size:.0}"),
                0.1.. => format!("{size:.1}"),
                _ => format!("{size:.4}"),
            },
            unit: nearest.1,
        })
    };
    looks.iter().find_map(wrong)
}

/// Looks at every sensor.
pub(crate) fn look(walks: &[&SensorWalk]) -> Vec<Look> {
    let last = |walk: &SensorWalk| walk.frames.iter().map(|frame| frame.time).max();
    let end = walks.iter().filter_map(|walk| last(walk)).max();
    let look = |walk: &&SensorWalk| {
        let gone_s = match (end, last(walk)) {
            (Some(end), Some(last)) => end.since_seconds(last),
            _ => 0.0,
        };
        look_at(walk, gone_s)
    };
    walks.iter().map(look).collect()
}

fn look_at(walk: &SensorWalk, gone_s: f64) -> Look {
    let peopled: Vec<_> = walk
        .frames
        .iter()
        .filter(|f| !f.bodies.is_empty())
        .collect();
    let step = peopled.len().div_ceil(LOOKS).max(1);
    let bodies: Vec<&WalkBody> = peopled
        .iter()
        .step_by(step)
        .flat_map(|frame| &frame.bodies)
        .collect();
    let share = |holds: fn(&WalkBody) -> Option<bool>| {
        let answers: Vec<bool> = bodies.iter().filter_map(|body| holds(body)).collect();
        answers.iter().filter(|yes| **yes).count() as f64 / answers.len().max(1) as f64
    };
    Look {
        name: walk.name.clone(),
        size: size(&bodies),
        backwards_share: backwards_share(&peopled, step),
        hanging_share: share(hangs),
        crowded_share: peopled
            .iter()
            .filter(|frame| frame.bodies.len() > 1)
            .count() as f64
            / peopled.len().max(1) as f64,
        rate_hz: rate_hz(walk),
        gone_s,
    }
}

fn rate_hz(walk: &SensorWalk) -> Option<f64> {
    let times = || walk.frames.iter().map(|frame| frame.time);
    let span_s = times().max()?.since_seconds(times().min()?);
    (span_s > 0.0).then(|| (walk.frames.len() - 1) as f64 / span_s)
}

fn at(body: &WalkBody, joint: Joint) -> Option<Vector3<f64>> {
    let seen = body.joints[joint]?;
    (seen.confidence.get() > 0.0).then(|| seen.position.vector())
}

fn size(bodies: &[&WalkBody]) -> Option<f64> {
    let ratio = |&(from, to, adult_m): &(Joint, Joint, f64)| {
        let length = |body: &&WalkBody| Some((at(body, from)? - at(body, to)?).norm());
        let mut lengths: Vec<f64> = bodies.iter().filter_map(length).collect();
        Some(median(&mut lengths)? / adult_m)
    };
    let mut ratios: Vec<f64> = ADULT_M.iter().filter_map(ratio).collect();
    median(&mut ratios)
}

/// Over the bodies that face the sensor by their way or by their toes.
fn backwards_share(peopled: &[&WalkFrame], step: usize) -> f64 {
    let (mut facing, mut backwards) = (0, 0);
    for (index, frame) in peopled.iter().enumerate().step_by(step) {
        let later = peopled[index..]
            .iter()
            .map(|f| (f.time.since_seconds(frame.time), &f.bodies))
            .find(|(seconds, _)| *seconds >= COMING_S)
            .filter(|(seconds, _)| *seconds < 2.0 * COMING_S);
        for body in &frame.bodies {
            let comes = || {
                let (seconds, bodies) = later?;
                let again = bodies.iter().find(|b| b.tracking_id == body.tracking_id)?;
                comes(body, again, seconds)
            };
            if (points_its_toes(body) == Some(true) || comes() == Some(true))
                && let Some(faces) = faces_the_sensor(body)
            {
                facing += 1;
                backwards += u32::from(!faces);
            }
        }
    }
    if facing < MIN_FACING {
        0.0
    } else {
        f64::from(backwards) / f64::from(facing)
    }
}

/// Whether a body that is seen `again` after some seconds comes towards the sensor. By both ends of the spine: who bends
/// or sits down does not come.
fn comes(body: &WalkBody, again: &WalkBody, seconds: f64) -> Option<bool> {
    let comes = |joint: Joint| {
        let (from, to) = (at(body, joint)?, at(again, joint)?);
        let gone = (from - to).dot(&from.normalize());
        Some(gone >= COMING_SPEED * seconds && 1.5 * gone > (to - from).norm())
    };
    Some(comes(Joint::SpineShoulder)? && comes(Joint::SpineBase)?)
}

/// Whether the toes of both feet point at the sensor; `None` where they are not seen.
fn points_its_toes(body: &WalkBody) -> Option<bool> {
    let seen = |joint: Joint| {
        let seen = body.joints[joint]?;
        (f64::from(seen.confidence.get()) >= SEEN).then(|| seen.position.vector())
    };
    let ahead = |ankle: Joint, foot: Joint| {
        let ankle = seen(ankle)?;
        Some((seen(foot)? - ankle).dot(&-ankle.normalize()))
    };
    let left = ahead(Joint::AnkleLeft, Joint::FootLeft)?;
    let right = ahead(Joint::AnkleRight, Joint::FootRight)?;
    Some(left + right >= TOES_M && left.min(right) > 0.0)
}

/// Forward is left x up, and the sensor lies against the ray.
fn faces_the_sensor(body: &WalkBody) -> Option<bool> {
    let left = at(body, Joint::ShoulderLeft)? - at(body, Joint::ShoulderRight)?;
    let chest = at(body, Joint::SpineShoulder)?;
    let up = chest - at(body, Joint::SpineBase)?;
    Some(left.cross(&up).dot(&-chest) > 0.0)
}

fn hangs(body: &WalkBody) -> Option<bool> {
    Some(at(body, Joint::SpineShoulder)?.y > at(body, Joint::SpineBase)?.y)
}
