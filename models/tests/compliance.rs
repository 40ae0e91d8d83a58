//! Every shipped model and the test networks, on both runtimes, against what PyTorch gave.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail the test")]

use std::fs;
use std::path::Path;

use posefuse_models::{BackendChoice, Config, ModelFile, agreement, onnx_runtime};

mod support;
use support::{fixtures, on, shipped};

/// Beyond this a runtime computes something else, metres.
const NEAR_M: f32 = 1e-4;

#[test]
fn every_model_gives_on_rten_what_pytorch_gave() {
    let count = compare(BackendChoice::Rten);
    assert!(count >= 3, "only {count} models were compared");
}

#[test]
fn every_model_gives_on_onnx_runtime_what_pytorch_gave() {
    match onnx_runtime(&Config::default()) {
        Ok(_) => assert!(compare(BackendChoice::Ort) >= 3),
        Err(why) => {
            // A runtime that somebody named must work: no silent way around the test.
            assert!(std::env::var_os("ORT_DYLIB_PATH").is_none(), "{why}");
            eprintln!("SKIPPED: the comparison on ONNX Runtime, for {why}");
        }
    }
}

/// How many models were compared.
fn compare(backend: BackendChoice) -> usize {
    let mut count = 0;
    for path in manifests(&shipped()).chain(manifests(&fixtures())) {
        // Some test networks are there to be refused.
        if !path.starts_with(shipped()) && !path.to_string_lossy().contains("tiny-") {
            continue;
        }
        let file = ModelFile::read(&path).unwrap();
        let found = agreement(&file, &on(backend)).unwrap();
        let found = found.unwrap_or_else(|| panic!("{} has no stored outputs", file.place));
        eprintln!(
            "{} on {}: {:.1e} m",
            file.manifest.name, found.runtime, found.filled_m
        );
        assert!(found.filled_m <= NEAR_M, "{}: {found:?}", file.place);
        assert!(found.sigma_m <= NEAR_M, "{}: {found:?}", file.place);
        count += 1;
    }
    count
}

fn manifests(folder: &Path) -> impl Iterator<Item = std::path::PathBuf> {
    let files = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    files.filter(|path| {
        path.extension().is_some_and(|kind| kind == "toml") && !path.ends_with("default.toml")
    })
}
