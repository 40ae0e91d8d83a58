//! What runs a network: one embedded runtime, and ONNX Runtime where the user has it.

mod choose;
#[cfg(feature = "ort")]
mod onnxruntime;
mod places;
mod rten;

use crate::{Config, Device, NoRuntime};

pub(crate) use choose::{Candidate, Chosen, Trial, choose};

/// Something that can run networks.
pub(crate) trait Backend {
    /// Its name and version.
    fn about(&self) -> Runtime;

    /// Makes a network ready to run.
    ///
    /// # Errors
    /// What the runtime says: not an ONNX file, an operator it does not have.
    fn open(&self, onnx: &[u8]) -> Result<Box<dyn Session>, String>;
}

/// A network that is ready to run.
pub(crate) trait Session: Send {
    /// Inputs and outputs by name, as the file has them.
    fn ports(&self) -> Ports;

    /// Runs the network and writes each output, in C order, to where it is wanted.
    ///
    /// # Errors
    /// What the runtime says, or an input or output that the network does not have.
    fn run(&mut self, inputs: &[Input], outputs: &mut [Output]) -> Result<(), String>;
}

/// A tensor that goes in.
pub(crate) struct Input<'a> {
    pub(crate) name: &'a str,
    pub(crate) shape: &'a [usize],
    /// In C order.
    pub(crate) values: &'a [f32],
}

/// A tensor that comes out.
pub(crate) struct Output<'a> {
    pub(crate) name: &'a str,
    /// What was in it is replaced.
    pub(crate) values: &'a mut Vec<f32>,
}

/// A network's tensors.
pub(crate) struct Ports {
    pub(crate) inputs: Vec<FoundPort>,
    pub(crate) outputs: Vec<FoundPort>,
}

/// A tensor as the file describes it.
pub(crate) struct FoundPort {
    pub(crate) name: String,
    /// Its axes, `None` where the length is not fixed; `None` as a whole where the file does not say.
    pub(crate) shape: Option<Vec<Option<usize>>>,
    /// Whether its values are 32-bit floats, as far as the file says.
    pub(crate) is_f32: bool,
}

/// What runs a model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Runtime {
    /// `rten` or `onnxruntime`.
    pub name: &'static str,
    /// Its version, as far as it tells.
    pub version: String,
    /// Where it computes.
    pub device: Device,
    /// The library's file; `None`: it is part of the program.
    pub library: Option<std::path::PathBuf>,
}

impl std::fmt::Display for Runtime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.name, self.version)?;
        match self.device {
            Device::Cpu => Ok(()),
            device => write!(f, " on {}", device.name()),
        }
    }
}

/// ONNX Runtime as it would be used with this configuration.
///
/// # Errors
/// Why it cannot be used, and what to do.
pub fn onnx_runtime(config: &Config) -> Result<Runtime, NoRuntime> {
    installed(config).map(|backend| backend.about())
}

/// The embedded runtime.
pub(crate) fn embedded() -> rten::Embedded {
    rten::Embedded::new()
}

/// ONNX Runtime, loaded.
#[cfg(feature = "ort")]
pub(crate) fn installed(config: &Config) -> Result<onnxruntime::Installed, NoRuntime> {
    onnxruntime::Installed::load(config)
}

/// This build has none.
#[cfg(not(feature = "ort"))]
pub(crate) fn installed(_: &Config) -> Result<rten::Embedded, NoRuntime> {
    Err(NoRuntime::NotBuilt)
}

/// Runs foreign code that may panic on a strange network; the room must go on.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err("the runtime panicked".to_owned()))
}
