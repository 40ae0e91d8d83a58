//! What the tests of this crate share.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use posefuse_fusion::{Window, WindowJoint};
use posefuse_models::{BackendChoice, Config, ModelFile, NeuralModel};
use posefuse_skeleton::{JOINT_COUNT, Joint};

pub(crate) const LEFT_ARM: [Joint; 3] = [Joint::ElbowLeft, Joint::WristLeft, Joint::HandLeft];

pub(crate) fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

pub(crate) fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data")
}

pub(crate) fn fixture(name: &str) -> ModelFile {
    ModelFile::read(&fixtures().join(format!("{name}.toml"))).unwrap()
}

pub(crate) fn on(backend: BackendChoice) -> Config {
    Config {
        backend,
        ..Config::default()
    }
}

pub(crate) fn open(name: &str) -> NeuralModel {
    NeuralModel::open(&fixture(name), &on(BackendChoice::Rten)).unwrap()
}

/// A person who walks along X at 1 m/s; from pose `hidden_from` on the left arm stays where it was last seen.
pub(crate) fn walking(poses: usize, hidden_from: usize) -> Window {
    let step_s = 1.0 / 30.0;
    let pose = |number: usize| {
        std::array::from_fn(|index| {
            let joint = Joint::ALL[index];
            let hidden = number >= hidden_from && LEFT_ARM.contains(&joint);
            let seen = if hidden {
                hidden_from.saturating_sub(1)
            } else {
                number
            };
            let angle = index as f64;
            let place = Vector3::new(0.2 * angle.sin(), 0.3 * angle.cos(), 0.07 * angle);
            WindowJoint {
                position: place + Vector3::new(seen as f64 * step_s, 0.0, 0.0),
                weight: if hidden { 0.0 } else { 1.0 },
                confidence: if hidden { 0.0 } else { 1.0 },
                age_s: (number - seen) as f32 * step_s as f32,
            }
        })
    };
    let poses: Vec<[WindowJoint; JOINT_COUNT]> = (0..poses).map(pose).collect();
    Window { step_s, poses }
}
