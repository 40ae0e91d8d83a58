//! Which way a person faces, over time: left and right do not change between two images.
//!
//! From a single image a network now and then takes a back for a front and names left and right the wrong way round. People do not
//! turn round between two images, so one that says the opposite has its sides exchanged, until the evidence lasts.

use posefuse_skeleton::{Joint, SIDE_PAIRS};

use crate::estimate::Estimate;
use crate::floor::Level;
use crate::lens::V3;

/// Evidence for what is believed grows and shrinks between these, and so much of it each second at full certainty.
const MOST_BELIEF: f32 = 1.0;
const PER_S: f32 = 2.5;
/// What is believed of somebody new.
const FIRST_BELIEF: f32 = 0.25;
/// How much of a new heading is taken over where it agrees.
const FOLLOWS: f32 = 0.6;
/// A walk faster than this says which way somebody faces, m/s, and this strongly.
const WALKS: f32 = 0.5;
const WALK_WEIGHT: f32 = 0.8;
/// Knowledge of somebody who was not seen fades, seconds.
const FADES_S: f32 = 1.0;

/// What is believed of a person's heading.
#[derive(Clone, Debug, Default)]
pub(crate) struct Heading {
    /// Level unit vector that the chest points along.
    ahead: Option<V3>,
    /// How much speaks for it.
    belief: f32,
    last_ns: i64,
}

impl Heading {
    /// Puts left and right of an estimate right, if they are not, and takes it in. `speed`: of the person, m/s.
    pub(crate) fn settle(&mut self, level: &Level, found: &mut Estimate, speed: &V3, at_ns: i64) {
        let Some((said, certainty)) = said(level, found) else {
            return;
        };
        let since_s = ((at_ns - self.last_ns) as f64 * 1e-9).clamp(0.0, 10.0) as f32;
        self.last_ns = at_ns;
        let Some(ahead) = self.ahead else {
            (self.ahead, self.belief) = (Some(said), FIRST_BELIEF);
            return;
        };
        self.belief *= (-(since_s - 0.2).max(0.0) / FADES_S).exp();
        let agrees = ahead.dot(&said);
        let gain = PER_S * since_s.min(0.1);
        self.belief += gain * agrees * certainty;
        let level_speed = speed - level.up * level.up.dot(speed);
        if level_speed.norm() > WALKS {
            let walks = ahead.dot(&level_speed.normalize());
            self.belief += gain * walks * WALK_WEIGHT;
        }
        self.belief = self.belief.min(MOST_BELIEF);
        if self.belief < 0.0 {
            // What spoke against it lasted.
            self.belief = FIRST_BELIEF;
            self.ahead = Some(if agrees < 0.0 { said } else { -ahead });
        }
        let ahead = self.ahead.unwrap_or(ahead);
        if ahead.dot(&said) < 0.0 {
            exchange_sides(found);
            self.follow(ahead, -said, certainty);
        } else {
            self.follow(ahead, said, certainty);
        }
    }

    fn follow(&mut self, ahead: V3, said: V3, certainty: f32) {
        let share = FOLLOWS * certainty.max(0.2);
        self.ahead = (ahead + (said - ahead) * share)
            .try_normalize(1e-3)
            .or(self.ahead);
    }

    /// Cosine of the angle between the heading and the way to the sensor, for somebody at `middle`.
    pub(crate) fn towards_sensor(&self, level: &Level, middle: &V3) -> Option<f32> {
        let away = middle - level.up * level.up.dot(middle);
        Some(-self.ahead?.dot(&away.try_normalize(1e-3)?))
    }
}

/// The heading that the joints say, as a level unit vector, and how certain the network is of front and back, 0 to 1.
fn said(level: &Level, found: &Estimate) -> Option<(V3, f32)> {
    use Joint::{HipLeft, HipRight, ShoulderLeft, ShoulderRight};
    let across =
        |left: Joint, right: Joint| found.joints[left as usize] - found.joints[right as usize];
    let left = across(ShoulderLeft, ShoulderRight) + across(HipLeft, HipRight);
    let ahead = left.cross(&level.up).try_normalize(0.02)?;
    let [sin, cos] = found.heading;
    Some((ahead, sin.hypot(cos).clamp(0.1, 1.0)))
}

/// Left becomes right.
fn exchange_sides(found: &mut Estimate) {
    for (left, right) in SIDE_PAIRS {
        let (left, right) = (left as usize, right as usize);
        found.joints.swap(left, right);
        found.sigma_m.swap(left, right);
        found.visible.swap(left, right);
    }
    // The way to the sensor stays.
    found.heading = found.heading.map(|part| -part);
}

#[cfg(test)]
mod tests {
    use super::*;
    use posefuse_skeleton::JOINT_COUNT;

    const STEP_NS: i64 = 33_333_333;

    /// Somebody whose left is at `left` metres to the right of the image.
    fn seen(left: f32) -> Estimate {
        let mut found = Estimate {
            joints: [V3::new(0.0, 0.0, 2.0); JOINT_COUNT],
            sigma_m: [0.03; JOINT_COUNT],
            visible: [1.0; JOINT_COUNT],
            heading: [0.0, left.signum()],
        };
        for (l, r) in SIDE_PAIRS {
            found.joints[l as usize].x = left;
            found.joints[r as usize].x = -left;
        }
        found
    }

    fn run(heading: &mut Heading, images: std::ops::Range<i64>, left: f32) -> usize {
        let right = images.filter(|image| {
            let mut found = seen(left);
            heading.settle(&Level::UNKNOWN, &mut found, &V3::zeros(), image * STEP_NS);
            found.joints[Joint::ShoulderLeft as usize].x > 0.0
        });
        right.count()
    }

    #[test]
    fn a_flip_of_a_few_images_is_put_right_and_one_that_lasts_is_believed() {
        let mut heading = Heading::default();
        assert_eq!(run(&mut heading, 0..30, 0.2), 30);
        let middle = V3::new(0.0, 0.0, 2.0);
        let towards = heading.towards_sensor(&Level::UNKNOWN, &middle).unwrap();
        assert!(towards > 0.99, "{towards}");
        assert_eq!(run(&mut heading, 30..36, -0.2), 6, "put right");
        assert_eq!(run(&mut heading, 36..60, 0.2), 24);
        let lasting = run(&mut heading, 60..120, -0.2);
        assert!((5..30).contains(&lasting), "{lasting}");
        let towards = heading.towards_sensor(&Level::UNKNOWN, &middle).unwrap();
        assert!(towards < -0.9, "{towards}");
    }

    #[test]
    fn somebody_who_turns_is_followed() {
        let mut heading = Heading::default();
        for image in 0..90 {
            let angle = image as f32 * 0.1;
            let mut found = seen(0.2);
            for (l, r) in SIDE_PAIRS {
                let side = V3::new(angle.cos(), 0.0, angle.sin()) * 0.2;
                found.joints[l as usize] = V3::new(0.0, 0.0, 2.0) + side;
                found.joints[r as usize] = V3::new(0.0, 0.0, 2.0) - side;
            }
            let before = found.joints;
            heading.settle(&Level::UNKNOWN, &mut found, &V3::zeros(), image * STEP_NS);
            assert_eq!(found.joints, before, "image {image}");
        }
    }
}
