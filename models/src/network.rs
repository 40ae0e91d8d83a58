//! Any small network: named tensors of 32-bit floats in and out, whose first axis is how many items go in at once.
//!
//! Its manifest (TOML) is that of an occlusion model without what is said of windows, and may carry `[settings]` for the
//! program that uses it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::backend::{self, Candidate, Chosen, Input, Output, Session, Trial};
use crate::file::{check_hash, read, read_manifest};
use crate::manifest::{self, About, Port, parse_versioned};
use crate::{Config, Refused, Runtime};

/// What is quick enough where a manifest does not say, ms.
const QUICK_MS: f64 = 5.0;

/// A network's manifest, checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkManifest {
    /// Of the format: [`MANIFEST_VERSION`](crate::MANIFEST_VERSION).
    pub version: i64,
    /// The network's name; its files have it, too.
    pub name: String,
    /// Of ONNX.
    pub opset: u32,
    /// Of the ONNX file, 64 hexadecimal digits.
    pub sha256: String,
    /// A call with one item that takes no longer is quick enough for the embedded runtime, ms.
    #[serde(default = "quick_ms")]
    pub quick_ms: f64,
    /// Tensors that go in; each one's first axis is `"N"`.
    pub inputs: BTreeMap<String, Port>,
    /// Tensors that come out; each one's first axis is `"N"`.
    pub outputs: BTreeMap<String, Port>,
    /// For people.
    pub about: About,
    /// What its user must know of it, by name.
    #[serde(default)]
    pub settings: BTreeMap<String, toml::Value>,
    /// Its figures: name, with unit, to number or text.
    #[serde(default)]
    pub figures: BTreeMap<String, toml::Value>,
}

fn quick_ms() -> f64 {
    QUICK_MS
}

impl NetworkManifest {
    /// Reads and checks a manifest; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused::Newer`], or [`Refused::Manifest`] with what was expected and found.
    pub fn parse(text: &str, place: &str) -> Result<Self, Refused> {
        let manifest: Self = parse_versioned(text, place)?;
        manifest.check().map_err(|problem| Refused::Manifest {
            place: place.to_owned(),
            problem,
        })?;
        Ok(manifest)
    }

    fn check(&self) -> Result<(), String> {
        manifest::check_name(&self.name)?;
        manifest::check_hash("sha256", &self.sha256)?;
        if !(0.0..=1e4).contains(&self.quick_ms) {
            let found = self.quick_ms;
            return Err(format!(
                "expected `quick_ms` from 0 to 10000, found {found}"
            ));
        }
        for (side, ports) in [("input", &self.inputs), ("output", &self.outputs)] {
            if ports.is_empty() {
                return Err(format!("expected at least one {side}"));
            }
            for (name, port) in ports {
                port.item_shape().ok_or_else(|| {
                    let found = port.shown();
                    format!("expected {side} `{name}` of shape N x LENGTH ..., found {found}")
                })?;
            }
        }
        Ok(())
    }
}

/// A network whose files fit each other. It has not been opened yet.
#[derive(Clone, Debug)]
pub struct NetworkFile {
    /// Its manifest.
    pub manifest: NetworkManifest,
    /// Where it is from: a path, or that it is part of the program.
    pub place: String,
    onnx: Cow<'static, [u8]>,
}

impl NetworkFile {
    /// Reads the manifest at `path` (NAME.toml) and the network beside it (NAME.onnx).
    ///
    /// # Errors
    /// What is missing, damaged or not understood, and what to do.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        let (place, text) = read_manifest(path)?;
        let onnx = read(&path.with_extension("onnx"))?;
        Self::from_parts(&text, &place, onnx)
    }

    /// A network that is part of the program; `place` names it in refusals.
    ///
    /// # Errors
    /// As [`NetworkFile::read`].
    pub fn from_parts(
        manifest: &str,
        place: &str,
        onnx: impl Into<Cow<'static, [u8]>>,
    ) -> Result<Self, Refused> {
        let (manifest, onnx) = (NetworkManifest::parse(manifest, place)?, onnx.into());
        check_hash(&onnx, "onnx", &manifest.sha256, &manifest.name, place)?;
        Ok(Self {
            manifest,
            place: place.to_owned(),
            onnx,
        })
    }
}

/// A network that is ready to run.
pub struct Network {
    place: String,
    runtime: Runtime,
    why: String,
    latency: Duration,
    session: Box<dyn Session>,
    tensors: Named,
}

/// A call that failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct RunError {
    /// Which network.
    pub place: String,
    /// What was expected and found, or what the runtime says.
    pub problem: String,
}

impl Network {
    /// Opens a network: chooses what runs it, compares it with its manifest and tries it on zeros.
    ///
    /// # Errors
    /// No runtime can use it, or it is not what its manifest says, or it gives nonsense.
    pub fn open(file: &NetworkFile, config: &Config) -> Result<Self, Refused> {
        let manifest = &file.manifest;
        let candidate = Candidate {
            place: &file.place,
            onnx: &file.onnx,
            inputs: &manifest.inputs,
            outputs: &manifest.outputs,
            quick: Duration::from_secs_f64(manifest.quick_ms * 1e-3),
            counts: [2, 1],
        };
        let mut tensors = Named::of(manifest);
        let Chosen {
            runtime,
            why,
            latency,
            session,
            ..
        } = backend::choose(&candidate, &mut tensors, config)?;
        Ok(Self {
            place: file.place.clone(),
            runtime,
            why,
            latency,
            session,
            tensors,
        })
    }

    /// What runs it.
    pub fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// Why that runs it, in words.
    pub fn why(&self) -> &str {
        &self.why
    }

    /// One call for one item, median of those it was tried with.
    pub fn latency(&self) -> Duration {
        self.latency
    }

    /// The values of the input `name`, in C order, to be filled before a run; `None` if there is no such input.
    /// They stay as they are between runs.
    pub fn input(&mut self, name: &str) -> Option<&mut Vec<f32>> {
        let mut inputs = self.tensors.inputs.iter_mut();
        let tensor = inputs.find(|tensor| tensor.name == name)?;
        Some(&mut tensor.values)
    }

    /// Runs the network on the first `count` items.
    ///
    /// # Errors
    /// An input has another length than so many items need, the runtime fails, or an output holds a value that is no
    /// number.
    pub fn run(&mut self, count: usize) -> Result<(), RunError> {
        self.tensors
            .run(&mut *self.session, count)
            .and_then(|()| self.tensors.check())
            .map_err(|problem| RunError {
                place: self.place.clone(),
                problem,
            })
    }

    /// The values of the output `name` after a run, in C order; empty if there is no such output.
    pub fn output(&self, name: &str) -> &[f32] {
        let mut outputs = self.tensors.outputs.iter();
        let tensor = outputs.find(|tensor| tensor.name == name);
        tensor.map_or(&[], |tensor| &tensor.values)
    }
}

/// Tensors by name, kept between calls so that nothing grows.
struct Named {
    inputs: Vec<Tensor>,
    outputs: Vec<Tensor>,
}

struct Tensor {
    name: String,
    /// The first axis is set at each call.
    shape: Vec<usize>,
    values: Vec<f32>,
}

impl Tensor {
    /// Values of one item.
    fn each(&self) -> usize {
        self.shape[1..].iter().product()
    }
}

impl Named {
    fn of(manifest: &NetworkManifest) -> Self {
        let tensors = |ports: &BTreeMap<String, Port>| {
            let tensor = |(name, port): (&String, &Port)| {
                let mut shape = vec![0];
                shape.extend(port.item_shape()?);
                let (name, values) = (name.clone(), Vec::new());
                Some(Tensor {
                    name,
                    shape,
                    values,
                })
            };
            ports.iter().filter_map(tensor).collect()
        };
        Self {
            inputs: tensors(&manifest.inputs),
            outputs: tensors(&manifest.outputs),
        }
    }
}

impl Trial for Named {
    fn what(&self) -> &'static str {
        "zeros"
    }

    fn fill(&mut self, count: usize) {
        for tensor in &mut self.inputs {
            let length = count * tensor.each();
            tensor.values.clear();
            tensor.values.resize(length, 0.0);
        }
    }

    fn run(&mut self, session: &mut dyn Session, count: usize) -> Result<(), String> {
        for tensor in &mut self.inputs {
            tensor.shape[0] = count;
            let (expected, found) = (count * tensor.each(), tensor.values.len());
            if found != expected {
                let name = &tensor.name;
                return Err(format!(
                    "input `{name}` has {found} values for {count} items, expected {expected}"
                ));
            }
        }
        let inputs = self.inputs.iter().map(|tensor| Input {
            name: &tensor.name,
            shape: &tensor.shape,
            values: &tensor.values,
        });
        let inputs: Vec<Input> = inputs.collect();
        let outputs = self.outputs.iter_mut().map(|tensor| {
            tensor.shape[0] = count;
            Output {
                name: &tensor.name,
                values: &mut tensor.values,
            }
        });
        let mut outputs: Vec<Output> = outputs.collect();
        session.run(&inputs, &mut outputs)
    }

    fn check(&self) -> Result<(), String> {
        for tensor in &self.outputs {
            let (name, found) = (&tensor.name, tensor.values.len());
            let expected = tensor.shape[0] * tensor.each();
            if found != expected {
                return Err(format!(
                    "it gave `{name}` {found} values, expected {expected}"
                ));
            }
            if tensor.values.iter().any(|value| !value.is_finite()) {
                return Err(format!("it gave `{name}` a value that is no number"));
            }
        }
        Ok(())
    }
}
