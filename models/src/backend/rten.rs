//! The embedded runtime: `rten`, pure Rust, one thread.

use std::sync::{Arc, OnceLock};

use rten::{Dimension, Model, ModelOptions, NodeId, RunOptions, ThreadPool, Value, ValueOrView};
use rten_tensor::{AsView, NdTensorView};

use super::{Backend, FoundPort, Ports, Runtime, Session, guarded};
use crate::Device;
use crate::tensors::{JOINTS, Tensors};

/// Of the crate that is built in.
const VERSION: &str = "0.27";

/// The embedded runtime.
pub(crate) struct Embedded {
    threads: Arc<ThreadPool>,
}

impl Embedded {
    pub(crate) fn new() -> Self {
        // One for the whole program: small networks gain nothing from more, and other work needs the cores.
        static THREADS: OnceLock<Arc<ThreadPool>> = OnceLock::new();
        let threads = THREADS.get_or_init(|| Arc::new(ThreadPool::with_num_threads(1)));
        Self {
            threads: threads.clone(),
        }
    }
}

impl Backend for Embedded {
    fn about(&self) -> Runtime {
        Runtime {
            name: "rten",
            version: VERSION.to_owned(),
            device: Device::Cpu,
            library: None,
        }
    }

    fn open(&self, onnx: &[u8]) -> Result<Box<dyn Session>, String> {
        guarded(|| {
            let mut options = ModelOptions::with_all_ops();
            options.prepack_weights(true);
            let model = options
                .load(onnx.to_vec())
                .map_err(|error| error.to_string())?;
            let node = |name: &str| model.node_id(name).map_err(|error| error.to_string());
            let inputs = [node("pose"), node("mask"), node("age")];
            let outputs = [node("filled"), node("sigma")];
            let session = RtenSession {
                // A missing one is told by the check of the ports, with more to it.
                inputs: collect(inputs),
                outputs: collect(outputs),
                model,
                options: RunOptions::default().with_thread_pool(Some(self.threads.clone())),
            };
            Ok(Box::new(session) as Box<dyn Session>)
        })
    }
}

fn collect<const N: usize>(nodes: [Result<NodeId, String>; N]) -> Result<[NodeId; N], String> {
    let found = nodes.into_iter().collect::<Result<Vec<_>, _>>()?;
    found.try_into().map_err(|_| "too few tensors".to_owned())
}

struct RtenSession {
    model: Model,
    inputs: Result<[NodeId; 3], String>,
    outputs: Result<[NodeId; 2], String>,
    options: RunOptions,
}

impl RtenSession {
    fn port(&self, id: NodeId) -> FoundPort {
        let info = self.model.node_info(id);
        let shape = info.as_ref().and_then(|info| info.shape());
        let dtype = info.as_ref().and_then(|info| info.dtype());
        let length = |dimension: Dimension| match dimension {
            Dimension::Fixed(length) => Some(length),
            Dimension::Symbolic(_) => None,
        };
        FoundPort {
            name: info
                .and_then(|info| info.name())
                .unwrap_or_default()
                .to_owned(),
            shape: shape.map(|shape| shape.into_iter().map(length).collect()),
            is_f32: dtype
                .is_none_or(|dtype| dtype == rten::ValueType::Tensor(rten::DataType::Float)),
        }
    }
}

impl Session for RtenSession {
    fn ports(&self) -> Ports {
        let ports = |ids: &[NodeId]| ids.iter().map(|id| self.port(*id)).collect();
        Ports {
            inputs: ports(self.model.input_ids()),
            outputs: ports(self.model.output_ids()),
        }
    }

    fn run(&mut self, n: usize, tensors: &mut Tensors) -> Result<(), String> {
        let [pose, mask, age] = self.inputs.clone()?;
        let outputs = self.outputs.clone()?;
        let t = tensors.poses;
        let joints = [n, t, JOINTS];
        let [filled, sigma] = guarded(|| {
            let inputs: Vec<(NodeId, ValueOrView)> = vec![
                (pose, view([n, t, JOINTS, 3], &tensors.pose)?),
                (mask, view(joints, &tensors.mask)?),
                (age, view(joints, &tensors.age)?),
            ];
            self.model
                .run_n(inputs, outputs, Some(self.options.clone()))
                .map_err(|error| error.to_string())
        })?;
        take(filled, &mut tensors.filled, "filled")?;
        take(sigma, &mut tensors.sigma, "sigma")
    }
}

fn view<const N: usize>(shape: [usize; N], data: &[f32]) -> Result<ValueOrView<'_>, String> {
    let view = NdTensorView::try_from_data(shape, data).map_err(|error| error.to_string())?;
    Ok(view.into())
}

fn take(value: Value, into: &mut Vec<f32>, name: &str) -> Result<(), String> {
    let tensor = value
        .into_tensor::<f32>()
        .ok_or_else(|| format!("output `{name}` is not of 32-bit floats"))?;
    into.clear();
    match tensor.data() {
        Some(data) => into.extend_from_slice(data),
        None => into.extend(tensor.iter().copied()),
    }
    Ok(())
}
