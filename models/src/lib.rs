//! Occlusion models as ONNX files: networks that fill in joints which no sensor saw.
//!
//! A model is a manifest (`NAME.toml`) and a network (`NAME.onnx`) that has one interface whatever is inside; see
//! `data/README.md`. [`Library`] knows those in the program and the user's own; [`NeuralModel`] runs one, with the embedded
//! runtime or with ONNX Runtime where that is installed. It is an [`OcclusionModel`](posefuse_fusion::OcclusionModel)
//! as the simple ones are. Any other small network (the body tracker's) is a [`Network`]: named tensors of 32-bit floats in and
//! out, the same manifests, refusals and runtimes.
//!
//! ```no_run
//! use posefuse_models::{Config, Library, NeuralModel};
//!
//! let config = Config::default();
//! let file = Library::new(&config).read("path/to/NAME.toml")?;
//! let model = NeuralModel::open(&file, &config)?;
//! println!("{} on {}: {:?}", file.manifest.name, model.runtime(), model.latency());
//! # Ok::<(), posefuse_models::Refused>(())
//! ```

mod agreement;
mod backend;
mod config;
mod file;
mod library;
mod manifest;
mod model;
mod network;
mod refused;
mod tensors;
mod trial;
mod windows;
mod wire;

pub use agreement::{Agreement, agreement};
pub use backend::{Runtime, onnx_runtime};
pub use config::{BackendChoice, Config, Device};
pub use file::{GoldenOutputs, ModelFile};
pub use library::{Library, is_path, shipped_bytes};
pub use manifest::{
    About, Axis, Batch, Dynamic, Golden, JOINT_SET, Kind, MANIFEST_VERSION, Manifest, Port,
};
pub use model::{Filled, NeuralModel};
pub use network::{Network, NetworkFile, NetworkManifest, RunError};
pub use refused::{NoRuntime, Refused};
pub use windows::Ask;
