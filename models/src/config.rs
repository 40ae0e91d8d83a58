//! `[models]`: where models come from and what runs them. Which one is used says `repair.model`.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// `[models]` of a server's configuration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// A folder with models of one's own (NAME.toml, NAME.onnx), beside those in the program; empty: none.
    pub folder: PathBuf,
    /// What runs them.
    pub backend: BackendChoice,
    /// Where ONNX Runtime computes.
    pub device: Device,
    /// The library of ONNX Runtime or its folder; empty: ORT_DYLIB_PATH, then the usual places.
    pub onnxruntime: PathBuf,
}

/// What runs a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BackendChoice {
    /// The embedded runtime where it is quick enough, else the quicker one of those there are.
    #[default]
    Auto,
    /// The embedded one: part of the program.
    Rten,
    /// ONNX Runtime, where it is installed.
    Ort,
}

/// Where ONNX Runtime computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Device {
    /// On one processor core.
    #[default]
    Cpu,
    /// On an NVIDIA card.
    Cuda,
    /// On an NVIDIA card, compiled for it first.
    Tensorrt,
}

impl Device {
    /// As it is written in the configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Cuda => "cuda",
            Self::Tensorrt => "tensorrt",
        }
    }
}
