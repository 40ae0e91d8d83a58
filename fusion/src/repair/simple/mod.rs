//! Models that need no file and run inside the engine.

mod damped;
mod hold;
mod linear;

use std::ops::Range;

use nalgebra::Vector3;
use posefuse_skeleton::{Joint, JointMap};

use super::gaussian::{self, Sides};
use super::{Fill, MAX_AGE_S, ModelError, Needs, OcclusionModel, Window, WindowJoint};

/// A simple model, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimpleModel {
    /// A joint stays where it was last seen.
    Hold,
    /// It goes on as it last moved, slower and slower.
    Damped,
    /// It goes straight to where it is seen again; needs what comes after.
    Linear,
    /// What bodies do that moved like this one and look now like what is seen of it.
    Gaussian,
    /// The same, knowing what comes after.
    GaussianTwoSided,
}

impl SimpleModel {
    /// All, causal ones first.
    pub const ALL: [Self; 5] = [
        Self::Hold,
        Self::Damped,
        Self::Gaussian,
        Self::Linear,
        Self::GaussianTwoSided,
    ];
    /// The best that looks back only.
    pub const BEST: Self = Self::Gaussian;
    /// The best that looks both ways.
    pub const BEST_TWO_SIDED: Self = Self::GaussianTwoSided;

    /// The model that `repair.model` calls so.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.label() == name)
    }

    /// Its name in the configuration.
    pub fn label(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Damped => "damped",
            Self::Linear => "linear",
            Self::Gaussian => "gaussian",
            Self::GaussianTwoSided => "gaussian-two-sided",
        }
    }

    /// The windows it needs.
    pub fn needs_of(self) -> Needs {
        let (before, after) = match self {
            Self::Hold => (0, 0),
            Self::Damped => (damped::BEFORE, 0),
            Self::Linear => (0, linear::AFTER),
            Self::Gaussian => (gaussian::REACH, 0),
            Self::GaussianTwoSided => (gaussian::REACH, gaussian::REACH),
        };
        Needs {
            before,
            after,
            rate_hz: RATE_HZ,
        }
    }

    /// Everything it can say of the pose number `now` of `window`.
    pub(crate) fn fill_one(self, window: &Window, now: usize) -> JointMap<Fill> {
        match self {
            Self::Hold => hold::fill(window, now),
            Self::Damped => damped::fill(window, now),
            Self::Linear => linear::fill(window, now),
            Self::Gaussian => gaussian::fill(window, now, Sides::Before),
            Self::GaussianTwoSided => gaussian::fill(window, now, Sides::Both),
        }
    }
}

/// Poses per second in the windows of simple models.
const RATE_HZ: f64 = 30.0;

impl OcclusionModel for SimpleModel {
    fn name(&self) -> &str {
        self.label()
    }

    fn needs(&self) -> Needs {
        self.needs_of()
    }

    fn fill(
        &mut self,
        window: &Window,
        wanted: Range<usize>,
    ) -> Result<Vec<JointMap<Fill>>, ModelError> {
        if wanted.end > window.poses.len() {
            return Err(ModelError {
                model: self.label().to_owned(),
                reason: format!(
                    "poses {} to {} are wanted of a window of {}",
                    wanted.start,
                    wanted.end,
                    window.poses.len()
                ),
            });
        }
        Ok(wanted.map(|now| self.fill_one(window, now)).collect())
    }
}

/// The joints of the pose number `now` of which nothing is known but where they were, each where `say` puts it (metres),
/// as uncertain as it is after the seconds that `say` names. Of a joint not seen for as long as is told, not even that is
/// known.
fn fill_gaps(
    window: &Window,
    now: usize,
    spread: Spread,
    mut say: impl FnMut(Joint, &WindowJoint) -> (Vector3<f64>, f32),
) -> JointMap<Fill> {
    let joints = Joint::ALL.into_iter().zip(&window.poses[now]);
    joints
        .filter(|(_, known)| known.weight == 0.0 && known.age_s < MAX_AGE_S)
        .map(|(joint, known)| {
            let (position, age_s) = say(joint, known);
            let fill = Fill {
                position,
                sigma_m: spread.sigma_m(age_s),
                rotation: None,
            };
            (joint, fill)
        })
        .collect()
}

/// Standard deviation of a joint that nothing is said of but where it was `age_s` ago, along each axis, metres: `at_once` at
/// first, then `speed` (m/s) times age, up to `most`.
#[derive(Clone, Copy, Debug)]
struct Spread {
    at_once: f64,
    speed: f64,
    most: f64,
}

impl Spread {
    fn sigma_m(&self, age_s: f32) -> f64 {
        (self.at_once + self.speed * f64::from(age_s)).min(self.most)
    }
}

#[cfg(test)]
mod tests;
