//! The embedded runtime: `rten`, pure Rust, one thread.

use std::sync::{Arc, OnceLock};

use rten::{Dimension, Model, ModelOptions, NodeId, RunOptions, ThreadPool, Value, ValueOrView};
use rten_tensor::{AsView, TensorView};

use super::{Backend, FoundPort, Input, Output, Ports, Runtime, Session, guarded};
use crate::Device;

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
            let session = RtenSession {
                model,
                options: RunOptions::default().with_thread_pool(Some(self.threads.clone())),
            };
            Ok(Box::new(session) as Box<dyn Session>)
        })
    }
}

struct RtenSession {
    model: Model,
    options: RunOptions,
}

impl RtenSession {
    fn node(&self, name: &str) -> Result<NodeId, String> {
        self.model.node_id(name).map_err(|error| error.to_string())
    }

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

    fn run(&mut self, inputs: &[Input], outputs: &mut [Output]) -> Result<(), String> {
        let nodes = outputs.iter().map(|output| self.node(output.name));
        let nodes: Vec<NodeId> = nodes.collect::<Result<_, _>>()?;
        let found = guarded(|| {
            let views = inputs
                .iter()
                .map(|input| Ok((self.node(input.name)?, view(input)?)));
            let views: Vec<(NodeId, ValueOrView)> = views.collect::<Result<_, String>>()?;
            self.model
                .run(views, &nodes, Some(self.options.clone()))
                .map_err(|error| error.to_string())
        })?;
        let mut pairs = found.into_iter().zip(outputs);
        pairs.try_for_each(|(value, output)| take(value, output))
    }
}

fn view<'a>(input: &Input<'a>) -> Result<ValueOrView<'a>, String> {
    let view = TensorView::try_from_data(input.shape, input.values);
    let view = view.map_err(|error| format!("input `{}`: {error}", input.name))?;
    Ok(view.into())
}

fn take(value: Value, output: &mut Output) -> Result<(), String> {
    let tensor = value
        .into_tensor::<f32>()
        .ok_or_else(|| format!("output `{}` is not of 32-bit floats", output.name))?;
    output.values.clear();
    match tensor.data() {
        Some(data) => output.values.extend_from_slice(data),
        None => output.values.extend(tensor.iter().copied()),
    }
    Ok(())
}
