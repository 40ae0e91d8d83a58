//! A standing person with an arm that goes out of sight: what every model is tried with before it is used.

use std::time::Duration;

use posefuse_fusion::MAX_AGE_S;
use posefuse_skeleton::Joint;

use crate::backend::{self, Candidate, Chosen, Session, Trial};
use crate::tensors::{JOINTS, Tensors};
use crate::{Batch, Config, Kind, ModelFile, Refused, windows};

/// A person of 1.75 m in the room's middle, facing +X, arms hanging; metres, in the order of [`Joint::ALL`].
const STANDING: [[f32; 3]; JOINTS] = [
    [0.0, 0.0, 0.95],
    [0.0, 0.0, 1.20],
    [0.0, 0.0, 1.50],
    [0.0, 0.0, 1.65],
    [0.0, 0.18, 1.42],
    [0.0, 0.22, 1.15],
    [0.0, 0.24, 0.90],
    [0.02, 0.24, 0.82],
    [0.0, -0.18, 1.42],
    [0.0, -0.22, 1.15],
    [0.0, -0.24, 0.90],
    [0.02, -0.24, 0.82],
    [0.0, 0.09, 0.92],
    [0.0, 0.10, 0.50],
    [0.0, 0.10, 0.09],
    [0.12, 0.10, 0.03],
    [0.0, -0.09, 0.92],
    [0.0, -0.10, 0.50],
    [0.0, -0.10, 0.09],
    [0.12, -0.10, 0.03],
    [0.0, 0.0, 1.44],
    [0.02, 0.24, 0.74],
    [0.05, 0.22, 0.80],
    [0.02, -0.24, 0.74],
    [0.05, -0.22, 0.80],
];
/// What goes out of sight.
const ARM: [Joint; 5] = [
    Joint::ElbowLeft,
    Joint::WristLeft,
    Joint::HandLeft,
    Joint::HandTipLeft,
    Joint::ThumbLeft,
];

/// Quick enough for one window: what a live model may take (one core, 30 frames a second, several people), and what
/// nobody minds in a recording.
const QUICK_LIVE: Duration = Duration::from_millis(2);
const QUICK_OFFLINE: Duration = Duration::from_millis(20);

/// Opens an occlusion model with the configured runtime or the one that suits it best.
pub(crate) fn choose(file: &ModelFile, config: &Config) -> Result<Chosen, Refused> {
    let manifest = &file.manifest;
    let candidate = Candidate {
        place: &file.place,
        onnx: file.onnx(),
        inputs: &manifest.inputs,
        outputs: &manifest.outputs,
        quick: match manifest.kind {
            Kind::Live => QUICK_LIVE,
            Kind::Offline => QUICK_OFFLINE,
        },
        // Both batch sizes that differ in the network: one person and more.
        counts: match manifest.batch {
            Batch::Any(_) => [2, 1],
            Batch::Fixed(_) => [1, 1],
        },
    };
    let mut standing = Standing {
        rate_hz: manifest.rate_hz,
        tensors: Tensors::of(manifest),
    };
    backend::choose(&candidate, &mut standing, config)
}

struct Standing {
    rate_hz: f64,
    tensors: Tensors,
}

impl Trial for Standing {
    fn what(&self) -> &'static str {
        "a standing person"
    }

    /// In every second window the left arm is seen in the first half only.
    fn fill(&mut self, count: usize) {
        self.tensors.clear();
        for window in 0..count {
            // The last window alone is what a call with one window gets.
            let hides = window + 1 == count;
            for pose in 0..self.tensors.poses {
                self.append(pose, hides);
            }
        }
    }

    fn run(&mut self, session: &mut dyn Session, count: usize) -> Result<(), String> {
        self.tensors.run(session, count)
    }

    /// Whether the outputs put every joint near that person.
    fn check(&self) -> Result<(), String> {
        windows::check_outputs(&self.tensors, [0.0, 0.0, 0.95])
    }
}

impl Standing {
    fn append(&mut self, pose: usize, hides: bool) {
        let seen = self.tensors.poses / 2;
        for (joint, position) in Joint::ALL.into_iter().zip(&STANDING) {
            let hidden = hides && pose >= seen && ARM.contains(&joint);
            self.tensors.pose.extend_from_slice(position);
            self.tensors.mask.push(if hidden { 0.0 } else { 1.0 });
            let since = if hidden { pose + 1 - seen } else { 0 };
            let age = (since as f64 / self.rate_hz) as f32;
            self.tensors.age.push(age.min(MAX_AGE_S));
        }
    }
}
