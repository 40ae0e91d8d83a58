//! Footsteps: planned first, from where the body goes, so that a standing foot stands still.

use nalgebra::{Vector2, Vector3};

use super::curve::{Track, ramp, unwrapped};
use super::kinematics::FootPose;
use super::shape::BodyShape;

/// Where a body stands and faces: room metres, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) at: Vector2<f64>,
    pub(crate) heading: f64,
}

impl Place {
    /// The unit vector that points where the body faces.
    pub(crate) fn ahead(self) -> Vector2<f64> {
        Vector2::new(self.heading.cos(), self.heading.sin())
    }

    /// The place `forward` metres ahead and `left` metres to the left, facing the same way.
    pub(crate) fn shifted(self, forward: f64, left: f64) -> Self {
        let ahead = self.ahead();
        let at = self.at + ahead * forward + Vector2::new(-ahead.y, ahead.x) * left;
        Self { at, ..self }
    }
}

/// A foot's way through the air.
#[derive(Clone, Copy, Debug)]
struct Step {
    lift: f64,
    land: f64,
    from: Place,
    to: Place,
}

/// All the steps of one person's two feet (left, right) over one round.
#[derive(Clone, Debug)]
pub(crate) struct Steps {
    start: [Place; 2],
    steps: [Vec<Step>; 2],
    ankle_height: f64,
}

/// The time between two footfalls, and how long a foot is in the air, seconds.
const CADENCE: f64 = 0.54;
const SWING: f64 = 0.42;

/// How high an ankle is lifted, and how far the toes point down, then up, during a full step.
const LIFT_M: f64 = 0.09;
const TOES_RAD: f64 = 0.6;

impl Steps {
    /// Steps that follow `body` (x, y, heading) through the intervals in which it moves, `(start, end)` in seconds,
    /// in order and at least 1.2 s apart. Outside of them, and 1.2 s after, both feet are on the floor.
    pub(crate) fn plan(shape: &BodyShape, body: &Track<3>, moving: &[(f64, f64)]) -> Self {
        let place = |time: f64| {
            let [x, y, heading] = body.at(time);
            Place {
                at: Vector2::new(x, y),
                heading,
            }
        };
        let half = 1.15 * shape.hip_half;
        let below = |time: f64, foot: usize| {
            place(time).shifted(-0.02 * shape.height, if foot == 0 { half } else { -half })
        };
        let start = [below(0.0, 0), below(0.0, 1)];
        let mut steps = [Vec::new(), Vec::new()];
        let mut feet = start;
        for &(from, to) in moving {
            // The track's smoothing spreads a movement by two control values.
            let settled = to + 0.1;
            let goal = [below(settled, 0), below(settled, 1)];
            let turned = place(from + 0.6).heading - place(from).heading;
            let mut foot = usize::from(turned < -0.02);
            let mut lift = from;
            while lift < settled || feet != goal {
                let aim = lift + CADENCE + 0.5 * SWING;
                let target = if aim >= settled {
                    goal[foot]
                } else {
                    below(aim, foot)
                };
                if target != feet[foot] {
                    steps[foot].push(Step {
                        lift,
                        land: lift + SWING,
                        from: feet[foot],
                        to: target,
                    });
                    feet[foot] = target;
                }
                lift += CADENCE;
                foot = 1 - foot;
            }
        }
        Self {
            start,
            steps,
            ankle_height: shape.ankle_height,
        }
    }

    /// Both feet at `time` of the round, seconds.
    pub(crate) fn at(&self, time: f64) -> [FootPose; 2] {
        [self.foot(0, time), self.foot(1, time)]
    }

    /// Whether each foot stands on the floor at `time` of the round.
    pub(crate) fn standing(&self, time: f64) -> [bool; 2] {
        [0, 1].map(|foot| self.step(foot, time).is_none_or(|step| time >= step.land))
    }

    fn step(&self, foot: usize, time: f64) -> Option<&Step> {
        let begun = self.steps[foot].partition_point(|step| step.lift <= time);
        begun.checked_sub(1).map(|last| &self.steps[foot][last])
    }

    fn foot(&self, foot: usize, time: f64) -> FootPose {
        let on_floor = |place: Place| FootPose {
            ankle: Vector3::new(place.at.x, place.at.y, self.ankle_height),
            yaw: place.heading,
            pitch: 0.0,
        };
        let Some(step) = self.step(foot, time) else {
            return on_floor(self.start[foot]);
        };
        if time >= step.land {
            return on_floor(step.to);
        }
        let share = (time - step.lift) / (step.land - step.lift);
        let turn = unwrapped(step.to.heading, step.from.heading) - step.from.heading;
        let length = (step.to.at - step.from.at).norm();
        // Smooth to the second derivative at both ends; small steps are low.
        let bump = 64.0 * (share * (1.0 - share)).powi(3);
        let size = (0.25 + 2.0 * length + 0.5 * turn.abs()).min(1.0);
        let mut pose = on_floor(Place {
            at: step.from.at + (step.to.at - step.from.at) * ramp(share),
            heading: step.from.heading + turn * ramp(share),
        });
        pose.ankle.z += LIFT_M * size * bump;
        pose.pitch =
            TOES_RAD * size * bump * (std::f64::consts::PI * share).cos() * length.min(0.8);
        pose
    }
}
