//! The seam between the engine and whatever fills in joints that no sensor saw.
//!
//! A model gets a [`Window`]: poses of one person at even steps, each joint with how far it was measured and how long ago
//! that was. It answers with [`Fill`]s for the poses asked for. Simple models live beside this file and need no data
//! but a table; neural ones live in the `models` crate and implement the same trait.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use posefuse_skeleton::{JOINT_COUNT, JointMap};
use serde::{Deserialize, Serialize};

/// Time since a joint was measured is told up to here, seconds; also of a joint that never was.
pub const MAX_AGE_S: f32 = 10.0;

/// One joint of one pose of a [`Window`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowJoint {
    /// Where it was measured at this time or, if it was not, last before it; room metres. Of a joint that was never
    /// measured: the middle of those that were.
    pub position: Vector3<f64>,
    /// How far it was measured: 0 not at all, 1 with trust, between them a weak measurement, whose standard deviation is
    /// 5 cm times the root of 1 / weight - 1.
    pub weight: f32,
    /// Confidence of the measurement, 0..=1; 0 where there is none.
    pub confidence: f32,
    /// Since it was last measured (weight above 0), seconds, 0 to [`MAX_AGE_S`].
    pub age_s: f32,
}

/// One person's recent poses at even steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// From one pose to the next, seconds.
    pub step_s: f64,
    /// Oldest first; as many as the model [needs](Needs).
    pub poses: Vec<[WindowJoint; JOINT_COUNT]>,
}

/// What a model makes up for one joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fill {
    /// Where the joint probably is, room metres.
    pub position: Vector3<f64>,
    /// Standard deviation along each axis, metres.
    pub sigma_m: f64,
    /// How the joint is turned in the room, of models that know.
    pub rotation: Option<UnitQuaternion<f64>>,
}

/// How much a model looks at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Needs {
    /// Poses before the one that is filled.
    pub before: usize,
    /// Poses after it: 0 for a model that can run live.
    pub after: usize,
    /// Poses per second.
    pub rate_hz: f64,
}

impl Needs {
    /// Poses in a window for one filled pose.
    pub fn poses(&self) -> usize {
        self.before + 1 + self.after
    }

    /// How far it looks back, seconds.
    pub(super) fn before_s(&self) -> f64 {
        self.before as f64 / self.rate_hz
    }

    /// How far it looks ahead, seconds.
    pub(super) fn after_s(&self) -> f64 {
        self.after as f64 / self.rate_hz
    }
}

/// Fills in joints that no sensor saw.
///
/// It answers the same to the same window, whatever it was asked before.
pub trait OcclusionModel: Send {
    /// Its name in configuration, takes and reports.
    fn name(&self) -> &str;

    /// The window it needs. A longer one is cut; where the person was not there yet, the engine repeats the first pose
    /// with weight 0.
    fn needs(&self) -> Needs;

    /// Joints of the poses numbered `wanted` of `window`: at least those that have weight below 1, where it can tell.
    ///
    /// # Errors
    /// Why it could not; the engine then goes on with the simple model.
    fn fill(
        &mut self,
        window: &Window,
        wanted: Range<usize>,
    ) -> Result<Vec<JointMap<Fill>>, ModelError>;
}

/// A model gave no answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the occlusion model `{model}` gave no answer: {reason}")]
pub struct ModelError {
    /// Which.
    pub model: String,
    /// Why, in words.
    pub reason: String,
}
