//! The ordered list of optional steps. `gate` works on each sensor's body before fusing, the others on the fused
//! room. A room stage may hold frames back to look ahead; every frame comes out once, in order, with its own
//! capture time.

mod bones;
mod holt;
mod one_euro;
mod savitzky_golay;
mod smooth;

use posefuse_skeleton::{RoomFrame, Timestamp, TrackId};
use serde::{Deserialize, Serialize};

pub use crate::gate::GateConfig;
pub use bones::BonesConfig;
pub use smooth::{SmoothConfig, SmoothFilter};

use crate::config_check::Checker;
use bones::Bones;
use smooth::Smooth;

/// One entry of `[[stages]]`, told apart by `kind`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Stage {
    /// Drops joints that cannot be true, before fusing.
    Gate(GateConfig),
    /// Draws bones softly to the person's own lengths.
    Bones(BonesConfig),
    /// Smooths each joint over time.
    Smooth(SmoothConfig),
}

impl Stage {
    /// What ships. Smoothing is off: `kalman` looks ahead itself, and no filter does well behind another.
    pub fn shipped() -> Vec<Self> {
        let smooth = SmoothConfig {
            enabled: false,
            ..SmoothConfig::default()
        };
        vec![
            Self::Gate(GateConfig::default()),
            Self::Bones(BonesConfig::default()),
            Self::Smooth(smooth),
        ]
    }

    /// Whether it runs.
    pub fn enabled(&self) -> bool {
        match self {
            Self::Gate(stage) => stage.enabled,
            Self::Bones(stage) => stage.enabled,
            Self::Smooth(stage) => stage.enabled,
        }
    }

    /// Switches it on or off.
    pub fn set_enabled(&mut self, enabled: bool) {
        match self {
            Self::Gate(stage) => stage.enabled = enabled,
            Self::Bones(stage) => stage.enabled = enabled,
            Self::Smooth(stage) => stage.enabled = enabled,
        }
    }

    /// How many newer frames it needs before it gives one.
    pub fn look_ahead_frames(&self) -> usize {
        match self {
            Self::Smooth(stage) if stage.enabled => stage.look_ahead_frames(),
            _ => 0,
        }
    }

    pub(crate) fn check(&self, at: &str, check: &mut Checker) {
        match self {
            Self::Gate(stage) => stage.check(at, check),
            Self::Bones(stage) => stage.check(at, check),
            Self::Smooth(stage) => stage.check(at, check),
        }
    }
}

/// The room stages that are on, with their state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pipeline {
    stages: Vec<RoomStage>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum RoomStage {
    Bones(Bones),
    Smooth(Smooth),
}

impl Pipeline {
    /// The enabled room stages of `stages`, in their order.
    pub(crate) fn new(stages: &[Stage]) -> Self {
        let room = stages
            .iter()
            .filter(|s| s.enabled())
            .filter_map(|stage| match stage {
                Stage::Gate(_) => None,
                Stage::Bones(config) => Some(RoomStage::Bones(Bones::new(*config))),
                Stage::Smooth(config) => Some(RoomStage::Smooth(Smooth::new(*config))),
            });
        Self {
            stages: room.collect(),
        }
    }

    /// Takes the next frame and gives every frame that is ready.
    pub(crate) fn push(&mut self, frame: RoomFrame, give: &mut dyn FnMut(RoomFrame)) {
        run(&mut self.stages, frame, give);
    }

    /// Gives every frame that is held back, with the look-ahead there is.
    pub(crate) fn flush(&mut self, give: &mut dyn FnMut(RoomFrame)) {
        let mut stages = self.stages.as_mut_slice();
        while let Some((first, rest)) = stages.split_first_mut() {
            if let RoomStage::Smooth(smooth) = first {
                smooth.flush(&mut |frame| run(rest, frame, give));
            }
            stages = rest;
        }
    }

    /// Starts afresh for this person: left and right were exchanged.
    pub(crate) fn restart(&mut self, id: TrackId) {
        for stage in &mut self.stages {
            match stage {
                RoomStage::Bones(_) => {}
                RoomStage::Smooth(smooth) => smooth.restart(id),
            }
        }
    }

    /// Starts afresh for everybody: the sensors were moved.
    pub(crate) fn restart_all(&mut self) {
        for stage in &mut self.stages {
            if let RoomStage::Smooth(smooth) = stage {
                smooth.restart_all();
            }
        }
    }

    /// Forgets who is not among `known` (ascending).
    pub(crate) fn retain(&mut self, known: &[TrackId]) {
        for stage in &mut self.stages {
            if let RoomStage::Bones(bones) = stage {
                bones.retain(known);
            }
        }
    }
}

/// Sends `frame` through `stages`.
fn run(stages: &mut [RoomStage], mut frame: RoomFrame, give: &mut dyn FnMut(RoomFrame)) {
    match stages.split_first_mut() {
        None => give(frame),
        Some((RoomStage::Bones(bones), rest)) => {
            bones.apply(&mut frame);
            run(rest, frame, give);
        }
        Some((RoomStage::Smooth(smooth), rest)) => {
            smooth.push(frame, &mut |frame| run(rest, frame, give))
        }
    }
}

/// One joint's filter over time, 3 components in metres.
trait JointFilter {
    /// Takes a sample and gives the one that became due, with its own time.
    fn push(
        &mut self,
        time: Timestamp,
        position: nalgebra::Vector3<f64>,
    ) -> Option<(Timestamp, nalgebra::Vector3<f64>)>;
}

#[cfg(test)]
mod tests;
