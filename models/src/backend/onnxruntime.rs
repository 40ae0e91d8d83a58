//! ONNX Runtime, loaded when the program runs. Nothing of it is linked, and where it is not installed nothing is missed.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ort::environment::Environment;
use ort::ep;
use ort::session::builder::GraphOptimizationLevel;
use ort::session::{Session as OrtSession, SessionInputValue};
use ort::value::{Outlet, TensorElementType, TensorRef, ValueType};

use super::{Backend, FoundPort, Input, Output, Ports, Runtime, Session, guarded, places};
use crate::{Config, Device, NoRuntime};

/// ONNX Runtime, loaded.
pub(crate) struct Installed {
    environment: Environment,
    library: PathBuf,
    device: Device,
}

/// A process can load it once.
static LOADED: Mutex<Option<(Environment, PathBuf)>> = Mutex::new(None);

impl Installed {
    /// Loads the first library that works, or takes the one that is loaded.
    pub(crate) fn load(config: &Config) -> Result<Self, NoRuntime> {
        let candidates = places::candidates(&config.onnxruntime)?;
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let mut failed = None;
        if loaded.is_none() {
            for library in &candidates {
                match load(library) {
                    Ok(environment) => {
                        *loaded = Some((environment, library.clone()));
                        break;
                    }
                    Err(problem) => {
                        let path = library.clone();
                        failed.get_or_insert(NoRuntime::NotLoaded { path, problem });
                    }
                }
            }
        }
        match (&*loaded, failed) {
            (Some((environment, library)), _) => Ok(Self {
                environment: environment.clone(),
                library: library.clone(),
                device: config.device,
            }),
            (None, Some(failed)) => Err(failed),
            (None, None) => Err(NoRuntime::NotThere(config.onnxruntime.clone())),
        }
    }

    fn build(&self, onnx: &[u8]) -> ort::Result<OrtSession> {
        let mut builder = OrtSession::builder(&self.environment)?
            .with_optimization_level(GraphOptimizationLevel::All)?
            .with_intra_threads(1)?
            .with_inter_threads(1)?
            .with_intra_op_spinning(false)?
            .with_inter_op_spinning(false)?;
        let provider = match self.device {
            Device::Cpu => None,
            Device::Cuda => Some(ep::CUDA::default().build()),
            Device::Tensorrt => Some(ep::TensorRT::default().build()),
        };
        if let Some(provider) = provider {
            builder = builder.with_execution_providers([provider.error_on_failure()])?;
        }
        builder.commit_from_memory(onnx)
    }
}

fn load(library: &Path) -> Result<Environment, String> {
    guarded(|| {
        let builder = ort::init_from(library).map_err(|error| error.to_string())?;
        let builder = builder.with_name("posefuse").with_telemetry(false);
        builder.build().map_err(|error| error.to_string())
    })
}

impl Backend for Installed {
    fn about(&self) -> Runtime {
        Runtime {
            name: "onnxruntime",
            version: version(ort::info(), &self.library),
            device: self.device,
            library: Some(self.library.clone()),
        }
    }

    fn open(&self, onnx: &[u8]) -> Result<Box<dyn Session>, String> {
        guarded(|| {
            let session = self.build(onnx).map_err(|error| error.to_string())?;
            Ok(Box::new(Opened { session }) as Box<dyn Session>)
        })
    }
}

/// From the file's name (`libonnxruntime.so.1.31.1`), else from what the build says of itself (`git-branch=rel-1.31.1`).
fn version(info: &str, library: &Path) -> String {
    let is_version =
        |text: &str| text.contains('.') && text.starts_with(|c: char| c.is_ascii_digit());
    let name = library
        .file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default();
    let of_file = name.split_once(".so.").map(|(_, version)| version);
    let of_branch = info.split_once("git-branch=rel-").map(|(_, rest)| rest);
    let of_branch = of_branch.and_then(|rest| rest.split([',', ' ']).next());
    let found = of_file
        .into_iter()
        .chain(of_branch)
        .find(|text| is_version(text));
    found.unwrap_or("of unknown version").to_owned()
}

struct Opened {
    session: OrtSession,
}

impl Session for Opened {
    fn ports(&self) -> Ports {
        let ports = |outlets: &[Outlet]| outlets.iter().map(port).collect();
        Ports {
            inputs: ports(self.session.inputs()),
            outputs: ports(self.session.outputs()),
        }
    }

    fn run(&mut self, inputs: &[Input], outputs: &mut [Output]) -> Result<(), String> {
        let session = &mut self.session;
        guarded(|| call(session, inputs, outputs).map_err(|error| error.to_string()))
    }
}

fn call(session: &mut OrtSession, inputs: &[Input], outputs: &mut [Output]) -> ort::Result<()> {
    let values = inputs.iter().map(value).collect::<ort::Result<Vec<_>>>()?;
    let found = session.run(values)?;
    for output in outputs {
        let name = output.name;
        let value = found
            .get(name)
            .ok_or_else(|| ort::Error::new(format!("there is no output `{name}`")))?;
        let (_, data) = value.try_extract_tensor::<f32>()?;
        output.values.clear();
        output.values.extend_from_slice(data);
    }
    Ok(())
}

fn value<'a>(input: &Input<'a>) -> ort::Result<(&'a str, SessionInputValue<'a>)> {
    let view = TensorRef::from_array_view((input.shape.to_vec(), input.values))?;
    Ok((input.name, view.into()))
}

fn port(outlet: &Outlet) -> FoundPort {
    let (shape, is_f32) = match outlet.dtype() {
        ValueType::Tensor { ty, shape, .. } => {
            let axes = shape.iter().map(|length| usize::try_from(*length).ok());
            (Some(axes.collect()), *ty == TensorElementType::Float32)
        }
        _ => (None, false),
    };
    FoundPort {
        name: outlet.name().to_owned(),
        shape,
        is_f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_told_by_the_file_or_by_the_build() {
        let info = "ORT Build Info: git-branch=rel-1.31.1, git-commit-id=7d";
        let of = |info, path| version(info, Path::new(path));
        assert_eq!(of(info, "/lib/libonnxruntime.so.1.24.0"), "1.24.0");
        assert_eq!(of(info, "/lib/libonnxruntime.so"), "1.31.1");
        assert_eq!(of("", "/lib/libonnxruntime.so.1"), "of unknown version");
    }
}
