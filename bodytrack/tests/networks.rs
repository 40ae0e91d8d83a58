//! The networks in the program say what they said where they were trained.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use std::path::Path;

use posefuse_models::{BackendChoice, Config, Network, NetworkFile};

/// Most that two runtimes may differ.
const NEAR: f32 = 1e-3;

/// Runs `data/NAME.onnx` on the inputs of its golden file (`inputs`, then `outputs`, each for all items) and compares.
fn check(name: &str, inputs: &[&str], outputs: &[&str]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("data/{name}.toml"));
    let file = NetworkFile::read(&path).unwrap();
    let bytes = std::fs::read(path.with_extension("golden.bin")).unwrap();
    let numbers = bytes.as_chunks::<4>().0.iter();
    let golden: Vec<f32> = numbers.map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let manifest = file.manifest.clone();
    let each = |name: &&str| -> usize {
        let ports = manifest.inputs.get(*name).or(manifest.outputs.get(*name));
        ports.unwrap().item_shape().unwrap().iter().product()
    };
    let all: usize = inputs.iter().chain(outputs).map(each).sum();
    let count = golden.len() / all;
    assert!(count > 1 && golden.len() == count * all, "{name}");
    let config = Config {
        backend: BackendChoice::Rten,
        ..Config::default()
    };
    let mut network = Network::open(&file, &config).unwrap();
    let mut rest = golden.as_slice();
    let mut next = |name: &&str| rest.split_off(..count * each(name)).unwrap();
    for name in inputs {
        *network.input(name).unwrap() = next(name).to_vec();
    }
    network.run(count).unwrap();
    for name in outputs {
        let stored = next(name);
        let found = network.output(name);
        let far = found.iter().zip(stored).map(|(a, b)| (a - b).abs());
        let worst = far.fold(0.0, f32::max);
        assert!(worst <= NEAR, "{name}: {worst}");
        // Not the same for every item: the inputs count.
        assert_ne!(found[..each(name)], found[(count - 1) * each(name)..]);
    }
}

#[test]
fn joints_are_where_the_exported_network_put_them() {
    let outputs = ["joints", "sigma", "visible", "heading", "hands"];
    check("depth-joints", &["crop"], &outputs);
}

#[test]
fn hands_are_as_closed_as_the_exported_network_said() {
    check("depth-hands", &["hand", "known"], &["closed"]);
}
