//! Where the head looks. Trackers of this class give the head a place but no face: its turn about itself is a guess, and
//! this is a good one for somebody who works with their hands.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::bones::{ARMS, CHEST, HEAD, HEAD_END, HIPS};
use crate::config::{LookAt, LookConfig};
use crate::posture::Placed;

/// A place one step ahead.
const NEAR_M: f64 = 1.2;
const FAR_M: f64 = 20.0;
/// Faster than the second somebody walks, slower than the first they do not, m/s.
const WALKS_MPS: (f64, f64) = (0.35, 0.55);
/// How quickly the walking speed follows, seconds.
const SPEED_S: f64 = 0.3;
/// What is further round than this is not looked at, radians: one would turn the body.
const BEHIND_RAD: f64 = 2.0;
/// A critically damped turn is done to 98.5 % after this many of its time constants.
const SETTLED: f64 = 6.2;

/// The turn of one head.
#[derive(Clone, Debug, Default)]
pub(crate) struct Look {
    yaw: Damped,
    nod: Damped,
    hips: Option<Vector3<f64>>,
    speed: f64,
    walks: bool,
}

impl Look {
    /// Moves the gaze on by `elapsed` seconds; returns what the head is turned by, in its own axes.
    pub(crate) fn step(
        &mut self,
        placed: &Placed,
        config: &LookConfig,
        elapsed: f64,
    ) -> UnitQuaternion<f64> {
        self.follow(placed, elapsed);
        let head = &placed.axes[HEAD];
        let axis = (placed.origins[HEAD_END] - placed.origins[HEAD])
            .try_normalize(1e-6)
            .map_or(Vector3::z(), |axis| head.transpose() * axis);
        let (yaw, nod) = self
            .goal(placed, config.at)
            .map(|goal| head.transpose() * (goal - placed.origins[HEAD_END]))
            .map_or((0.0, 0.0), |line| {
                (line.y.atan2(line.x), (-line.z).atan2(line.xy().norm()))
            });
        let (yaw, nod) = if yaw.abs() > BEHIND_RAD {
            (0.0, 0.0)
        } else {
            let (side, most) = (config.side_deg.to_radians(), config.nod_deg.to_radians());
            (yaw.clamp(-side, side), nod.clamp(-most, most))
        };
        let rate = SETTLED / config.settle_s;
        self.yaw.step(yaw, rate, elapsed);
        self.nod.step(nod, rate, elapsed);
        UnitQuaternion::from_scaled_axis(axis * self.yaw.value)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.nod.value)
    }

    fn follow(&mut self, placed: &Placed, elapsed: f64) {
        let hips = placed.origins[HIPS];
        if let Some(before) = self.hips
            && elapsed > 0.0
        {
            let speed = (hips - before).xy().norm() / elapsed;
            self.speed += (speed - self.speed) * (elapsed / SPEED_S).min(1.0);
        }
        self.hips = Some(hips);
        let needed = if self.walks { WALKS_MPS.0 } else { WALKS_MPS.1 };
        self.walks = self.speed > needed;
    }

    /// The place that is looked at, room metres.
    fn goal(&self, placed: &Placed, at: LookAt) -> Option<Vector3<f64>> {
        let chest = &placed.axes[CHEST];
        let ahead = |distance: f64, height: f64| {
            let forwards: Vector3<f64> = chest.column(0).into();
            let flat = Vector3::new(forwards.x, forwards.y, 0.0).try_normalize(0.2)?;
            let below = placed.origins[HEAD_END];
            Some(Vector3::new(below.x, below.y, height) + flat * distance)
        };
        let far = || ahead(FAR_M, placed.origins[HEAD_END].z);
        match at {
            LookAt::Off => None,
            LookAt::Hands => Some(hands(placed)),
            LookAt::Near => ahead(NEAR_M, 0.0),
            LookAt::Far => far(),
            LookAt::Auto => raised(placed, chest).or_else(|| {
                if self.walks {
                    far()
                } else {
                    ahead(NEAR_M, 0.0)
                }
            }),
        }
    }
}

/// The middle of both hands.
fn hands(placed: &Placed) -> Vector3<f64> {
    (placed.origins[ARMS[0].fingers] + placed.origins[ARMS[1].fingers]) / 2.0
}

/// The higher one of the hands that are before the chest.
fn raised(placed: &Placed, chest: &Matrix3<f64>) -> Option<Vector3<f64>> {
    let hands = ARMS.iter().map(|arm| placed.origins[arm.fingers]);
    hands
        .filter(|hand| {
            let seen = chest.transpose() * (hand - placed.origins[CHEST]);
            seen.x > 0.2 && seen.x > 0.5 * seen.y.abs() && seen.z > -0.15
        })
        .max_by(|a, b| a.z.total_cmp(&b.z))
}

/// Something that follows a goal without overshooting (critically damped, exact for any step).
#[derive(Clone, Copy, Debug, Default)]
struct Damped {
    value: f64,
    rate: f64,
}

impl Damped {
    fn step(&mut self, goal: f64, stiffness: f64, elapsed: f64) {
        let off = self.value - goal;
        let decay = (-stiffness * elapsed).exp();
        let push = self.rate + stiffness * off;
        self.value = goal + (off + push * elapsed) * decay;
        self.rate = (self.rate - push * stiffness * elapsed) * decay;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::posture::{Posture, offsets};

    fn standing(config: &LookConfig, seconds: f64) -> (Vector3<f64>, f64) {
        let body = Body::of_height(1.75);
        let mut posture = Posture::rest(Vector3::new(0.0, 0.0, body.rest_height()));
        // The left forearm is held forwards, before the chest.
        posture.balls[ARMS[0].upper] = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -1.2);
        posture.angles[ARMS[0].lower][0] = 1.6;
        let placed = Placed::of(&offsets(&body.rig()), &posture);
        let mut look = Look::default();
        let mut turn = UnitQuaternion::identity();
        let mut largest: f64 = 0.0;
        for _ in 0..(seconds * 30.0) as usize {
            turn = look.step(&placed, config, 1.0 / 30.0);
            largest = largest.max(turn.angle());
        }
        (placed.axes[HEAD] * (turn * Vector3::x()), largest)
    }

    #[test]
    fn the_head_turns_to_the_hand_without_overshooting_and_within_its_range() {
        let mut config = LookConfig {
            at: LookAt::Auto,
            ..LookConfig::default()
        };
        let (gaze, largest) = standing(&config, 3.0);
        assert!(gaze.y > 0.2, "to the left: {gaze}");
        let (_, settled) = standing(&config, 6.0);
        assert!((largest - settled).abs() < 1e-3, "{largest} {settled}");
        config.side_deg = 10.0;
        let (_, largest) = standing(&config, 3.0);
        assert!((largest - 10f64.to_radians()).abs() < 1e-3, "{largest}");
    }

    #[test]
    fn off_looks_where_the_chest_does() {
        let (gaze, largest) = standing(&LookConfig::default(), 1.0);
        assert!((gaze - Vector3::x()).norm() < 1e-9 && largest < 1e-12);
    }
}
